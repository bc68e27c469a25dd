"""Bone lengths that are known to be wrong."""

import pytest
import torch

from motionlab import Skeleton
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.metrics import bone_length_error


@pytest.fixture(scope="module")
def walk():
    motion = gaits.make(seconds=2, speed=1.2)
    return motion.skeleton, motion.positions().double()


def test_rotations_keep_bones(walk):
    skeleton, points = walk
    for some in (points, points[:, : skeleton.joints]):
        found = bone_length_error(some, skeleton)
        assert found.mean < 1e-4 and found.worst < 1e-3


def test_a_head_that_is_pulled_out(walk):
    skeleton, points = walk
    points = points[:, : skeleton.joints].clone()
    head = skeleton.roles["head"]
    parent = skeleton.parents[head]
    bone = points[:, head] - points[:, parent]
    points[10:, head] += 0.03 * bone[10:] / bone[10:].norm(dim=-1, keepdim=True)
    found = bone_length_error(torch.stack([points, walk[1][:, : skeleton.joints]]), skeleton)
    assert found.worst.tolist() == pytest.approx([3.0, 0.0], abs=1e-3)
    share = (len(points) - 10) / len(points) / (skeleton.joints - 1)
    assert float(found.mean[0]) == pytest.approx(3.0 * share, rel=1e-3)


def test_a_smaller_body(walk):
    skeleton, points = walk
    lengths = (points[0, 1:] - points[0, list(skeleton.point_parents[1:])]).norm(dim=-1)
    found = bone_length_error(0.9 * points, skeleton)
    assert float(found.mean) == pytest.approx(10 * float(lengths.mean()), rel=1e-4)


def test_another_body(walk):
    with pytest.raises(MetricError, match="points"):
        bone_length_error(walk[1][:, :7], walk[0])
    with pytest.raises(MetricError, match="skeleton"):
        bone_length_error(walk[1], None)
    assert isinstance(walk[0], Skeleton)
