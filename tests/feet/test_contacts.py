"""Contacts: the rules against the gaits' exact labels, and what bad input is told."""

from functools import cache

import numpy as np
import pytest
import torch

from motionlab import MotionLabError, Skeleton, contacts
from motionlab.datasets import gaits
from motionlab.datasets.registry import sources
from motionlab.errors import MotionError
from motionlab.io.bvh import parse_bvh

CANONICAL = Skeleton.canonical()
FEET = [CANONICAL.index(name) for name in ("LeftFoot", "LeftToes", "RightFoot", "RightToes")]


@cache
def gait(speed, fps=30):
    return gaits.make(seconds=8, speed=speed, fps=fps, seed=1)


def still(frames=10):
    """The rest pose, standing on y = 0, as points (frames, points, 3)."""
    motion = gait(0.0)
    rest = torch.eye(3).expand(1, CANONICAL.joints, 3, 3)
    root = torch.tensor([[0, 0.9226, 0]])
    motion = type(motion)(CANONICAL, root, rest, 30)
    return motion.positions().repeat(frames, 1, 1)


# -- the rules ---------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", contacts.RULES)
@pytest.mark.parametrize(
    ("speed", "precision", "recall"), [(0.6, 0.8, 0.99), (1.4, 0.93, 0.97), (3.5, 0.89, 0.87)]
)
def test_rules_find_the_exact_contacts_of_gaits(rule, speed, precision, recall):
    motion = gait(speed)
    found = contacts.agreement(contacts.label(motion, rule), motion.contacts)["all"]
    assert found["precision"] > precision and found["recall"] > recall


def test_the_papers_toe_rule_on_a_walk():
    motion = gait(1.4)
    found = contacts.agreement(contacts.label(motion), motion.contacts)
    for toe in ("left toe", "right toe"):
        assert found[toe]["precision"] > 0.99 and found[toe]["recall"] > 0.95


@pytest.mark.parametrize("channel", range(4))
def test_a_point_is_in_contact_below_the_speed(channel):
    points = still(20)
    points[:, FEET[channel], 0] += 0.44 * torch.arange(20) / 30
    assert contacts.label_positions(points, CANONICAL, 30).all()
    points[:, FEET[channel], 2] += 0.44 * torch.arange(20) / 30  # 0.62 m/s by now
    expected = torch.ones(20, 4, dtype=torch.bool)
    expected[:, channel] = False
    assert contacts.label_positions(points, CANONICAL, 30).equal(expected)
    assert contacts.label_positions(points, CANONICAL, 30, speed=0.63).all()


def test_height_tells_a_foot_held_still_in_the_air_from_one_on_the_floor():
    points = still(30)
    lift = torch.zeros(30)
    lift[10:20] = 0.1  # up within a frame: only frames 11 to 18 are slow
    points[:, FEET[2]] += lift[:, None] * torch.tensor([0, 1.0, 0])
    by_speed = contacts.label_positions(points, CANONICAL, 30)[:, 2]
    assert by_speed[11:19].all() and by_speed.sum() == 8 + 9 + 9
    for floor in (0.0, None):
        both = contacts.label_positions(points, CANONICAL, 30, "speed-height", floor=floor)[:, 2]
        assert not both[10:20].any() and both.sum() == 9 + 9
    high = contacts.label_positions(points, CANONICAL, 30, "speed-height", height=0.2)[:, 2]
    assert high.equal(by_speed)


def test_without_a_floor_a_tilted_one_is_forgiven():
    """Standing on the spot, half the time 3 cm higher, as captures with a sloping floor have it."""
    points = still(60)
    points[30:, :, 1] += 0.03
    inside = [frame for frame in range(60) if frame not in (29, 30)]
    found = contacts.label_positions(points, CANONICAL, 30, "speed-height")[inside]
    assert found.all()
    floored = contacts.label_positions(
        points, CANONICAL, 30, "speed-height", height=0.02, floor=0.0
    )
    assert floored[:29].all() and not floored[31:].any()


