"""What positions show of a rotation, and what they hide."""

from __future__ import annotations

import roma
import torch
from torch import Tensor

from ..errors import IkError
from ..skeleton import Skeleton
from .directions import SHORT
from .turns import place, swing, twist_about, unit


def twist_error(found: Tensor, true: Tensor, skeleton: Skeleton) -> tuple[Tensor, Tensor]:
    """Error of each joint's orientation, split into its bone's direction and the twist about it.

    Parameters
    ----------
    found, true : (..., frames, joints, 3, 3), local rotations.
    skeleton : their skeleton.

    Returns
    -------
    direction : (..., frames, joints) degrees, 0 to 180, between the directions of the joint's
        longest bone; NaN where no bone leaves the joint.
    twist : (..., frames, joints) degrees, 0 to 180, about that bone once the directions agree; the
        whole difference of orientation where no bone leaves the joint.

    Raises
    ------
    IkError : rotations that are not two tensors of one such shape.
    """
    joints = skeleton.joints
    shapes = [tuple(turns.shape) if torch.is_tensor(turns) else None for turns in (found, true)]
    if shapes[0] is None or shapes[0] != shapes[1] or shapes[0][-3:] != (joints, 3, 3):
        raise IkError(
            f"Rotations have shapes {shapes[0]} and {shapes[1]}; both must be "
            f"(..., frames, {joints}, 3, 3)."
        )
    # Double: a rotation's angle loses half its digits near zero.
    found, true = found.double(), true.double()
    origin = found.new_zeros(*found.shape[:-3], 3)
    ours, theirs = (place(skeleton, origin, turns)[1] for turns in (found, true))
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets]).to(found)
    twist = roma.rotmat_geodesic_distance(ours, theirs)
    direction = torch.full_like(twist, torch.nan)
    for joint in range(joints):
        children = [p for p, above in enumerate(skeleton.point_parents) if above == joint]
        longest = max((offsets[p] for p in children), key=torch.norm, default=offsets.new_zeros(3))
        if longest.norm() > SHORT:
            a, b = ours[..., joint, :, :], theirs[..., joint, :, :]
            u, v = unit(a @ longest), unit(b @ longest)
            direction[..., joint] = 2 * torch.atan2((u - v).norm(dim=-1), (u + v).norm(dim=-1))
            twist[..., joint] = twist_about(swing(u, v) @ a @ b.mT, v).abs()
    return torch.rad2deg(direction), torch.rad2deg(twist)
