"""Curves of a known length and bend, and errors that are known beforehand."""

import math

import pytest
import torch
from steady_pfnn import PACE, TURN, layout, steady

from experiments.rnn_gan import curves, following
from motionlab.datasets import gaits
from motionlab.paths import Path as Way


def length_of(curve):
    return float(curve.double().diff(dim=0).norm(dim=1).sum())


@pytest.mark.parametrize("gait", following.GAITS)
def test_curves_begin_ahead_at_the_origin_and_are_as_long_as_they_should_be(gait):
    its, drawn = following.GAITS[gait], following.curves_of(gait)
    assert len(drawn) == 14 + its.splines
    for name, curve in drawn.items():
        assert curve[0].abs().max() == 0 and length_of(curve) == pytest.approx(its.length, rel=0.01)
        x, z = curve[1].tolist()
        assert z > 0 and abs(x) < z * (1.0 if "spline" in name else 0.1), name


def test_left_bends_left_and_right_is_its_mirror_image():
    drawn = curves.shapes(2.0, 12.0)
    for name in [name for name in drawn if name.endswith("left")]:
        left, right = drawn[name], drawn[name.replace("left", "right")]
        torch.testing.assert_close(left * torch.tensor([-1.0, 1.0]), right)
        early = left[length_between(left, 0.9)]
        assert early[0] >= 0, name


def length_between(curve, metres):
    behind = curve.double().diff(dim=0).norm(dim=1).cumsum(0)
    return int((behind < metres).sum())


def test_radii_are_right():
    circle = curves.circle(2.0, 12.0)
    assert ((circle - torch.tensor([2.0, 0.0])).norm(dim=1) - 2.0).abs().max() < 0.005
    eight = curves.eight(1.5, 4 * math.pi * 1.5)
    assert eight[-1].norm() < 0.05  # back again
    sine = curves.sine(1.0, 6.0, 12.0)
    assert length_of(sine) == pytest.approx(12.0, rel=0.01)


def straight(off=0.0):
    """A gait that walks straight on, and a line beside it."""
    walk = gaits.make(seconds=6, speed=1.2, noise=0.0)
    root = walk.positions()[:, 0, [0, 2]]
    line = torch.stack([root[:, 0].mean().expand(2) + off, root[[0, -1], 1]], 1)
    return walk, Way.through(line)


def test_an_error_is_what_the_line_was_moved_by():
    near, far = (following.row_of(*straight(off)) for off in (0.0, 0.1))
    assert near["rms (cm)"] < 3  # sway
    assert far["rms of the stride's mean (cm)"] == pytest.approx(10, abs=0.5)
    assert far["mean square (cm²)"] == pytest.approx(far["rms (cm)"] ** 2, rel=1e-6)
    assert far["largest (cm)"] >= far["rms (cm)"] >= near["rms (cm)"]
    assert near["mean speed (m/s)"] == pytest.approx(1.2, rel=0.05)
    assert near["rms of the stride's mean (cm)"] < near["rms (cm)"] + 1e-6


def test_ratios_are_of_the_same_curves():
    row = {"rms (cm)": 1.0, "finished": True, "broken frames": 0}
    ours = {"a": [row, row | {"rms (cm)": 2.0}], "b": [row, row | {"broken frames": 3}]}
    theirs = {"a": [{"rms (cm)": 3.0}], "b": [{"rms (cm)": 0.5}]}
    told = following.summary(ours, theirs)
    assert told["nearer than PFNN"] == 0.5
    assert told["without broken frames"] == 0.75 and told["finished"] == 1.0
    assert following.summary(theirs, theirs)["rms over PFNN's"].value == 1.0


def test_at_its_ease_a_rival_is_led_at_the_speed_at_which_it_errs_least(monkeypatch):
    """This one walks its own bend, whatever it is told: the longer it is led, the farther it is off."""
    monkeypatch.setitem(following.EASY, "walk", (0.5, 0.9, 0.7))
    ways = {"straight": Way.through([[0.0, 0.0], [0.0, 4.0]])}
    motions, speed = following.at_ease(steady(layout(gaits=0)), ways, "walk")
    assert speed == 0.9  # the fastest comes to an end first
    assert following.pace_of(motions["straight"]) == pytest.approx(30 * PACE, rel=0.05)
    bent = motions["straight"].positions()[:, 0, 0]
    assert bent[-1].abs() > 10 * TURN