def test_a_joint_that_is_never_slow_has_no_contact():
    points = still(20)
    points[..., 0] += torch.arange(20)[:, None]
    assert not contacts.label_positions(points, CANONICAL, 30, "speed-height").any()


def test_a_floor_that_is_given_is_the_floor():
    points = still() + torch.tensor([0, 1.0, 0])
    label = lambda floor: contacts.label_positions(
        points, CANONICAL, 30, "speed-height", floor=floor
    )
    assert label(1.0).all() and label(None).all() and not label(0.0).any()


@pytest.mark.parametrize("fps", [25, 30, 60, 120])
def test_velocities_are_central_differences(fps):
    time = torch.arange(2 * fps, dtype=torch.float64) / fps
    points = torch.stack([3 * time**2, 0 * time, 4 * time**2], -1)[:, None]
    found = contacts.velocities(points, fps, 1 / 30)
    stride = round(fps / 30)
    inner = slice(stride, -stride)
    speeds = found.norm(dim=-1)[:, 0]
    torch.testing.assert_close(speeds[inner], 10 * time[inner])  # exact for a parabola
    torch.testing.assert_close(speeds[0], 5 * time[stride])  # one-sided
    assert contacts.velocities(points[:1], fps, 1).tolist() == [[[0.0, 0.0, 0.0]]]


