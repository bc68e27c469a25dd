"""A PFNN trained on gaits: it learns, it needs the phase, and what it learned walks."""

import math
from dataclasses import replace

import pytest
import torch

import motionlab
from motionlab.commands.sample import check_generates
from motionlab.datasets import gaits as procedural
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import MotionLabError, TrainingError
from motionlab.models.pfnn import follow
from motionlab.models.pfnn.layout import size
from motionlab.training import PRESETS, Prepared, build
from motionlab.training.finish import finish

SMOKE = replace(
    PRESETS["pfnn"]["smoke"], updates=150, decay=30, validate_every=50, learning_rate=3e-3
)


def made_ready(motions: dict[str, list], **encoded) -> Prepared:
    """Motions of each split as `prepare` makes them."""
    encoding = JointAngles(motionlab.Skeleton.canonical(), 30, **{"contacts": True, **encoded})
    clips = [encoding.encode(motion) for some in motions.values() for motion in some]
    splits = tuple(split for split, some in motions.items() for _ in some)
    return Prepared(
        torch.cat(clips), torch.tensor([len(clip) for clip in clips]),
        tuple(f"gaits/{i}" for i in range(len(clips))), splits, encoding, Normalizer.fit(clips), "",
    )  # fmt: skip


@pytest.fixture(scope="module")
def walks():
    """Ten walks to learn from and two to judge by."""
    make = lambda seed: procedural.make(
        seconds=5, speed=1.0 + 0.1 * (seed % 5), turn_rate=0.2 * (seed % 3 - 1), seed=seed
    )
    return made_ready({"train": [make(i) for i in range(10)], "val": [make(20), make(21)]})


@pytest.fixture(scope="module")
def trained(walks, tmp_path_factory):
    """The folder of a training, and its curve."""
    from motionlab.training import loop

    folder = tmp_path_factory.mktemp("pfnn")
    model = build(walks, SMOKE)
    return folder, loop.train(model, walks, SMOKE, folder, name="pfnn", accelerator="cpu")


def test_the_loss_falls(trained):
    _, curve = trained
    assert [point["update"] for point in curve] == [50, 100, 150]
    assert curve[-1]["val"] < 0.3 * curve[0]["val"]
    assert curve[-1]["val"] < 0.5  # a guess of the mean is 1


def test_it_needs_the_phase(trained, walks):
    model = motionlab.load(trained[0] / "best.safetensors")
    rows = torch.cat(SMOKE.windows(walks, "val").tiles(1_000))
    with torch.no_grad():
        right = model.loss(rows)
        for off in (math.pi / 2, math.pi, -math.pi / 2):
            moved = rows.clone()
            moved[..., 0] += off
            assert model.loss(moved) > 1.5 * right
        moved[..., 0] = rows[..., 0] + 2 * math.pi
        assert torch.allclose(model.loss(moved), right, rtol=1e-3)


def test_what_it_learned_walks(trained):
    model = motionlab.load(trained[0] / "best.safetensors")
    assert model.starts is None and model.layout.reach == 12
    (motion,) = follow(model, [torch.tensor([[0.0, 0.0], [0.0, 6.0]])], 1.2)
    assert len(motion) == 150 and motion.fps == 30
    assert float(motionlab.metrics.speed(motion.positions(), 30).mean()) == pytest.approx(
        1.2, abs=0.4
    )
    steps = motionlab.metrics.cadence(motion.contacts, 30)
    assert 80 < float(steps) < 150


def test_its_card_says_what_it_may_be_used_for(trained, walks):
    path = trained[0] / "best.safetensors"
    assert finish(path, walks) == {}
    card = motionlab.load(path).card
    assert card.startswith("# pfnn") and "## Licence" in card and "## Starts" not in card


def test_it_makes_no_motion_by_itself(trained):
    path = trained[0] / "best.safetensors"
    with pytest.raises(MotionLabError, match=r"led along a path: motionlab.models.pfnn.follow"):
        check_generates(motionlab.load(path), str(path))


def test_lots_depend_on_the_generator_alone(walks):
    shape = SMOKE.windows(walks, "train").draw(4, torch.Generator().manual_seed(0)).shape
    lots, again, other = (
        SMOKE.extras(shape, 0, torch.Generator().manual_seed(seed))["lots"] for seed in (3, 3, 4)
    )
    model = build(walks, SMOKE)
    assert lots.shape == (4, 1, 1 + size(model.layout.seen) + size(model.layout.said) + 64)
    assert torch.equal(lots, again) and not torch.equal(lots, other)


def test_it_goes_on_from_its_own_weights_only(trained, walks, smoke):
    path = trained[0] / "best.safetensors"
    assert torch.equal(
        build(walks, SMOKE, path).layers[0].weight, motionlab.load(path).layers[0].weight
    )
    with pytest.raises(TrainingError, match="weights of a Pfnn; this trains a LstmGmm"):
        build(walks, smoke(), path)
    with pytest.raises(TrainingError, match="features of another kind"):
        build(walks, replace(SMOKE, frames=13), path)


@pytest.mark.parametrize("frames", [2, 24, 60, 62])
def test_a_trajectory_of_odd_length(frames):
    with pytest.raises(TrainingError, match=f"frames is {frames}; a trajectory of 6 points"):
        replace(SMOKE, frames=frames)


def test_clips_that_teach_nothing():
    stand = procedural.make(seconds=4, speed=0.0)
    with pytest.raises(
        TrainingError, match="No clip of the split 'train' has 25 frames with a strike"
    ):
        build(made_ready({"train": [stand], "val": [stand]}), SMOKE)


def test_features_without_contacts():
    walk = procedural.make(seconds=4)
    with pytest.raises(TrainingError, match="JointAngles features with contacts"):
        build(made_ready({"train": [walk], "val": [walk]}, contacts=False), SMOKE)
