"""Poses that nobody holds are seen, and those of people are not called so."""

from dataclasses import replace

import pytest
import roma
import torch

from motionlab import Motion, Skeleton, datasets
from motionlab.encodings import JointAngles
from motionlab.errors import MetricError
from motionlab.metrics import broken_frames
from motionlab.metrics.broken import beyond, knows, within


@pytest.fixture(scope="module")
def gait():
    return datasets.load("gaits", "val")[0]


def turned(motion: Motion, joint: str, axis: list[float], frames: slice) -> Motion:
    """With one joint turned about an axis in some frames."""
    rotations = motion.rotations.clone()
    which = motion.skeleton.index(joint)
    rotations[frames, which] = rotations[frames, which] @ roma.rotvec_to_rotmat(torch.tensor(axis))
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


def test_gaits_are_whole(gait):
    found = broken_frames(gait)
    assert found.shape == (len(gait),) and found.dtype == torch.bool and not found.any()


@pytest.mark.parametrize(
    ("joint", "axis"),
    [("LeftLowerLeg", [-1.5, 0, 0]), ("RightLowerLeg", [0, 0, 0.5]), ("Spine", [0, 0.6, 0]),
     ("LeftFoot", [0, 0, 2.2]), ("Hips", [1.2, 0, 0])],
)  # fmt: skip
def test_a_joint_turned_about_is_seen_where_it_is(gait, joint, axis):
    found = broken_frames(turned(gait, joint, axis, slice(5, 8)))
    assert found[5:8].all() and found.sum() == 3


def test_a_body_in_the_air_is_seen_and_a_larger_one_is_none(gait):
    raised = gait.root_positions + torch.tensor([0.0, 0.3, 0.0])
    lifted = Motion(gait.skeleton, raised, gait.rotations, gait.fps)
    assert broken_frames(lifted).all()
    body = gait.skeleton
    larger = replace(body, offsets=1.3 * body.offsets, end_offsets=1.3 * body.end_offsets)
    assert not broken_frames(Motion(larger, raised, gait.rotations, gait.fps)).any()


def test_features_of_a_batch_are_judged_each_by_itself(gait):
    encoding = JointAngles(gait.skeleton, contacts=True)
    rows = encoding.encode(gait)[:6].expand(2, -1, -1).clone()
    rows[1, 3, encoding.feature_names.index("Chest_x")] = 2.0
    found = beyond(encoding, rows)
    assert found.shape == (2, 6) and (found > 0).nonzero().tolist() == [[1, 3]]
    assert found[1, 3] > 0.5


def test_of_other_bodies_it_knows_nothing(gait):
    other = Skeleton(("Hips", "Spine"), (-1, 0), torch.tensor([[0.0, 0, 0], [0, 0.1, 0]]))
    motion = Motion(other, torch.zeros(3, 3), torch.eye(3).expand(3, 2, 3, 3), 30)
    with pytest.raises(MetricError, match="canonical"):
        broken_frames(motion)
    assert not knows(JointAngles(gait.skeleton, rotation="6d"))
    assert knows(JointAngles(gait.skeleton))


def test_what_is_within_stays_and_what_is_beyond_comes_to_the_edge(gait):
    encoding = JointAngles(gait.skeleton, contacts=True)
    rows = encoding.encode(gait)[:6]
    torch.testing.assert_close(within(encoding, rows), rows)
    odd = rows.clone()
    channel = encoding.feature_names.index("Head_z")  # the data have -0.784 to 0.784
    odd[3, channel] = 2.0
    found = within(encoding, odd)
    assert found[3, channel] == pytest.approx(0.784) and beyond(encoding, found).max() < 0
    others = torch.arange(rows.shape[1]) != channel
    torch.testing.assert_close(found[:, others], rows[:, others])
