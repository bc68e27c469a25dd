"""The body seen from itself: points in the heading frame, on any skeleton."""

from __future__ import annotations

from torch import Tensor

from ..kinematics import yaw_matrix
from ..skeleton import Skeleton
from .checks import check_skeleton
from .gait import facing


def heading_frame(positions: Tensor, skeleton: Skeleton) -> tuple[Tensor, Tensor]:
    """Points in the frame of the body, and that frame.

    Its origin is the root's place on the ground plane y = 0, z is the way the body faces (by hips
    and shoulders, see `gait.facing`), so that no rotations are needed.

    Parameters
    ----------
    positions : (..., frames, points, 3).

    Returns
    -------
    local : (..., frames, points, 3), in the unit of positions; heights are kept.
    rotation : (..., frames, 3, 3) turns the frame's axes to the world's.

    Raises
    ------
    MetricError : wrong shape, NaN, another skeleton's points.
    SkeletonError : the skeleton lacks hips or shoulders.
    """
    positions = check_skeleton(positions, skeleton)
    rotation = yaw_matrix(facing(positions, skeleton))
    ground = positions[..., :1, :] * positions.new_tensor([1.0, 0.0, 1.0])
    return (positions - ground) @ rotation, rotation
