"""The pose that rotation vectors are measured from."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import roma
import torch
from torch import Tensor

from ..errors import EncodingError
from ..skeleton import Skeleton
from .base import drawn_as_canonical

_FILE = Path(__file__).with_name("mean_pose.json")  # written by experiments/data/fit_mean_pose.py


# Kept in an encoding: one made while sampling must serve when training.
@torch.inference_mode(False)
def mean_pose_of(skeleton: Skeleton) -> Tensor:
    """Local rotations (joints, 3, 3), float64: the mean of the training data for
    `Skeleton.canonical` and bodies that are drawn like it, the rest pose for any other."""
    if drawn_as_canonical(skeleton):
        return _canonical_pose()
    return torch.eye(3, dtype=torch.float64).repeat(skeleton.joints, 1, 1)


@cache
def _canonical_pose() -> Tensor:
    vectors = json.loads(_FILE.read_text(encoding="utf-8"))["rotation_vectors"]
    turns = torch.tensor([vectors[name] for name in Skeleton.canonical().names])
    return roma.rotvec_to_rotmat(turns.double())


@torch.inference_mode(False)
def check_pose(pose: Tensor, skeleton: Skeleton) -> Tensor:
    """A mean pose as float64 (joints, 3, 3); EncodingError if it is not one rotation a joint."""
    try:
        pose = torch.as_tensor(pose, dtype=torch.float64).detach().cpu().clone()
    except (TypeError, ValueError, RuntimeError) as error:
        raise EncodingError(f"mean_pose must be an array of rotations: {error}.") from error
    expected = (skeleton.joints, 3, 3)
    identity = torch.eye(3, dtype=torch.float64)
    right = pose.shape == expected and torch.allclose(pose @ pose.mT, identity, rtol=0, atol=1e-4)
    if not right or (torch.linalg.det(pose) < 0).any():  # a reflection is no rotation
        raise EncodingError(
            f"mean_pose has shape {tuple(pose.shape)}; it must hold one rotation matrix for each "
            f"joint, {expected}."
        )
    return pose
