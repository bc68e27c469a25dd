"""`motionlab.load`: shipped weights and one's own, and what is not weights."""

import copy
import json
import shutil

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

import motionlab
from experiments.shipping import cards
from experiments.shipping.weights import ship
from motionlab import contacts, metrics, weights
from motionlab.errors import ModelError, TrainingError
from motionlab.models import LstmGmm
from motionlab.training.checkpoints import load_weights, save_weights
from motionlab.training.starts import candidates, changes, choose


@pytest.fixture(scope="module")
def model(shipped):
    return motionlab.load(shipped)


def test_shipped_weights_are_ready_to_generate(model):
    assert isinstance(model, LstmGmm) and not model.training
    assert all(p.dtype == torch.float32 and not p.requires_grad for p in model.parameters())
    assert model.fps == 30 and "contacts" in model.encoding.slices
    count = len(model.start_names)
    assert count == len(set(model.start_names)) == len(model.starts.frame) > 3
    made = model.generate(40, model.starts[1:3], **model.sampling)
    assert made.shape == (2, 40, model.encoding.dim) and not made.requires_grad
    assert len(model.encoding.to_motion(made[0])) == 40
    assert model.sampling == {"temperature": 0.5}


def test_starts_are_states_that_the_rounded_network_reaches(model, gaits):
    found = choose(candidates(gaits.data)) + changes(gaits.data)
    assert tuple(start.name for start in found) == model.start_names
    clips = gaits.data.clips("val")
    for index, start in enumerate(found):
        seen = model.observe(clips[start.clip][start.frame - 30 : start.frame])
        for part, its in zip(seen, model.starts[index], strict=True):
            torch.testing.assert_close(part, its, rtol=1e-4, atol=1e-5)


def test_parameters_are_rounded_and_nothing_else(shipped, trained, model):
    with safe_open(shipped, framework="pt") as file:
        kinds = {name: file.get_tensor(name).dtype for name in file.keys()}  # noqa: SIM118
    parameters = dict(model.named_parameters())
    assert {name for name, kind in kinds.items() if kind == torch.float16} == parameters.keys()
    assert kinds["normalizer.kept"] == torch.int64 and kinds["normalizer.std"] == torch.float32
    full = load_weights(trained)[0].state_dict()
    for name, tensor in model.state_dict().items():
        rounded = full[name].half().float() if name in parameters else full[name]
        assert torch.equal(tensor, rounded), name


def test_a_file_of_a_training_starts_from_the_mean_frame(trained):
    model = motionlab.load(trained)
    assert model.start_names == ("mean frame",) and model.card == "" and model.sampling == {}
    expected = model.observe(model.normalizer.mean[None])
    for part, its in zip(model.starts, expected, strict=True):
        assert torch.equal(part, its)
    assert model.generate(3, model.starts).shape == (1, 3, model.encoding.dim)
    assert model.about["name"] == "lstm-gmm-contacts"


def test_names_are_found_before_files(shipped, monkeypatch, tmp_path):
    monkeypatch.setattr(weights, "_FOLDER", shipped.parent)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny").write_text("in the way")
    assert weights.names() == ["tiny"]
    assert motionlab.load("tiny").start_names == motionlab.load(shipped).start_names
    with pytest.raises(ModelError, match="Weights 'small': there is no such file.*there are tiny"):
        motionlab.load("small")


def test_loading_leaves_chance_alone(shipped):
    torch.manual_seed(5)
    before = torch.get_rng_state()
    motionlab.load(shipped)
    assert torch.equal(torch.get_rng_state(), before)


@pytest.mark.parametrize("kept", [0, 7, 300, -1000])
def test_damaged_files(shipped, tmp_path, kept):
    path = tmp_path / "cut.safetensors"
    path.write_bytes(shipped.read_bytes()[:kept])
    with pytest.raises(
        TrainingError, match="cut.safetensors: is no file of weights that motionlab wrote, or a"
    ):
        motionlab.load(path)


