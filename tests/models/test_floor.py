"""Forecasts without training, against motion whose course is known."""

import math

import pytest
import torch

from motionlab import datasets
from motionlab.encodings import JointAngles, RootRelative
from motionlab.errors import ModelError
from motionlab.models.floor import ConstantVelocity, RunningAverage, ZeroVelocity


@pytest.fixture(scope="module")
def walk():
    return next(clip for clip in datasets.load("gaits", "val") if clip.name == "walk_1.3")


@pytest.fixture(scope="module", params=["absolute", "difference"])
def encoding(walk, request):
    return RootRelative(walk.skeleton, fps=30, height=request.param)


def floors(encoding):
    return [
        ZeroVelocity(encoding),
        RunningAverage(encoding, 2),
        RunningAverage(encoding, 4),
        ConstantVelocity(encoding),
    ]


def points(encoding, walk, seen, made):
    """World positions (frames, points, 3) of what was seen and what was made after it."""
    return encoding.positions(torch.cat([seen, made[0]]), encoding.start_of(walk))


def test_zero_velocity_stands_where_it_was(encoding, walk):
    seen, floor = encoding.encode(walk)[:30], ZeroVelocity(encoding)
    made = floor.generate(20, floor.observe(seen))
    world = points(encoding, walk, seen, made)
    torch.testing.assert_close(world[30:], world[29:30].expand(20, -1, -1), rtol=0, atol=1e-4)
    assert (world[29] - world[28]).norm(dim=-1).max() > 0.02  # it did move before


@pytest.mark.parametrize("frames", [1, 2, 4])
def test_running_average_is_the_mean_pose_where_it_was(encoding, walk, frames):
    seen, floor = encoding.encode(walk)[:30], RunningAverage(encoding, frames)
    made = floor.generate(5, floor.observe(seen))
    pose = encoding.slices["pose"]
    mean = seen[-frames:, pose].mean(0)
    torch.testing.assert_close(made[0][:, pose], mean.expand(5, -1))
    root = points(encoding, walk, seen, made)[29:, 0]
    torch.testing.assert_close(root[1:, [0, 2]], root[:1, [0, 2]].expand(5, 2), rtol=0, atol=1e-4)
    if encoding.height == "absolute":
        torch.testing.assert_close(made[0][:, 1], seen[-frames:, 1].mean().expand(5))
    else:
        torch.testing.assert_close(made[0][:, 1], torch.zeros(5))


def test_constant_velocity_draws_straight_lines(encoding, walk):
    seen, floor = encoding.encode(walk)[:30], ConstantVelocity(encoding)
    made = floor.generate(20, floor.observe(seen))
    world = points(encoding, walk, seen, made)[28:].double()
    step = world[1] - world[0]
    line = world[1] + torch.arange(1, 21)[:, None, None] * step
    torch.testing.assert_close(world[2:], line, rtol=0, atol=1e-4)


def test_a_batch_is_its_members_one_by_one(encoding, walk):
    batch = encoding.encode(walk)[:120].unflatten(0, (4, 30))
    for floor in floors(encoding):
        state = floor.observe(batch)
        made = floor.generate(5, state)
        assert made.shape == (4, 5, encoding.dim) and floor.fps == 30
        torch.testing.assert_close(state.frame, batch[:, -1])
        ones = [floor.generate(5, floor.observe(clip)) for clip in batch]
        torch.testing.assert_close(made, torch.cat(ones))
        torch.testing.assert_close(floor.generate(5, state[2:]), made[2:])
        assert torch.equal(made, floor.generate(5, floor.observe(batch)))  # nothing is overwritten


def test_they_have_nothing_to_learn(encoding):
    assert not [p for floor in floors(encoding) for p in floor.parameters()]


def test_bad_input(encoding, walk):
    seen = encoding.encode(walk)[:30]
    broken = seen.clone()
    broken[3, 5] = math.nan
    for floor in floors(encoding):
        with pytest.raises(ModelError, match="shape"):
            floor.observe(seen[:, :7])
        with pytest.raises(ModelError, match="NaN"):
            floor.observe(broken)
        with pytest.raises(ModelError, match="ask for 1 or more"):
            floor.generate(0, floor.observe(seen))
        with pytest.raises(ModelError, match="no state of this model"):
            floor.generate(3, seen)
    average, line = RunningAverage(encoding, 4), ConstantVelocity(encoding)
    with pytest.raises(ModelError, match="needs 4 frames"):
        average.observe(seen[:3])
    with pytest.raises(ModelError, match="needs 2 frames"):
        line.observe(seen[:1])
    with pytest.raises(ModelError, match="no state of this model"):
        line.generate(3, average.observe(seen))
    for frames in (0, 2.5):
        with pytest.raises(ModelError, match="1 or more"):
            RunningAverage(encoding, frames)
    with pytest.raises(ModelError, match="RootRelative"):
        ZeroVelocity(JointAngles(walk.skeleton))