def test_labels_of_joints_alone_batches_and_moved_bodies_are_the_same():
    points = torch.stack([gait(1.4).positions(), gait(3.5).positions()])
    for rule in contacts.RULES:
        both = contacts.label_positions(points, CANONICAL, 30, rule)
        for clip, found in zip(points, both, strict=True):
            assert contacts.label_positions(clip, CANONICAL, 30, rule).equal(found)
        joints = points[..., : CANONICAL.joints, :]
        assert contacts.label_positions(joints, CANONICAL, 30, rule).equal(both)
        turn = torch.tensor([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
        moved = points.double() @ turn.double().mT + torch.tensor([5.0, 0, -3])
        same = contacts.label_positions(moved, CANONICAL, 30, rule) == both
        assert same.float().mean() > 0.999  # a speed may lie on the threshold


def test_a_bigger_body_with_bigger_thresholds_has_the_same_contacts():
    points = gait(1.4).positions().double()
    for rule in contacts.RULES:
        big = contacts.label_positions(2 * points, CANONICAL, 30, rule, speed=0.9, height=0.08)
        small = contacts.label_positions(points, CANONICAL, 30, rule, speed=0.45, height=0.04)
        assert big.equal(small)


def test_twice_the_frame_rate_gives_the_same_labels():
    for speed, share in ((1.4, 0.995), (3.5, 0.995)):
        slow, fast = (contacts.label(gait(speed, fps)) for fps in (30, 60))
        assert (slow == fast[::2][: len(slow)]).float().mean() > share


def test_mirrored_motion_has_mirrored_contacts():
    motion = gait(1.4)
    assert contacts.label(motion.mirror()).equal(contacts.label(motion)[:, [2, 3, 0, 1]])


# -- which points ------------------------------------------------------------------------------


def test_a_skeleton_without_toes_is_labelled_by_the_foots_end():
    names = ("Hips", "LeftFoot", "RightFoot")
    offsets = torch.tensor([[0, 1.0, 0], [0.1, -0.9, 0], [-0.1, -0.9, 0]])
    bare = Skeleton(names, (-1, 0, 0), offsets)
    assert contacts.foot_points(bare) == [1, 1, 2, 2]
    ends = Skeleton(names, (-1, 0, 0), offsets, (1, 2), torch.tensor([[0, -0.08, 0.1]] * 2))
    assert contacts.foot_points(ends) == [1, 3, 2, 4]
    torch.testing.assert_close(contacts.rest_heights(ends), torch.tensor([0.1, 0.02, 0.1, 0.02]))
    with pytest.raises(MotionLabError, match="left_foot"):
        contacts.foot_points(Skeleton(("Hips",), (-1,), offsets[:1]))
    # of such a foot only the joints were given
    with pytest.raises(MotionError, match="end sites"):
        contacts.label_positions(torch.zeros(4, 3, 3), ends, 30)


def test_heights_of_the_rest_pose():
    rest = contacts.rest_heights(CANONICAL)
    torch.testing.assert_close(rest, still(1)[0, FEET, 1])


def test_real_clips_of_every_source_get_contacts(real_clips):
    for source, clips in real_clips.items():
        for path, data in clips.items():
            motion = parse_bvh(data, path, units=sources()[source].units, tpose_first=True)
            motion = motion[9:] if len(motion) > 20 else motion  # calibration poses
            for rule in contacts.RULES:
                found = contacts.label(motion, rule)
                assert found.shape == (len(motion), 4), path
                assert found.any(), path


# -- agreement ---------------------------------------------------------------------------------


def test_agreement_counts_as_a_person_would():
    truth = torch.tensor([[1, 1, 0, 0], [1, 0, 0, 0], [1, 0, 1, 0], [0, 0, 1, 0]]).bool()
    found = torch.tensor([[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0], [1, 0, 1, 0]]).bool()
    result = contacts.agreement(found, truth)
    assert result["left heel"] == pytest.approx({"precision": 2 / 3, "recall": 2 / 3, "f1": 2 / 3})
    assert result["left toe"] == pytest.approx({"precision": 0.5, "recall": 1.0, "f1": 2 / 3})
    assert result["right heel"] == pytest.approx({"precision": 1.0, "recall": 0.5, "f1": 2 / 3})
    assert all(np.isnan(value) for value in result["right toe"].values())
    assert result["all"] == pytest.approx({"precision": 4 / 6, "recall": 4 / 6, "f1": 4 / 6})


def test_agreement_pools_batches_and_knows_perfection():
    truth = gait(1.4).contacts
    perfect = contacts.agreement(truth[None].repeat(3, 1, 1), truth[None].repeat(3, 1, 1))
    assert all(value == 1 for row in perfect.values() for value in row.values())


# -- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(rule="height"), "rule 'height'; use one of speed, speed-height"),
        (dict(fps=0), "fps is 0"),
        (dict(fps="fast"), "fps is 'fast'"),
        (dict(speed=-1), "speed is -1"),
        (dict(step=None), "step is None"),
        (dict(height=float("nan")), "height is nan"),
        (dict(floor="ground"), "floor is 'ground'"),
        (dict(floor=float("nan")), "floor is nan"),
        (dict(skeleton="canonical"), "skeleton is 'canonical'"),
        (dict(positions=torch.zeros(4, 3)), "(4, 3)"),
        (dict(positions=torch.zeros(0, 26, 3)), "at least one frame"),
        (dict(positions=torch.zeros(4, 7, 3)), "has 7 points"),
        (dict(positions="points"), "array of numbers"),
        (dict(positions=torch.full((4, 26, 3), float("nan"))), "frame 0"),
    ],
    ids=lambda value: "" if isinstance(value, str) else "-".join(value),
)
def test_bad_input_is_answered(change, message):
    good = dict(positions=still(), skeleton=CANONICAL, fps=30)
    with pytest.raises(MotionError) as error:
        contacts.label_positions(**(good | change))
    assert message in str(error.value)


def test_bad_labels_and_motions_are_answered():
    with pytest.raises(MotionError, match="takes a Motion, not Tensor"):
        contacts.label(still())
    truth = torch.zeros(5, 4, dtype=torch.bool)
    wrong = ((truth[:4], "same frames"), (truth.float(), "must be bool"), ("x", "arrays of bool"))
    for found, message in wrong:
        with pytest.raises(MotionError, match=message):
            contacts.agreement(found, truth)


def test_one_frame_is_still():
    assert contacts.label(gait(1.4)[:1]).shape == (1, 4)
