"""A network as ONNX: in onnxruntime it does what it does here, and its file says all that one needs."""

import json
import re
import sys

import numpy as np
import pytest
import torch

import motionlab
from motionlab.__main__ import main
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import ModelError
from motionlab.models import AcLstm, Erd, LstmGmm, Refiner
from motionlab.training.checkpoints import save_weights
from motionlab.weights.export import KEY, about, check_has_step, export_onnx

NAME = "lstm-gmm-permissive"
pytest.importorskip("onnx")
runtime = pytest.importorskip("onnxruntime")


def opened(path):
    """What runs a file, and what it says of itself."""
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1
    session = runtime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    return session, json.loads(session.get_modelmeta().custom_metadata_map[KEY])


def step(session, **inputs):
    """Outputs by name."""
    arrays = {name: np.float32(value) for name, value in inputs.items()}
    names = [output.name for output in session.get_outputs()]
    return dict(zip(names, session.run(names, arrays), strict=True))


def strange(make, **settings):
    """A small network of random weights, no layer at rest, and none that half precision holds."""
    torch.manual_seed(1)
    encoding = JointAngles(motionlab.Skeleton.canonical(), contacts=True)
    normalizer = Normalizer(encoding.dim, encoding.dim - 3)
    normalizer.mean.normal_()
    normalizer.std.uniform_(0.5, 2)
    normalizer.kept.copy_(torch.randperm(encoding.dim)[3:].sort()[0])
    model = make(encoding, normalizer, width=12, **settings)
    for parameter in model.parameters():
        parameter.data.normal_(std=0.3)
    model.starts, model.start_names = model.zero_state(3), ("a", "b", "c")
    return model.eval().requires_grad_(False)


@pytest.fixture(scope="module")
def generator(tmp_path_factory):
    """The shipped network, and its file opened."""
    model = motionlab.load(NAME)
    path = export_onnx(model, tmp_path_factory.mktemp("onnx") / "walker.onnx")
    return model, *opened(path), path


# -- the same numbers -----------------------------------------------------------------------------


def drawn(session, model, start, n, generator, temperature, component_temperature, memory):
    """Frames (batch, n, dim), with the chance that `generate` draws from a generator of torch."""
    state = {"frame": model.normalizer(start.frame), "hidden": start.hidden, "cell": start.cell}
    rows, noise = [], None
    for _ in range(n):
        waiting = torch.empty(len(start.frame), model.components)
        gumbel = -waiting.exponential_(generator=generator).log()
        fresh = torch.randn(len(start.frame), model.kept, generator=generator)
        noise = fresh if noise is None else memory * noise + (1 - memory**2) ** 0.5 * fresh
        chance = {"noise": temperature * noise, "gumbel": component_temperature * gumbel}
        out = step(session, **state, **chance)
        state = {part: out[f"{part}_after"] for part in state}
        rows.append(out["features"])
    return torch.tensor(np.stack(rows, 1))


def test_the_same_chance_gives_the_motion_of_generate(generator):
    model, session, *_ = generator
    chance = {"temperature": 0.3, "component_temperature": 0.7, "memory": 0.6}
    start = model.starts[[0, 8]]
    with torch.no_grad():
        wanted = model.generate(90, start, generator=torch.Generator().manual_seed(3), **chance)
    found = drawn(session, model, start, 90, torch.Generator().manual_seed(3), **chance)
    apart = model.encoding.positions(found) - model.encoding.positions(wanted)
    assert apart.norm(dim=-1).max() < 1e-4  # metres
    torch.testing.assert_close(found, wanted, atol=1e-4, rtol=0)


