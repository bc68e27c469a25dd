"""Speed, turn rate and steps, recovered from gaits that were made with them."""

from functools import cache

import numpy as np
import pytest
import torch

from motionlab import MotionLabError, Skeleton, contacts
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.kinematics import yaw_matrix
from motionlab.metrics import gait

BODY = Skeleton.canonical()


@cache
def made(fps=30, seconds=10, **options):
    return gaits.make(seconds=seconds, fps=fps, seed=1, **options)


# -- travelling ----------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.6, 1.0, 1.4, 2.2, 3.5, 5.0])
@pytest.mark.parametrize("fps", [30, 60])
def test_speed_is_the_one_commanded(speed, fps):
    found = gait.speed(made(fps, speed=speed).positions(), fps)
    assert found.mean().item() == pytest.approx(speed, rel=0.01)
    assert found[fps:-fps].min() > 0.93 * speed and found[fps:-fps].max() < 1.07 * speed


@pytest.mark.parametrize("turn", [-0.8, -0.3, 0.0, 0.5, 1.0])
@pytest.mark.parametrize("speed", [0.0, 1.2, 3.0])
def test_turn_rate_is_the_one_commanded(turn, speed):
    motion = made(speed=speed, turn_rate=turn)
    points = motion.positions()
    found = gait.turn_rate(points, BODY, 30)
    assert found.mean().item() == pytest.approx(turn, abs=0.03)
    if speed:  # the chord is shorter than the arc, and a pelvis leans into the bend
        assert gait.speed(points, 30).mean().item() == pytest.approx(
            speed * np.sinc(turn / 2 / np.pi), rel=0.035
        )


def test_speed_follows_a_change():
    motion = made(speed=(0, 0, 1.4, 1.4, 1.4, 3.0, 3.0, 3.0), seconds=14)
    found = gait.speed(motion.positions(), 30)
    for second, speed in ((0.7, 0), (6, 1.4), (13, 3.0)):
        assert found[round(30 * second)].item() == pytest.approx(speed, abs=0.06)


def test_a_point_on_a_line_and_on_a_circle():
    time = torch.arange(121, dtype=torch.float64) / 30
    line = torch.stack([0.6 * time, time**0, 0.8 * time], -1)[:, None]
    assert gait.speed(line, 30).tolist() == pytest.approx([1] * 121)
    assert gait.speed(line[:2], 30, window=9).tolist() == pytest.approx([1, 1])
    angle = 0.9 * time
    circle = torch.stack([2 * angle.sin(), 0 * time, 2 * angle.cos()], -1)[:, None]
    middle = gait.speed(circle, 30, window=1.0)[15:-15]
    expected = 1.8 * np.sin(0.45) / 0.45
    assert middle.tolist() == pytest.approx([expected] * len(middle))


@pytest.mark.parametrize("rate", [-4.0, 0.7, 9.0])
def test_turn_rate_goes_on_past_half_a_turn(rate):
    time = torch.arange(91, dtype=torch.float64) / 30
    points = made(speed=0.0).positions()[:1].double() @ yaw_matrix(rate * time).mT
    assert gait.turn_rate(points, BODY, 30).tolist() == pytest.approx([rate] * 91)


@pytest.mark.parametrize("yaw", [-3.0, -1.5, 0.0, 0.4, 3.1])
def test_facing(yaw):
    rest = made(speed=0.0).positions()[:1].double()
    straight = gait.facing(rest, BODY)
    turned = gait.facing(rest @ yaw_matrix(torch.tensor(yaw).double()).mT, BODY)
    assert (turned - straight).item() == pytest.approx(yaw, abs=1e-6)
    assert straight.item() == pytest.approx(0, abs=0.05)  # gaits start facing +z


# -- steps ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [0.4, 0.55, 0.7])
@pytest.mark.parametrize("labels", ["exact", "found"])
def test_step_length_is_the_one_commanded(length, labels):
    motion = made(speed=1.2, step_length=length)
    marks = motion.contacts if labels == "exact" else contacts.label(motion)
    found = gait.step_length(motion.positions(), marks, BODY, 30)
    assert found.item() == pytest.approx(length, rel=0.03)
    assert gait.cadence(marks, 30).item() == pytest.approx(60 * 1.2 / length, rel=0.03)


