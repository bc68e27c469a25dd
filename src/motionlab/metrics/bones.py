"""Do bones keep their lengths? Points that a network names one by one need not."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from ..skeleton import Skeleton
from .checks import check_skeleton


class BoneError(NamedTuple):
    """Centimetres (...) by which bones are too long or too short: their mean, and the worst of all."""

    mean: Tensor
    worst: Tensor


def bone_length_error(positions: Tensor, skeleton: Skeleton) -> BoneError:
    """How far bones are from the lengths that a skeleton gives them, over all bones and frames.

    STRNN, equation 10, asks for it in control. Rotations on a skeleton score 0; so does motion that
    was put on one by IK.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres, all points or the joints alone.
    skeleton : whose lengths are right.

    Raises
    ------
    MetricError : wrong shape, another number of points, NaN.
    """
    positions = check_skeleton(positions, skeleton)
    parents = list(skeleton.point_parents[1 : positions.shape[-2]])
    right = torch.cat([skeleton.offsets, skeleton.end_offsets]).norm(dim=-1).to(positions)
    lengths = (positions[..., 1:, :] - positions[..., parents, :]).norm(dim=-1)
    wrong = 100 * (lengths - right[1 : positions.shape[-2]]).abs()
    return BoneError(wrong.mean((-2, -1)), wrong.amax((-2, -1)))