def foreign(path, header):
    save_file(
        {"a": torch.zeros(3)}, path, None if header is None else {"motionlab": json.dumps(header)}
    )


@pytest.mark.parametrize(
    "header",
    [None, {}, [], {"kind": "Transformer", "config": {}}, {"kind": "LstmGmm", "config": {}}],
    ids=["no header", "empty", "list", "other kind", "no config"],
)
def test_foreign_files(tmp_path, header):
    foreign(tmp_path / "other.safetensors", header)
    with pytest.raises(TrainingError, match="other.safetensors: "):
        motionlab.load(tmp_path / "other.safetensors")


def test_weights_and_header_of_different_models(trained, tmp_path):
    model, about = load_weights(trained)
    wider = copy.copy(model)
    wider.config = lambda: {**model.config(), "width": 33}
    wider.__class__ = type("LstmGmm", (LstmGmm,), {})
    save_weights(tmp_path / "mixed.safetensors", wider, about)
    with pytest.raises(TrainingError, match="holds no weights"):
        motionlab.load(tmp_path / "mixed.safetensors")
    starts = model.zero_state()
    save_weights(tmp_path / "good.safetensors", model, about, starts=starts)
    assert torch.equal(load_weights(tmp_path / "good.safetensors")[0].starts.frame, starts.frame)


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(ModelError, match="is a folder"):
        motionlab.load(tmp_path)


def test_shipped_weights_can_be_trained_further(shipped, gaits):
    from motionlab.training import PRESETS, build

    model = build(gaits.data, PRESETS["lstm-gmm-contacts"]["smoke"], shipped)
    assert all(parameter.requires_grad for parameter in model.parameters())


# -- the card, and what is really shipped ---------------------------------------------------------


def test_card_says_what_the_file_holds(model, shipped, gaits, tmp_path):
    about = model.about
    assert about["command"].startswith("motionlab train lstm-gmm-contacts --preset smoke --data")
    assert about["command"].endswith("--updates 60 --seed 3")
    half, full = (about["log_likelihood"][kind]["value"] for kind in ("half", "full"))
    assert abs(half - full) < 0.1 and half != full
    for said in (
        about["command"], gaits.data.hash, f"{half:.3f} nats", f"{shipped.stat().st_size / 2**20:.1f} MiB",
        "| seed | 3 |", "temperature 0.5", *model.start_names, "allow commercial use", "MIT",
    ):  # fmt: skip
        assert said in model.card, said
    assert motionlab.load(shutil.copy(shipped, tmp_path / "b.safetensors")).hash == model.hash
    assert "familiar" not in about and "warns" not in model.card  # of 26 held-out seconds
    about = {**about, "familiar": {"likelihood": -12.5, "distance": 4.75}}
    said = "warns of a start | below -12.5 nats a frame, or beyond a distance of 4.75 |\n| sampling"
    assert said in cards.card(about, model, shipped, 9, 1.0)


def test_the_hash_of_tensors_outlives_another_way_to_write_them(shipped, model, tmp_path):
    tensors = load_file(shipped)
    with safe_open(shipped, "pt") as file:
        said = file.metadata()
    again = tmp_path / "again.safetensors"
    save_file(dict(reversed(tensors.items())), again, {**said, "by": "a tool"})
    assert again.read_bytes() != shipped.read_bytes()
    assert weights.tensor_hash(again) == weights.tensor_hash(shipped)
    assert f"| tensors | sha256 {weights.tensor_hash(shipped)}," in model.card
    name = min(tensors)
    for other in ({**tensors, name: tensors[name] + 1}, {**tensors, name: tensors[name][None]}):
        save_file(other, again, said)
        assert weights.tensor_hash(again) != weights.tensor_hash(shipped), "nothing gets past it"
    again.write_bytes(shipped.read_bytes()[:999])
    with pytest.raises(motionlab.MotionLabError, match="again.safetensors: is no file of weights"):
        weights.tensor_hash(again)