@pytest.mark.parametrize("skip", [0, 0.9])
def test_the_mixture_is_the_models_and_without_chance_the_likeliest_mean(tmp_path, skip):
    model = strange(LstmGmm, components=4, skip=skip)
    session, _ = opened(export_onnx(model, tmp_path / "strange.onnx"))
    features = torch.randn(2, 5, model.encoding.dim)
    state = model.observe(features)
    wanted = model.predict(state)
    out = step(
        session, frame=model.normalizer(state.frame), hidden=state.hidden, cell=state.cell,
        noise=np.zeros((2, model.kept)), gumbel=np.zeros((2, 4)),
    )  # fmt: skip
    for name in ("log_weights", "means", "stds"):
        torch.testing.assert_close(torch.tensor(out[name]), getattr(wanted, name))
    best = wanted.log_weights.argmax(-1)
    frame = wanted.means[torch.arange(2), best]
    torch.testing.assert_close(torch.tensor(out["frame_after"]), frame)
    raw = model.normalizer.inverse(frame)
    torch.testing.assert_close(torch.tensor(out["features"]), raw)
    after = model.step(raw, state)[1]
    for name in ("hidden", "cell"):
        torch.testing.assert_close(torch.tensor(out[f"{name}_after"]), getattr(after, name))
    far = step(
        session, frame=model.normalizer(state.frame), hidden=state.hidden, cell=state.cell,
        noise=np.ones((2, model.kept)), gumbel=1e3 * np.eye(4)[[3, 1]],
    )  # fmt: skip
    frame = torch.stack([wanted.means[i, j] + wanted.stds[i, j] for i, j in enumerate((3, 1))])
    torch.testing.assert_close(torch.tensor(far["frame_after"]), frame)


@pytest.mark.parametrize("staircase", [False, True])
def test_a_dancer_goes_on_as_here(tmp_path, staircase):
    model = strange(AcLstm, layers=3, staircase=staircase)
    session, _ = opened(export_onnx(model, tmp_path / "dancer.onnx"))
    state = model.observe(torch.randn(2, 5, model.encoding.dim))
    with torch.no_grad():
        chance = torch.Generator().manual_seed(3)
        wanted = model.generate(6, state, generator=chance, noise=0.1)
    chance, memory = torch.Generator().manual_seed(3), (state.hidden, state.cell)
    for t in range(6):
        noise = torch.randn(2, model.encoding.dim, generator=chance)[:, model.normalizer.kept]
        out = step(session, hidden=memory[0], cell=memory[1], noise=0.1 * noise)
        memory = out["hidden_after"], out["cell_after"]
        torch.testing.assert_close(torch.tensor(out["features"]), wanted[:, t])


@pytest.mark.parametrize("settings", [{}, {"reach": 0.05}, {"reach": 0.05, "slow": 0.1}], ids=str)
def test_a_refiner_corrects_as_here(tmp_path, settings):
    model = strange(Refiner, **settings)
    session, about = opened(export_onnx(model, tmp_path / "refiner.onnx"))
    features = 0.3 * torch.randn(2, 6, model.encoding.dim)
    features[0, 0, 6:] = 0  # rotation vectors without a length
    wanted, before = model(features), features[:, 0]
    hidden = cell = np.zeros((2, *about["inputs"]["hidden"]))
    for t in range(6):
        out = step(session, features=features[:, t], before=before, hidden=hidden, cell=cell)
        hidden, cell, before = out["hidden_after"], out["cell_after"], features[:, t]
        found = torch.tensor(out["refined"])
        torch.testing.assert_close(found, wanted[:, t], atol=2e-5, rtol=2e-5)


def test_half_precision_is_kept_where_it_loses_nothing(generator, tmp_path):
    model, session, about, path = generator
    whole = export_onnx(model, tmp_path / "whole.onnx", half=False)
    assert path.stat().st_size < 0.6 * whole.stat().st_size
    inputs = {name: np.full((1, *shape), 0.1) for name, shape in about["inputs"].items()}
    there, here = (step(each, **inputs) for each in (session, opened(whole)[0]))
    assert all(np.array_equal(there[name], here[name]) for name in there)
    odd = strange(LstmGmm)
    one, other = (export_onnx(odd, tmp_path / f"{half}.onnx", half) for half in (True, False))
    assert one.read_bytes() == other.read_bytes()


# -- what the file says ---------------------------------------------------------------------------


def test_the_file_says_what_an_engine_needs(generator):
    model, session, about, _ = generator
    assert (about["name"], about["kind"], about["fps"]) == (NAME, "LstmGmm", 30)
    assert about["hash"] == model.hash and about["units"]["up"] == "y"
    names, slices = about["features"]["names"], about["features"]["slices"]
    assert names[:3] == ["dx", "dz", "dyaw"] and len(names) == model.encoding.dim
    assert slices == {"root": [0, 6], "pose": [6, 66], "contacts": [66, 68]}
    body, ours = about["skeleton"], model.encoding.skeleton
    assert tuple(body["names"]) == ours.names and tuple(body["parents"]) == ours.parents
    assert np.array_equal(np.float32(body["offsets"]), ours.offsets.numpy())
    assert np.array_equal(
        np.float32(about["encoding"]["mean_pose"]), model.encoding.mean_pose.float().numpy()
    )
    for part in ("mean", "std", "kept"):
        told = np.float32(about["normalizer"][part])
        assert np.array_equal(told, np.float32(getattr(model.normalizer, part)))
    assert about["sampling"] == {"temperature": 0.11, "component_temperature": 1.0, "memory": 0.0}
    for side, told in (("inputs", session.get_inputs()), ("outputs", session.get_outputs())):
        assert about[side] == {value.name: value.shape[1:] for value in told}
    assert session.get_modelmeta().description == model.card
    assert about["commercial"] and "mocap.cs.cmu.edu" in about["licence"]
    assert "Wang" in about["citation"]


