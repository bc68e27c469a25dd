"""Sliding, sinking and floating feet, by known amounts."""

from dataclasses import replace
from functools import cache

import pytest
import torch

from motionlab import Motion, MotionLabError, Skeleton, contacts
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.metrics import feet

BODY = Skeleton.canonical()
LEFT_HEEL, LEFT_TOE, RIGHT_HEEL, RIGHT_TOE = contacts.foot_points(BODY)


def standing(frames=31):
    """The rest pose on the floor y = 0, (frames, points, 3)."""
    rest = torch.eye(3).expand(1, BODY.joints, 3, 3)
    points = Motion(BODY, torch.tensor([[0, 0.9226, 0]]), rest, 30).positions()
    return points.double().repeat(frames, 1, 1)


def slid(speed, fps, frames=31, points=slice(None)):
    """Standing, but for some points that slide along (0.6, 0, -0.8) at a speed in m/s."""
    body = standing(frames)
    way = speed * torch.arange(frames, dtype=torch.float64)[:, None, None] / fps
    body[:, points] += way * torch.tensor([0.6, 0, -0.8], dtype=torch.float64)
    return body


def labels(frames=31, on=(0, 1, 2, 3)):
    marks = torch.zeros(frames, 4, dtype=torch.bool)
    marks[:, list(on)] = True
    return marks


@cache
def gait(speed, fps=30):
    return gaits.make(seconds=8, speed=speed, fps=fps, seed=1)


# -- sliding -----------------------------------------------------------------------------------


@pytest.mark.parametrize("fps", [24, 30, 60, 120])
def test_a_foot_sliding_at_10_cm_s_scores_10_cm_s(fps):
    skate = feet.foot_skate(slid(0.10, fps), labels(), BODY, fps)
    assert skate.item() == pytest.approx(10, abs=1e-9)
    toes = feet.foot_skate(slid(0.10, fps), labels()[:, :2], BODY, fps)
    assert toes.item() == pytest.approx(10, abs=1e-9)


def test_one_of_four_joints_slides():
    body = slid(0.10, 30, points=[RIGHT_TOE])
    score = lambda marks: feet.foot_skate(body, marks, BODY, 30).item()
    assert score(labels()) == pytest.approx(2.5)
    assert score(labels(on=[3])) == pytest.approx(10)
    assert score(labels(on=[0, 1, 2])) == 0
    assert score(labels()[:, [0, 3]]) == pytest.approx(5)  # two channels are the toes


def test_only_motion_in_contact_and_over_the_ground_counts():
    body = slid(0.5, 30)
    body[..., 1] += torch.rand(31, 1)
    marks = labels()
    marks[10:20] = False
    body[10:20] += 7
    assert feet.foot_skate(body, marks, BODY, 30).item() == pytest.approx(50)


@pytest.mark.parametrize("speed", [0.6, 1.4, 3.5])
@pytest.mark.parametrize("fps", [30, 60])
def test_gaits_hold_their_feet(speed, fps):
    motion = gait(speed, fps)
    points = motion.positions()
    assert feet.foot_skate(points, motion.contacts, BODY, fps) < 0.02
    assert feet.foot_skate_ratio(points, motion.contacts, BODY, fps) == 0
    assert feet.floating(points, BODY, contacts=motion.contacts).nan_to_num().max() < 0.01
    assert feet.penetration(points, BODY).max() < 0.05


def test_ratio_is_the_share_of_contact_above_the_speed():
    body = standing()
    body[16:, LEFT_HEEL, 0] += 0.6 * torch.arange(1, 16) / 30  # slides in 15 of 30 steps
    ratio = lambda **options: feet.foot_skate_ratio(body, labels(), BODY, 30, **options).item()
    assert ratio() == pytest.approx(15 / 120)
    assert ratio(speed=0.59) == pytest.approx(15 / 120) and ratio(speed=0.61) == 0
    # 2.5 cm a frame at 20 fps is the published limit
    for speed, share in ((0.49, 0), (0.51, 1)):
        assert feet.foot_skate_ratio(slid(speed, 20), labels(), BODY, 20) == share


def test_weighted_by_height():
    """v (2 - 2^(h / H)): all on the floor, 2 - sqrt 2 half way up, nothing from H upwards."""
    for height, weight in ((0.0, 1), (-0.1, 1), (0.0125, 2 - 2**0.5), (0.025, 0), (1.0, 0)):
        body = slid(0.10, 30)
        body[..., 1] += height
        found = feet.foot_skate_weighted(body, BODY, 30)
        assert found.item() == pytest.approx(10 * weight, abs=1e-5)
        floor = feet.foot_skate_weighted(body, BODY, 30, floor=height)
        assert floor.item() == pytest.approx(10, abs=1e-5)
    higher = feet.foot_skate_weighted(slid(0.1, 30) + 0.05, BODY, 30, height=0.1)
    assert higher.item() == pytest.approx(10 * (2 - 2**0.5), abs=1e-5)