@pytest.mark.parametrize("name", weights.names())
def test_every_card_names_the_tensors_of_its_file(name):
    card = weights.find(name).with_suffix(".md").read_text(encoding="utf-8")
    assert f"| tensors | sha256 {weights.tensor_hash(name)}," in card


def test_card_says_what_a_training_began_with(model, shipped, monkeypatch):
    assert "| began with | chance |" in model.card
    made = {**model.about, "name": "lstm-gmm-contacts", "start": model.hash}
    assert " --from WEIGHTS --updates 60" in cards.command_of(made, "gaits")
    monkeypatch.setattr(weights, "_FOLDER", shipped.parent)
    assert " --from tiny --updates 60" in cards.command_of(made, "gaits")
    card = cards.card({**model.about, "start": model.hash}, model, shipped, 9, 1.0)
    assert f"| began with | weights of sha256 {model.hash} |" in card


def test_other_data_than_those_of_the_training_are_refused(trained, gaits, tmp_path):
    from motionlab.training import prepared

    data = gaits.data
    fewer = tuple("test" if i == 0 else split for i, split in enumerate(data.splits))
    digest = prepared._digest(prepared._arrays(
        data.features, data.lengths, data.names, fewer, data.normalizer, data.encoding
    ))  # fmt: skip
    type(data)(data.features, data.lengths, data.names, fewer, data.encoding, data.normalizer,
               digest).save(tmp_path / "fewer.npz")  # fmt: skip
    with pytest.raises(motionlab.MotionLabError, match="was not trained on"):
        ship("x", trained, str(tmp_path / "fewer.npz"), tmp_path / "out", {})
    assert not (tmp_path / "out").exists()


def test_a_dancer_ships_with_starts_and_a_card(tmp_path):
    """Trained for a second on gaits that pass for a dance at 60 frames a second."""
    from motionlab import datasets
    from motionlab.encodings import Normalizer, RootRelative
    from motionlab.training import PRESETS, Prepared, build, loop, prepared

    motions = [m.resample(60) for m in datasets.load("gaits")[:5]]
    encoding = RootRelative(motions[0].skeleton, 60.0)
    clips, splits = [encoding.encode(m) for m in motions], ("train",) * 3 + ("val",) * 2
    names = tuple(f"gaits/{m.name}_{1 + i % 2}/2" for i, m in enumerate(motions))
    rest = (torch.cat(clips), torch.tensor([len(c) for c in clips]), names, splits)
    normalizer = Normalizer.fit(clips)
    digest = prepared._digest(prepared._arrays(*rest, normalizer, encoding))
    data = Prepared(*rest, encoding, normalizer, digest)
    data.save(tmp_path / "dance.npz")
    preset = PRESETS["aclstm-indian"]["smoke"]
    loop.train(build(data, preset), data, preset, tmp_path, name="aclstm-indian", accelerator="cpu")
    path = ship(
        "aclstm-tiny", tmp_path / "last.safetensors", str(tmp_path / "dance.npz"), tmp_path, {}
    )
    model = motionlab.load(path)
    assert all(name.startswith("walk_1.3, ") for name in model.start_names)  # the first half
    assert len(model.starts.frame) == len(model.start_names) > 1 and model.sampling == {}
    assert model.generate(30, model.starts).isfinite().all()
    half, full = (model.about["validation loss"][kind] for kind in ("half", "full"))
    assert half != full and half == pytest.approx(full, rel=0.01)
    for said in ("# aclstm-tiny\n", "Zhou and others", f"held-out loss | {half:.4f}", "MIT",
                 "motionlab train aclstm-indian --preset smoke"):  # fmt: skip
        assert said in model.card, said
    about = {**model.about, "preset": {**model.about["preset"], "feeding": "teacher"}}
    assert "trained on recorded frames alone" in cards.card(about, model, path, 3, 1.0)


