"""Strides and their phase, against gaits whose phase is known and strikes that were laid down."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from motionlab import datasets, metrics
from motionlab.datasets import gaits
from motionlab.errors import MotionError
from motionlab.feet.strides import phase, stances, strikes

TURN = 2 * math.pi
LEFT, RIGHT = 0, 1


def laid(frames: int, *spans: tuple[int, int, int]) -> torch.Tensor:
    """Labels (frames, 2) with contacts of a side from a frame to another."""
    labels = torch.zeros(frames, 2, dtype=torch.bool)
    for side, start, stop in spans:
        labels[start:stop, side] = True
    return labels


@pytest.mark.parametrize("motion", datasets.load("gaits"), ids=lambda m: m.name)
def test_strikes_of_gaits_come_back_from_their_phase(motion):
    """Right feet come down at 0 and left ones at π, exactly, and at no other time."""
    found = phase(motion.contacts, motion.fps)
    down = strikes(motion.contacts.numpy(), motion.fps)
    if len(down) < 2:
        assert found.isnan().all()  # who stands has no stride
        return
    halves = found / math.pi
    on = ((halves - halves.round()).abs() < 1e-9).nonzero()[:, 0].tolist()
    read = [(frame, LEFT if round(float(halves[frame])) % 2 else RIGHT) for frame in on]
    assert read == down
    within = found[down[0][0] : down[-1][0] + 1]
    assert not within.isnan().any() and (within.diff() > 0).all()
    assert found[: down[0][0]].isnan().all() and found[down[-1][0] + 1 :].isnan().all()


@pytest.mark.parametrize("begin", [0.0, 0.3, 0.85])
@pytest.mark.parametrize("speed", [0.8, 1.4, 3.0])
def test_it_is_the_phase_that_a_gait_was_made_with(speed, begin):
    """A machine's gait has a phase that grows evenly: half a turn off ours, as it counts left feet."""
    motion = gaits.make(seconds=6, speed=speed, noise=0, phase=begin, fps=60)
    found = phase(motion.contacts, 60)
    cadence = float(metrics.cadence(motion.contacts, 60))  # steps a minute
    made = TURN * (begin + 0.5 + cadence / 120 * torch.arange(len(motion)) / 60)
    off = (found - made)[~found.isnan()]
    off = torch.atan2(off.sin(), off.cos())
    assert off.abs().max() < TURN * cadence / 120 / 60 * 2.5  # frames; a strike is seen at the next


def test_in_a_mirror_it_is_half_a_turn_off():
    motion = gaits.make(seconds=4, speed=1.2, seed=3)
    off = phase(motion.mirror().contacts, 30) - phase(motion.contacts, 30)
    off = off[~off.isnan()]
    assert len(off) and torch.allclose(off.abs(), torch.tensor(math.pi, dtype=torch.float64))


@given(st.lists(st.integers(5, 40), min_size=2, max_size=12), st.sampled_from([LEFT, RIGHT]))
def test_feet_that_take_turns(gaps, first):
    at = np.cumsum([10, *gaps]).tolist()
    spans = [(first if i % 2 == 0 else 1 - first, frame, frame + 4) for i, frame in enumerate(at)]
    fps = 10.0  # so slow that no two strikes are too near
    found = phase(laid(at[-1] + 10, *spans), fps, shortest=0.01)
    wanted = 0.5 * (first == LEFT) + 0.5 * torch.arange(len(at), dtype=torch.float64)
    assert torch.allclose(found[at], TURN * wanted)
    halfway = (found[at[0]] + found[at[1]]) / 2
    assert float(np.interp((at[0] + at[1]) / 2, at, found[at])) == pytest.approx(float(halfway))


def test_a_foot_that_comes_down_twice_made_a_stride():
    found = phase(laid(90, (RIGHT, 10, 20), (RIGHT, 40, 50), (LEFT, 60, 70)), 30)
    assert torch.allclose(found[[10, 25, 40, 60]] / TURN, torch.tensor([0, 0.5, 1, 1.5]).double())


def test_a_foot_that_comes_down_twice_at_once_did_so_once():
    labels = laid(90, (RIGHT, 10, 13), (RIGHT, 16, 25), (LEFT, 30, 40), (RIGHT, 50, 60))
    assert [frame for frame, _ in strikes(labels.numpy(), 30)] == [10, 16, 30, 50]
    found = phase(labels, 30)
    assert torch.allclose(found[[10, 30, 50]] / TURN, torch.tensor([0, 0.5, 1]).double())


def test_a_landing_tells_no_phase():
    landing = (LEFT, 30, 40), (RIGHT, 31, 40)
    found = phase(laid(90, (RIGHT, 10, 20), *landing, (LEFT, 60, 70)), 30)
    assert torch.allclose(found[[10, 35, 60]] / TURN, torch.tensor([0, 0.25, 0.5]).double())


def test_what_is_down_from_the_first_frame_on_did_not_come_down():
    labels = laid(60, (LEFT, 0, 60), (RIGHT, 10, 20), (RIGHT, 40, 60))
    assert strikes(labels.numpy(), 30) == [(10, RIGHT), (40, RIGHT)]
    assert stances(labels.numpy(), 30) == [[(0, 60)], [(10, 20), (40, 60)]]


@pytest.mark.parametrize("labels", [laid(50), laid(50, (LEFT, 10, 20)), laid(50, (LEFT, 0, 50))])
def test_without_two_strikes_nobody_knows(labels):
    assert phase(labels, 30).isnan().all()


@pytest.mark.parametrize(
    "labels, fps, said",
    [
        (torch.zeros(9, 4), 30, "must be bool"),
        (torch.zeros(9, 3, dtype=torch.bool), 30, r"shape \(9, 3\)"),
        (torch.zeros(2, 9, 4, dtype=torch.bool), 30, r"\(frames, 4\)"),
        (laid(9), 0, "fps is 0"),
        (laid(9), math.nan, "fps is nan"),
    ],
)
def test_what_has_no_phase(labels, fps, said):
    with pytest.raises(MotionError, match=said):
        phase(labels, fps)
