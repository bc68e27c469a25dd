"""Rotations that bring one direction to another, and the twist about a direction."""

from __future__ import annotations

import roma
import torch
from torch import Tensor

from ..kinematics import forward_kinematics
from ..skeleton import Skeleton

# `sum`, `norm` and `@` take ten to fifty times as long as these where the frames lie side by side in
# memory, as those of `forward_kinematics` do; and `@` starts threads for many tiny matrices.


def dot(a: Tensor, b: Tensor, keepdim: bool = False) -> Tensor:
    """Inner products (...) of vectors (..., 3), or (..., 1)."""
    x, y, z = (a * b).unbind(-1)
    found = x + y + z
    return found[..., None] if keepdim else found


def length(v: Tensor, keepdim: bool = False) -> Tensor:
    """Lengths (...) of vectors (..., 3), or (..., 1); none has a slope of 0, as with `norm`."""
    return (dot(v, v, keepdim) + 1e-30).sqrt()


def product(a: Tensor, b: Tensor) -> Tensor:
    """Matrix products (..., 3, 3)."""
    first, second, third = (a[..., :, i, None] * b[..., None, i, :] for i in range(3))
    return first + second + third


def unit(v: Tensor) -> Tensor:
    """Vectors (..., 3) made one long; zero stays zero."""
    return v / length(v, keepdim=True).clamp(min=1e-12)


def skew(v: Tensor) -> Tensor:
    """The matrix (..., 3, 3) whose product with u is the cross product of v and u."""
    x, y, z = v.unbind(-1)
    zero = torch.zeros_like(x)
    return torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*v.shape, 3)


def swing(a: Tensor, b: Tensor) -> Tensor:
    """The smallest rotation (..., 3, 3) from direction a (..., 3) to direction b (..., 3).

    Between opposite directions there is no smallest one; exactly there it is the identity.
    """
    a, b = unit(a), unit(b)
    # Rodrigues: with c = a x b, R = I + [c]x + [c]x² / (1 + a·b).
    across = skew(torch.linalg.cross(a, b))
    cosine = (a * b).sum(-1)[..., None, None]
    return torch.eye(3).to(a) + across + across @ across / (1 + cosine).clamp(min=1e-12)


def shortest_turn(start: Tensor, end: Tensor) -> Tensor:
    """Smallest rotations (..., 3, 3) that turn one direction (..., 3) into another; both broadcast.

    `swing` by way of two half turns: precise also near opposite directions, where `swing` divides
    by little. Exactly there it is none.
    """
    start, end = torch.broadcast_tensors(unit(start), unit(end))
    middle = unit(start + end)
    # Two half turns, about the start and about the middle, make one of twice the angle between:
    # (2 m mᵀ - 1) (2 s sᵀ - 1), multiplied out.
    cosine = dot(middle, start, keepdim=True)
    outer = lambda a, b: a[..., :, None] * b[..., None, :]
    return outer(middle, 4 * cosine * start - 2 * middle) + (
        torch.eye(3).to(start) - 2 * outer(start, start)
    )


def turn_about(axis: Tensor, angle: Tensor) -> Tensor:
    """Rotation (..., 3, 3) by an angle (...) in radians about a unit axis (..., 3)."""
    # Rodrigues: cos + sin [k]x + (1 - cos) k kᵀ. roma makes a quaternion first, in five times the time
    cosine, sine = angle.cos()[..., None, None], angle.sin()[..., None, None]
    along = axis[..., :, None] * ((1 - cosine) * axis[..., None, :])
    return along.addcmul(sine, skew(axis)).addcmul(cosine, torch.eye(3).to(axis))


def twist_about(rotation: Tensor, axis: Tensor) -> Tensor:
    """Angle (...), -π to π, of a rotation's (..., 3, 3) twist about a unit axis (..., 3)."""
    quaternion = roma.rotmat_to_unitquat(rotation)
    half = torch.atan2((quaternion[..., :3] * axis).sum(-1), quaternion[..., 3])
    return torch.remainder(2 * half + torch.pi, 2 * torch.pi) - torch.pi


def nearest_rotation(matrix: Tensor) -> Tensor:
    """The rotation (..., 3, 3) nearest to a matrix (..., 3, 3): orthogonal Procrustes."""
    return roma.special_procrustes(matrix.reshape(-1, 3, 3)).reshape(matrix.shape)


def place(skeleton: Skeleton, root: Tensor, rotations: Tensor) -> tuple[Tensor, Tensor]:
    """Points (..., points, 3) and orientations (..., joints, 3, 3) of a skeleton in a pose.

    root : (..., 3) metres; rotations : (..., joints, 3, 3), local.
    """
    s = skeleton
    return forward_kinematics(s.parents, s.offsets, root, rotations, s.end_parents, s.end_offsets)
