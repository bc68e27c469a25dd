"""Moments at which a motion has just begun to change: oracles are gaits whose changes are known."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab.datasets import gaits
from motionlab.training.changes import ANGLES, BEGUN, NAMES, changing

FPS = 30.0


def begun(motion, fps=FPS):
    """Seconds at which changes have begun, by name."""
    found = changing(motion.positions(), motion.skeleton, fps)
    assert tuple(found) == NAMES
    for share in found.values():
        seen = share[share.isfinite()]
        assert ((seen >= BEGUN[0]) & (seen <= BEGUN[1])).all()
    seconds = {k: share.isfinite().nonzero()[:, 0] / fps for k, share in found.items()}
    return {name: times for name, times in seconds.items() if len(times)}


def stepped(first, then, at=3.0):
    return lambda time: first + (then - first) * (time > at)


@pytest.mark.parametrize("fps", [30.0, 60.0])
@pytest.mark.parametrize(
    ("name", "first", "then"),
    [("stand to walk", 0.0, 1.2), ("walk to run", 1.2, 3.0), ("run to walk", 3.0, 1.2)],
)
def test_a_change_of_gait_is_found_when_it_has_begun_and_no_other(name, first, then, fps):
    found = begun(gaits.make(seconds=7, speed=stepped(first, then), seed=1, fps=fps), fps)
    assert list(found) == [name]
    assert (found[name] - 3.0).abs().max() < 1.0  # what is asked for is smoothed


@pytest.mark.parametrize("angle", ANGLES)
def test_a_turn_is_found_by_its_side_and_angle_and_mirrored_by_the_other(angle):
    rate = lambda time: math.radians(angle) / 1.2 * ((time > 3) & (time < 4.2))
    motion = gaits.make(seconds=7, speed=1.0, turn_rate=rate, seed=1)
    (name,), (other,) = begun(motion), begun(motion.mirror())
    assert name == f"turn {'left' if angle > 0 else 'right'} {abs(angle)}°"
    assert other == f"turn {'right' if angle > 0 else 'left'} {abs(angle)}°"
    assert (begun(motion)[name] - 3.3).abs().max() < 0.5


def test_who_goes_on_as_before_or_turns_all_the_time_changes_nothing():
    for speed in (0.0, 1.3, 3.0):
        assert not begun(gaits.make(seconds=6, speed=speed, seed=2))
    assert not begun(gaits.make(seconds=8, speed=1.2, turn_rate=0.5, seed=2))  # never straight


@pytest.mark.parametrize("frames", [1, 2, 30, 89, 90])
def test_what_is_too_short_has_no_moment(frames):
    motion = gaits.make(seconds=7, speed=stepped(0.0, 1.2, 1.0))[:frames]
    found = changing(motion.positions(), motion.skeleton, FPS)
    assert all(share.shape == (frames,) and share.isnan().all() for share in found.values())


@settings(max_examples=10)
@given(st.floats(-math.pi, math.pi), st.floats(-50, 50), st.floats(-50, 50))
def test_where_and_which_way_is_no_matter(turn, x, z):
    points = POINTS.double()
    about = torch.tensor([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0],
                          [-math.sin(turn), 0, math.cos(turn)]], dtype=torch.float64)  # fmt: skip
    moved = points @ about.T + torch.tensor([x, 0, z], dtype=torch.float64)
    here, there = (changing(some, MOTION.skeleton, FPS) for some in (points, moved))
    for name in NAMES:
        torch.testing.assert_close(here[name], there[name], equal_nan=True, rtol=1e-6, atol=1e-6)


MOTION = gaits.make(
    seconds=10, speed=stepped(0.0, 1.2, 2.0), turn_rate=lambda t: 1.3 * ((t > 6) & (t < 7.2)),
    seed=1,
)  # fmt: skip
POINTS = MOTION.positions()