def test_its_starts_are_the_models_to_the_last_digit(generator):
    model, _, about, _ = generator
    assert tuple(start["name"] for start in about["starts"]) == model.start_names
    frames = model.normalizer(model.starts.frame)
    for i, start in enumerate(about["starts"]):
        for part, wanted in (("frame", frames), ("hidden", model.starts.hidden)):
            assert np.array_equal(np.float32(start[part]), wanted[i].numpy())


@pytest.mark.parametrize("name", ["lstm-gmm", "aclstm-walking", "refiner"])
def test_other_shipped_networks_tell_their_licence_too(name, tmp_path):
    _, about = opened(export_onnx(motionlab.load(name), tmp_path / "its.onnx"))
    assert not about["commercial"] and about["licence"].startswith("Not for commercial use")
    assert set(about["sampling"]) <= set(about["inputs"]) | {
        "temperature", "component_temperature", "memory",
    }  # fmt: skip
    for start in about["starts"]:
        assert start.keys() - {"name"} <= about["inputs"].keys()


def test_of_weights_that_nothing_is_known_of_nothing_is_allowed(tmp_path):
    _, about = opened(export_onnx(strange(LstmGmm), tmp_path / "own.onnx"))
    assert not about["commercial"] and "nothing is known" in about["licence"]


# -- what can't be written ------------------------------------------------------------------------


def test_without_onnx_one_is_told_how_to_have_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "onnx", None)
    monkeypatch.delitem(sys.modules, "motionlab.weights.export.graph", raising=False)
    with pytest.raises(ModelError, match="pip install onnx"):
        export_onnx(strange(LstmGmm), tmp_path / "a.onnx")


def test_a_network_without_a_step_is_named():
    with pytest.raises(ModelError, match="Erd can't be exported.*LstmGmm, AcLstm, Refiner"):
        check_has_step(strange(Erd))
    with pytest.raises(ModelError, match="Erd can't be exported"):
        about(strange(Erd))
    encoding = JointAngles(motionlab.Skeleton.canonical(), rotation="euler")
    with pytest.raises(ModelError, match="'euler' can't be exported"):
        export_onnx(Refiner(encoding, Normalizer(encoding.dim), width=4), "never.onnx")


def test_where_nothing_can_be_written_is_told(tmp_path):
    with pytest.raises(ModelError, match="can't be written"):
        export_onnx(strange(LstmGmm), tmp_path / "nowhere" / "a.onnx")


def test_the_command_writes_the_file(tmp_path, monkeypatch, capsys):
    """Of own weights, too: of a training that was not shipped."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    save_weights(tmp_path / "runs" / "best.safetensors", strange(LstmGmm), {})
    assert main(["export", "runs/best.safetensors", "--onnx"]) == 0
    assert "best.onnx: " in capsys.readouterr().out
    _, about = opened("best.onnx")
    assert [start["name"] for start in about["starts"]] == ["mean frame"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nobody", "--onnx"], "none are shipped under this name"),
        ([NAME], "as what?.*--onnx"),
        ([NAME, "--onnx", "--out", "walk.bin"], "must end in .onnx"),
        ([NAME, "--onnx", "--out", "nowhere/walk.onnx"], "can't be written to"),
        ([NAME, "--onnx", "--out", "there.onnx"], "is there already; --force"),
        ([NAME, "--onnx", "--out", "folder.onnx"], "is a folder"),
        (["there.onnx", "--onnx", "--out", "new.onnx"], "there.onnx"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_command_that_can_do_nothing_says_why(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.onnx").write_bytes(b"something")
    (tmp_path / "folder.onnx").mkdir()
    assert main(["export", *words]) == 1
    told = capsys.readouterr().err
    assert re.search(said, told) and "Traceback" not in told
    assert (tmp_path / "there.onnx").read_bytes() == b"something"