@pytest.mark.parametrize("speed", [0.6, 1.4, 3.5])
@pytest.mark.parametrize("fps", [30, 60])
def test_steps_by_their_number_make_the_speed(speed, fps):
    motion = made(fps, speed=speed)
    length = gait.step_length(motion.positions(), motion.contacts, BODY, fps)
    steps = gait.cadence(motion.contacts, fps) / 60
    assert (length * steps).item() == pytest.approx(speed, rel=0.03)


def marks(*spans, frames=100):
    """Bool (frames, 4) with one heel or toe down in spans (channel, start, stop)."""
    down = torch.zeros(frames, 4, dtype=torch.bool)
    for channel, start, stop in spans:
        down[start:stop, channel] = True
    return down


def test_cadence_counts_strikes():
    # left at 10 and 40, right at 25 and 55 (toe first, heel after): four strikes in 45 frames
    walk = marks((0, 10, 20), (1, 14, 24), (0, 40, 60), (3, 25, 45), (2, 27, 40), (3, 55, 90))
    assert gait.cadence(walk, 30).item() == pytest.approx(60 * 30 * 3 / 45)
    assert gait.cadence(walk, 60).item() == pytest.approx(60 * 60 * 3 / 45)
    assert gait.cadence(walk[:, [1, 3]], 30).isfinite()  # toes alone: strikes at 14, 25, 55


def test_a_foot_that_is_down_at_the_start_did_not_strike():
    assert gait.cadence(marks((0, 0, 20), (2, 10, 30), (0, 40, 60)), 30).item() == pytest.approx(60)


def test_flicker_makes_no_steps():
    clean = marks((0, 10, 40), (2, 30, 60), (0, 50, 80))
    flickering = clean.clone()
    flickering[20, 0] = False
    flickering[95, 2] = True
    assert gait.cadence(flickering, 30).equal(gait.cadence(clean, 30))
    assert not gait.cadence(flickering, 30, shortest=0.01).equal(gait.cadence(clean, 30))


def test_standing_has_no_steps():
    motion = made(speed=0.0)
    assert gait.cadence(motion.contacts, 30).isnan()
    assert gait.step_length(motion.positions(), motion.contacts, BODY, 30).isnan()
    assert gait.cadence(torch.zeros(50, 4, dtype=torch.bool), 30).isnan()
    assert gait.cadence(torch.zeros(1, 2, dtype=torch.bool), 30).isnan()


def test_batches_of_steps():
    motions = [made(speed=speed) for speed in (1.0, 1.4, 3.5, 0.0)]
    points = torch.stack([m.positions() for m in motions]).unflatten(0, (2, 2))
    labels = torch.stack([m.contacts for m in motions]).unflatten(0, (2, 2))
    length = gait.step_length(points, labels, BODY, 30)
    assert length.shape == gait.cadence(labels, 30).shape == (2, 2)
    for found, motion in zip(length.flatten(), motions, strict=True):
        alone = gait.step_length(motion.positions(), motion.contacts, BODY, 30)
        torch.testing.assert_close(found, alone, equal_nan=True)


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p, c: gait.speed(p[:1], 30), "needs at least 2"),
        (lambda p, c: gait.speed(p, 30, window=0), "window is 0"),
        (lambda p, c: gait.speed(p[..., :2], 30), "must be (..., frames, points, 3)"),
        (lambda p, c: gait.turn_rate(p[:, :4], BODY, 30), "has 4 points"),
        (lambda p, c: gait.turn_rate(p * float("nan"), BODY, 30), "NaN"),
        (lambda p, c: gait.cadence(c.float(), 30), "must be bool"),
        (lambda p, c: gait.cadence(c[:, :3], 30), "(300, 3)"),
        (lambda p, c: gait.cadence(c, "30 fps"), "fps is '30 fps'"),
        (lambda p, c: gait.cadence(c, 30, shortest=-1), "shortest is -1"),
        (lambda p, c: gait.cadence(c[:0], 30), "(0, 4)"),
        (lambda p, c: gait.step_length(p[1:], c, BODY, 30), "for positions (299, 26, 3)"),
    ],
    ids=range(11),
)
def test_bad_input(call, message):
    motion = made(speed=1.4)
    with pytest.raises(MetricError) as error:
        call(motion.positions(), motion.contacts)
    assert message in str(error.value)


def test_a_skeleton_without_hips_or_shoulders_is_refused():
    ball = Skeleton(("Ball",), (-1,), torch.zeros(1, 3))
    with pytest.raises(MotionLabError, match="left_upper_leg"):
        gait.facing(torch.zeros(4, 1, 3), ball)