def test_an_strnn_ships_with_a_card_and_goes_on_from_frames(gaits, tmp_path):
    from motionlab import datasets
    from motionlab.training import PRESETS, build, loop

    preset = PRESETS["strnn-temporal-hy"]["smoke"]
    train = {"name": "strnn-temporal-hy", "accelerator": "cpu"}
    loop.train(build(gaits.data, preset), gaits.data, preset, tmp_path, **train)
    path = ship(
        "strnn-tiny", tmp_path / "best.safetensors", str(gaits.path), tmp_path, {"noise": 0.05}
    )
    model = motionlab.load(path)
    assert model.sampling == {"noise": 0.05} and 0 < len(model.start_names) == len(model.starts)
    assert model.starts.shape[1:] == (20, 73) and set(model.start_names) <= set(gaits.data.names)
    assert model.extrapolate(model.starts, 30).shape == (len(model.starts), 30, 73)
    seen = model.encoding.encode(datasets.load("gaits")[0])
    assert model.extrapolate(seen, 30, **model.sampling).isfinite().all()
    half, full = (model.about["validation loss"][kind] for kind in ("half", "full"))
    assert half != full and half == pytest.approx(full, rel=0.01)
    for said in ("# strnn-tiny\n", "Long-horizon", f"held-out loss | {half:.4f}", "foretold", "MIT",
                 "model.extrapolate(model.starts[0], 300", "the best of validation",
                 "motionlab train strnn-temporal-hy --preset smoke"):  # fmt: skip
        assert said in model.card, said
    with pytest.raises(motionlab.MotionLabError, match="noise"):
        ship("x", tmp_path / "best.safetensors", str(gaits.path), tmp_path, {"noise": -1.0})


REFINERS = [name for name in weights.names() if name.startswith("refiner")]


@pytest.mark.parametrize("name", REFINERS)
def test_shipped_refiners_mend_feet_and_leave_paths(name):
    refiner, model = motionlab.load(name), motionlab.load(name.replace("refiner", "lstm-gmm"))
    assert refiner.about["name"] == name and refiner.card.startswith(f"# {name}\n")
    assert refiner.about["generator_hash"] == model.hash, "of other weights than ship"
    moving = [i for i, start in enumerate(model.start_names) if start.startswith(("walk", "run"))]
    chance = torch.Generator().manual_seed(0)
    made = model.generate(300, model.starts[moving], generator=chance, **model.sampling)
    refined, skates = refiner(made), []
    for some in (made, refined):
        points = [model.encoding.positions(motion) for motion in some]
        skates.append(torch.stack([
            metrics.foot_skate(p, contacts.label_positions(p, model.encoding.skeleton, 30),
                               model.encoding.skeleton, 30) for p in points
        ]).nanmean())  # fmt: skip
    assert skates[1] < 0.6 * skates[0]
    away = model.encoding.root_path(refined) - model.encoding.root_path(made)
    assert away[..., [0, 2]].norm(dim=-1).max() <= 2 * 2**0.5 * refiner.reach + 1e-4


@pytest.mark.parametrize("name", [name for name in weights.names() if name not in REFINERS])
def test_what_is_shipped(name):
    model = motionlab.load(name)
    assert weights.find(name).stat().st_size < 10 * 2**20
    assert model.about["name"] == name and model.card.startswith(f"# {name}\n")
    chance = torch.Generator().manual_seed(0)
    if name.startswith("strnn"):
        assert 4 <= len(model.starts) == len(model.start_names)
        made = model.extrapolate(model.starts, 60, generator=chance, **model.sampling)
    else:
        assert 4 <= len(model.starts.frame) == len(model.start_names)
        made = model.generate(60, model.starts, generator=chance, **model.sampling)
    heights = model.encoding.positions(made)[..., 0, 1]
    lowest = (
        0.2 if name.startswith(("aclstm", "lstm-3lr")) else 0.4
    )  # recorded dancers crouch down to 0.24
    assert lowest < heights.min() and heights.max() < 1.4


def test_all_that_is_shipped_fits_the_budget():
    sizes = [weights.find(name).stat().st_size for name in weights.names()]
    assert sum(sizes) <= 34 * 2**20
