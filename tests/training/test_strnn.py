"""How STRNN is trained: rows of the body's frame, noise that shrinks, three stages, going on."""

from dataclasses import replace

import pytest
import torch

import motionlab
from motionlab import datasets
from motionlab.commands.sample import check_generates
from motionlab.encodings import BodyFrame
from motionlab.errors import MotionLabError, TrainingError
from motionlab.models.strnn import ALONE, BEHIND, FIRST
from motionlab.training import PRESETS, build
from motionlab.training.checkpoints import read_checkpoint
from motionlab.training.strnn import in_body_frame

SMOKE = replace(
    PRESETS["strnn"]["smoke"], width=16, frames=10, predict=5, updates=30, alone=8, behind=8,
    validate_every=10,
)  # fmt: skip


def test_rows_are_those_of_the_same_motion(gaits):
    data = in_body_frame(gaits)
    assert data is in_body_frame(gaits) and in_body_frame(data) is data
    assert (data.hash, data.names, data.splits) == (gaits.hash, gaits.names, gaits.splits)
    motion = datasets.load("gaits", "val")[0]
    at = gaits.names.index(f"{motion.source}/{motion.name}")
    made = data.features.split(data.lengths.tolist())[at]
    asked = BodyFrame(motion.skeleton, motion.fps).encode(motion)
    assert made[:, :69].sub(asked[:, :69]).abs().max() < 1e-2  # m, rad, m/s: rotations are float32
    contacts = made[:, 69:].sub(asked[:, 69:]).abs().mean(0)
    assert contacts[[1, 3]].max() == 0 and contacts.max() < 0.3  # heels by their rule


def test_dances_have_no_rotations(gaits):
    motion = datasets.load("gaits")[0]
    encoding = motionlab.encodings.RootRelative(motion.skeleton, motion.fps)
    with pytest.raises(TrainingError, match="RootRelative"):
        in_body_frame(replace(gaits, encoding=encoding))


def test_noise_shrinks_and_then_is_gone():
    preset = replace(SMOKE, noise=0.1, quiet=10)
    chance = lambda: torch.Generator().manual_seed(0)
    spread = lambda update: float(preset.extras((500, 10, 7), update, chance())["noise"].std())
    assert spread(0) == pytest.approx(0.1, rel=0.05)
    assert spread(5) == pytest.approx(0.05, rel=0.05)
    assert spread(10) == spread(13) == 0
    assert preset.stage(14) == ALONE and spread(14) == pytest.approx(0.1, rel=0.05)
    assert preset.stage(22) == BEHIND and spread(22) == 0
    assert replace(preset, quiet=0).extras((5, 10, 7), 13, chance())["noise"].std() > 0.08


def test_stages_follow_each_other():
    assert [SMOKE.stage(u) for u in (0, 13, 14, 21, 22, 29)] == [
        FIRST, FIRST, ALONE, ALONE, BEHIND, BEHIND
    ]  # fmt: skip
    preset = replace(SMOKE, warmup=2, decay=4, learning_rate=1.0)
    rates = [preset.rate(update) for update in range(30)]
    assert rates[:4] == pytest.approx([1 / 3, 2 / 3, 1, 1])
    assert rates[10:15] == pytest.approx([4 / 5, 3 / 5, 2 / 5, 1 / 5, 1 / 3])
    assert rates[20:23] == pytest.approx([2 / 3, 1 / 3, 1 / 3])
    plain = replace(preset, alone=0, behind=0)
    assert not plain.partial and "stage" not in plain.extras((2, 10, 7), 29, torch.Generator())
    assert plain.rate(20) == 1


def test_each_stage_learns_what_it_is_for_and_goes_on(gaits, train, tmp_path, monkeypatch):
    whole = train(tmp_path / "whole", SMOKE, name="strnn")
    # stopped in each stage
    from motionlab.training import loop

    for stop in (10, 20):
        keep = loop._keep

        def halt(folder, model, optimizer, facts, preset, keep=keep, stop=stop):  # fmt: skip
            keep(folder, model, optimizer, facts, preset)
            if facts["update"] == stop:
                raise KeyboardInterrupt

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(loop, "_keep", halt)
            train(tmp_path / "parts", SMOKE, name="strnn")
    parts = train(tmp_path / "parts", SMOKE, name="strnn")
    known = [{k: v for k, v in point.items() if k != "seconds"} for point in whole]
    assert known == [{k: v for k, v in point.items() if k != "seconds"} for point in parts]
    a, b = (read_checkpoint(tmp_path / n / "checkpoint.safetensors")[0] for n in ("whole", "parts"))
    assert all(torch.equal(a[key], b[key]) for key in a)
    first = build(gaits, SMOKE).state_dict()
    assert any(not torch.equal(a[f"model.{k}"], v) for k, v in first.items() if "filter" in k)
    model = motionlab.load(tmp_path / "whole" / "best.safetensors")
    assert model.extrapolate(in_body_frame(gaits).clips("val")[0], 12).isfinite().all()
    with pytest.raises(MotionLabError, match="goes on from frames"):
        check_generates(model, "strnn")


def test_the_last_weights_are_kept_if_that_is_asked_for(gaits, train, tmp_path):
    """Validation is often best before the residual network has learned."""
    last = replace(SMOKE, final=True)
    train(tmp_path, last, name="strnn")
    assert not (tmp_path / "best.safetensors").exists()
    assert last.weights == "last.safetensors" and PRESETS["strnn"]["ship"].final
    tensors, about = read_checkpoint(tmp_path / "checkpoint.safetensors")
    assert about["update"] == SMOKE.updates
    model = motionlab.load(tmp_path / "last.safetensors")
    assert all(torch.equal(tensors[f"model.{k}"], v) for k, v in model.state_dict().items())


def test_it_learns(gaits, train, tmp_path):
    preset = replace(
        PRESETS["strnn-temporal"]["smoke"], frames=10, predict=5, updates=150, decay=50,
        validate_every=50, learning_rate=5e-3, quiet=50,
    )  # fmt: skip
    curve = train(tmp_path, preset, name="strnn-temporal")
    assert curve[-1]["val"] < 0.5 * curve[0]["val"]
    assert curve[-1]["val"] < 0.7  # both means of a guess of the mean frame are 1


def test_every_row_of_the_ablation_can_be_built(gaits):
    for name, presets in PRESETS.items():
        if name.startswith("strnn"):
            model = build(gaits, replace(presets["smoke"], width=8))
            preset = presets["smoke"]
            assert (model.frames, model.predict) == (preset.frames, preset.predict)
            assert (model.spatial, model.residual) == (preset.spatial, preset.residual)
    assert PRESETS["strnn-temporal-39-1"]["table"].predict == 1
    assert PRESETS["strnn"]["paper"].optimizer == "adadelta"


@pytest.mark.parametrize(
    "wrong",
    [{"predict": 10}, {"predict": 0}, {"alone": -1}, {"quiet": -1}, {"residual": False},
     {"alone": 22}],
)  # fmt: skip
def test_settings_that_make_no_sense(wrong):
    with pytest.raises(TrainingError, match=next(iter(wrong))):
        replace(SMOKE, **wrong)
