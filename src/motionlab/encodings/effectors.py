"""The body around its root; hands, toes and head, and how they move."""

from __future__ import annotations

import torch
from torch import Tensor

from ..errors import EncodingError
from ..kinematics import forward_kinematics
from ..skeleton import Skeleton
from .path import turned


def body_points(
    skeleton: Skeleton, rotations: Tensor, root_positions: Tensor | None = None
) -> Tensor:
    """Points (..., points, 3) of local rotations (..., joints, 3, 3), by default around the root.

    The root's place in the world, which may be far away, would cost the points' precision.
    """
    if root_positions is None:
        root_positions = rotations.new_zeros(*rotations.shape[:-3], 3)
    return forward_kinematics(
        skeleton.parents,
        skeleton.offsets,
        root_positions,
        rotations,
        skeleton.end_parents,
        skeleton.end_offsets,
    )[0]


def effector_joints(skeleton: Skeleton) -> dict[str, int]:
    """Joint of each end effector by its role: toes (feet where there are none), hands, head."""
    found = {}
    for role in ("left_toes", "right_toes", "left_hand", "right_hand", "head"):
        instead = role.replace("toes", "foot")
        role = role if role in skeleton.roles else instead
        if role not in skeleton.roles:
            raise EncodingError(
                f"{skeleton!r} has no joint that reads like {role.replace('_', ' ')}, so its end "
                f"effectors are not known. Joints: {', '.join(skeleton.names)}."
            )
        found[role] = skeleton.roles[role]
    return found


def moving(points: Tensor, steps: Tensor, fps: float, facing: Tensor | None = None) -> Tensor:
    """Points and their velocities over the ground, from frame to frame.

    Velocities need no path: the points of frame t-1 are brought into the frame of t by the step
    between the two, so nothing is summed up and any window of features will do.

    Parameters
    ----------
    points : (..., frames, points, 3) metres, seen from the ground below the root.
    steps : (..., frames, 3), how that place moved and turned, as `path.steps_between` gives it.
    fps : frames per second.
    facing : (..., frames) radians, yaw of the heading as seen there; None if it is zero.

    Returns
    -------
    (..., frames, points, 6), positions (m) and velocities (m/s) in the heading frame of their
    frame; the velocity of row 0 repeats that of row 1, and is zero if there is no row 1.
    """
    x, z, turn = steps[..., 1:, None, :].unbind(-1)
    move = torch.stack([x, torch.zeros_like(x), z], dim=-1)
    before = turned(points[..., :-1, :, :] - move, -turn)
    velocities = fps * (points[..., 1:, :, :] - before)
    if facing is not None:
        points = turned(points, -facing[..., None])
        velocities = turned(velocities, -facing[..., 1:, None])
    first = velocities[..., :1, :, :] if points.shape[-3] > 1 else torch.zeros_like(points)
    return torch.cat([points, torch.cat([first, velocities], dim=-3)], dim=-1)