# -- sinking and floating ------------------------------------------------------------------------


def test_a_body_two_centimetres_too_low_or_too_high():
    for fault in (0.02, -0.02):
        body = standing(5)
        body[2:, :, 1] += fault
        up, down = torch.tensor([0, 0, 1, 1, 1]) * 2.0, torch.zeros(5)
        up, down = (up, down) if fault > 0 else (down, up)
        near = dict(atol=1e-4, rtol=0, check_dtype=False)
        torch.testing.assert_close(feet.floating(body, BODY), up, **near)
        torch.testing.assert_close(feet.penetration(body, BODY), down, **near)
        torch.testing.assert_close(feet.penetration(body + 1, BODY, floor=1.0), down, **near)


def test_the_deepest_and_the_lowest_joint_decide():
    body = standing(4)
    body[:, LEFT_TOE, 1] -= 0.03
    body[:, RIGHT_HEEL, 1] += 0.05
    assert feet.penetration(body, BODY).tolist() == pytest.approx([3] * 4, abs=1e-4)
    assert feet.floating(body, BODY).tolist() == pytest.approx([0] * 4, abs=1e-4)
    held = feet.floating(body, BODY, contacts=labels(4, on=[2, 3]))
    assert held.tolist() == pytest.approx([2.5] * 4, abs=1e-4)
    toes = feet.floating(body, BODY, contacts=labels(4, on=[0, 1])[:, :2])
    assert toes.tolist() == pytest.approx([0] * 4, abs=1e-4)


def test_a_run_flies_and_a_walk_does_not():
    walk, run = (feet.floating(gait(speed).positions(), BODY) for speed in (1.4, 3.5))
    assert walk.max() < 0.05 and run.max() > 2


def test_without_contact_the_answer_is_nan():
    none = labels(on=[])
    assert feet.foot_skate(standing(), none, BODY, 30).isnan()
    assert feet.foot_skate_ratio(standing(), none, BODY, 30).isnan()
    assert feet.floating(standing(), BODY, contacts=none).isnan().all()
    flicker = none.clone()
    flicker[::2] = True
    assert feet.foot_skate(standing(), flicker, BODY, 30).isnan()


def test_skate_can_be_differentiated():
    body = slid(0.1, 30).requires_grad_()
    feet.foot_skate(body, labels(), BODY, 30).backward()
    assert torch.isfinite(body.grad).all() and (body.grad != 0).any()


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(positions=standing()[:, :7]), "has 7 points"),
        (dict(positions=standing()[:1], contacts=labels(1)), "needs at least 2"),
        (dict(positions=standing() * float("nan")), "NaN"),
        (dict(contacts=labels()[:9]), "contacts has shape (9, 4) for positions (31, 26, 3)"),
        (dict(contacts=labels()[:, :3]), "(31, 3)"),
        (dict(contacts=labels().float()), "contacts > 0.5"),
        (dict(contacts=None), "label them first"),
        (dict(contacts="toes"), "contacts must be an array"),
        (dict(skeleton=None), "skeleton is None"),
        (dict(fps=-30), "fps is -30"),
        (dict(step=float("inf")), "step is inf"),
    ],
    ids=lambda value: "" if isinstance(value, str) else "-".join(value),
)
def test_bad_input(change, message):
    good = dict(positions=standing(), contacts=labels(), skeleton=BODY, fps=30)
    for metric in (feet.foot_skate, feet.foot_skate_ratio):
        with pytest.raises(MetricError) as error:
            metric(**(good | change))
        assert message in str(error.value)


def test_a_skeleton_without_feet_is_refused():
    ball = Skeleton(("Ball",), (-1,), torch.zeros(1, 3))
    with pytest.raises(MotionLabError, match="no joint or role 'left_foot'"):
        feet.penetration(torch.zeros(4, 1, 3), ball)
    with pytest.raises(MetricError, match="height is 0"):
        feet.foot_skate_weighted(standing(), BODY, 30, height=0)


@pytest.mark.parametrize("measure", ["foot_skate_weighted", "penetration", "floating"])
def test_a_rest_pose_that_does_not_stand_is_refused(measure):
    """Skeletons of raw files often float or lie: heights above their rest pose mean nothing."""
    canonical = Skeleton.canonical()
    offsets = canonical.offsets.clone()
    offsets[0] = 0  # hips at the origin, feet far below
    floats = replace(canonical, offsets=offsets)
    positions = gaits.make(seconds=1, speed=1.3, seed=1).positions()
    rate = {"fps": 30.0} if measure == "foot_skate_weighted" else {}
    getattr(feet, measure)(positions, skeleton=canonical, **rate)
    with pytest.raises(MetricError, match="does not stand on the floor"):
        getattr(feet, measure)(positions, skeleton=floats, **rate)
