"""What is measured between programs is what was done to the motion."""

from dataclasses import replace

import pytest
import roma
import torch

from experiments.interchange.measure import Seen, compare, in_words
from motionlab.datasets import gaits


@pytest.fixture(scope="module")
def walk():
    return Seen.of(gaits.make(seconds=1, fps=60, turn_rate=0.5))


def test_the_same_is_the_same(walk):
    found = compare(walk, walk)
    assert found["largest (mm)"] == found["rest, as it is (mm)"] == found["bones (mm)"] == 0
    assert found["largest (deg)"] < 1e-3
    assert (found["unit"], found["axes"], found["pairs"]) == (1, "x y z", "by number")
    assert found["frames"] == [60, 60] and found["joints"] == [21, 21] and not found["lost"]


def test_unit_and_axes_are_told_and_are_no_error(walk):
    turn = torch.tensor([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=torch.float64)  # z up
    theirs = replace(
        walk,
        positions=100 * walk.positions @ turn.T,
        turns=turn @ walk.turns @ turn.T,
        offsets=100 * walk.offsets @ turn.T,
    )
    found = compare(walk, theirs)
    assert (found["unit"], found["axes"]) == (100, "x z -y")
    assert found["largest (mm)"] < 1e-6 and found["rest, turned (mm)"] < 1e-4
    assert found["rest, as it is (mm)"] > 100


def test_a_mirror_is_called_one():
    assert in_words(torch.diag(torch.tensor([-1.0, 1, 1]))) == "-x y z, mirrored"


@pytest.mark.parametrize("axis, degrees", [("x", 3.0), ("y", 40.0)])
def test_a_planted_error_is_found(walk, axis, degrees):
    hand, frame = walk.names.index("LeftHand"), 20
    positions, turns = walk.positions.clone(), walk.turns.clone()
    positions[frame, hand] += torch.tensor([0, 0.007, 0])
    turn = roma.euler_to_rotmat(axis, [degrees], degrees=True).double()
    turns[frame, hand] = turn @ turns[frame, hand]
    found = compare(walk, replace(walk, positions=positions, turns=turns))
    assert found["largest (mm)"] == pytest.approx(7, abs=1e-6)
    assert found["largest (deg)"] == pytest.approx(degrees, abs=1e-4)
    assert (found["worst joint"], found["worst frame"]) == ("LeftHand", frame)
    assert found["frames off by over 1 mm"] == 1


def test_bones_of_another_length_are_an_error_and_no_unit(walk):
    found = compare(walk, replace(walk, positions=2 * walk.positions))
    assert found["unit"] == 1 and found["largest (mm)"] > 500


def test_frames_of_another_rate_are_compared_at_their_time(walk):
    found = compare(walk, replace(walk, fps=30.0, positions=walk.positions[::2], turns=None))
    assert (found["pairs"], found["largest (mm)"], found["frames"]) == ("by time", 0, [60, 30])
    late = compare(walk, replace(walk, start=1 / 60))  # the same frames, one later
    assert (late["pairs"], late["starts at (s)"]) == ("by number", 0.01667)


def test_joints_are_lost_and_new_by_name(walk):
    names = ("Root", *walk.names[1:])
    found = compare(walk, replace(walk, names=names, orders=("XYZ",) * len(names)))
    assert (found["lost"], found["new"], found["joints"]) == (["Hips"], ["Root"], [21, 20])
    assert found["orders kept"] == sum(order == "XYZ" for order in walk.orders[1:])
