"""Two bones in closed form: thigh and shank (or two arm bones) reach a target."""

from __future__ import annotations

import torch
from torch import Tensor

from ..errors import IkError
from .turns import product

# The limb stays this share of its length short of straight, and of folded: at the limits themselves
# the gradient of the angle is infinite.
_MARGIN = 1e-4


def two_bone(
    hip: Tensor,
    target: Tensor,
    knee_direction: Tensor,
    upper_offset: Tensor,
    lower_offset: Tensor,
    parent_orientation: Tensor | None = None,
    hinge: tuple[float, float, float] = (1.0, 0.0, 0.0),
) -> tuple[Tensor, Tensor]:
    """Rotations of a two-bone limb (thigh and shank) whose end reaches a target.

    Exact where the target is in reach; otherwise the limb points at the target, stretched or folded
    to within 0.01 % of its limit. The knee always bends towards `knee_direction`, never backwards.
    Differentiable everywhere except where `knee_direction` is parallel to the line from hip to
    target.

    Parameters
    ----------
    hip : (..., 3) metres, the joint where the limb starts, in the world.
    target : (..., 3) metres, where the limb should end (the ankle).
    knee_direction : (..., 3), which way the knee points; need not be a unit vector nor
        perpendicular to anything.
    upper_offset : (3,) metres, from hip to knee in the rest pose.
    lower_offset : (3,) metres, from knee to ankle in the rest pose.
    parent_orientation : (..., 3, 3), world orientation of the hip joint's parent; identity if None.
    hinge : the knee's axis in the rest pose, such that a positive turn about it bends the knee. The
        default is +x, for legs that hang down -y and face +z.

    Returns
    -------
    upper, lower : (..., 3, 3), local rotations of hip and knee joint.

    Raises
    ------
    IkError : a bone without length.
    """
    upper_offset, lower_offset = upper_offset.to(hip), lower_offset.to(hip)
    thigh, shank = upper_offset.norm(), lower_offset.norm()
    if not (thigh > 0 and shank > 0):
        raise IkError("A limb needs two bones: one of the offsets has no length, or is NaN.")
    reach = target - hip
    distance = reach.norm(dim=-1, keepdim=True)
    along = reach / distance.clamp(min=1e-9)
    shortest = (thigh - shank).abs() + _MARGIN * (thigh + shank)
    distance = distance.clamp(min=shortest.item(), max=((1 - _MARGIN) * (thigh + shank)).item())

    # Law of cosines: the angle at the hip between the thigh and the line to the target.
    cosine = (thigh**2 + distance**2 - shank**2) / (2 * thigh * distance)
    sine = (1 - cosine**2).clamp(min=0).sqrt()
    forward = knee_direction - (knee_direction * along).sum(-1, keepdim=True) * along
    forward = forward / forward.norm(dim=-1, keepdim=True).clamp(min=1e-9)
    thigh_way = cosine * along + sine * forward
    shank_way = (distance * along - thigh * thigh_way) / shank

    axis = torch.linalg.cross(forward, along)
    rest_hinge = torch.tensor(hinge).to(hip)
    upper_world = product(_frame(thigh_way, axis), _frame(upper_offset, rest_hinge).mT)
    lower_world = product(_frame(shank_way, axis), _frame(lower_offset, rest_hinge).mT)
    lower = product(upper_world.mT, lower_world)
    if parent_orientation is None:
        return upper_world, lower
    return product(parent_orientation.mT, upper_world), lower


def _frame(way: Tensor, axis: Tensor) -> Tensor:
    """Right-handed orthonormal frame (..., 3, 3): first column along `way`, third near `axis`."""
    way = way / way.norm(dim=-1, keepdim=True)
    axis = axis - (axis * way).sum(-1, keepdim=True) * way
    axis = axis / axis.norm(dim=-1, keepdim=True).clamp(min=1e-9)
    return torch.stack([way, torch.linalg.cross(axis, way), axis], dim=-1)
