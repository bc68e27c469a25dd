"""Forward kinematics: local joint rotations in, joint positions out.

Every joint carries a rotation relative to its parent. Multiplying them down the tree gives the
joint's orientation in the world; adding each bone, turned by its parent's orientation, gives its
position. Batched over any leading dimensions and differentiable. Also here: which way a body faces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import torch
from torch import Tensor

from .errors import MotionError


def forward_kinematics(
    parents: Sequence[int],
    offsets: Tensor,
    root_positions: Tensor,
    rotations: Tensor,
    end_parents: Sequence[int] = (),
    end_offsets: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """Positions of all points and world orientations of all joints.

    Parameters
    ----------
    parents : parent of each joint, -1 for the root (joint 0), parents before children.
    offsets : (joints, 3), each joint relative to its parent, in the parent's frame.
    root_positions : (..., 3), position of the root joint in the world.
    rotations : (..., joints, 3, 3), local rotation matrices, ``child = parent @ local``.
    end_parents, end_offsets : joint and (end_sites, 3) offset of each end site.

    Returns
    -------
    positions : (..., joints + end sites, 3), in the unit of the offsets, joints first.
    orientations : (..., joints, 3, 3), joint frame to world frame.

    Raises
    ------
    MotionError : shapes that do not fit.
    """
    batch, joints = rotations.shape[:-3], len(parents)
    ends = 0 if end_offsets is None else len(end_offsets)
    found = (tuple(offsets.shape), tuple(root_positions.shape), tuple(rotations.shape), ends)
    if found != ((joints, 3), (*batch, 3), (*batch, joints, 3, 3), len(end_parents)):
        raise MotionError(
            f"{joints} joints and {len(end_parents)} end sites need offsets ({joints}, 3), "
            f"root_positions (..., 3), rotations (..., {joints}, 3, 3) and end_offsets "
            f"({len(end_parents)}, 3); they have {found[0]}, {found[1]}, {found[2]} and {ends} rows."
        )
    offsets = offsets.to(rotations)
    # The batch lies last and contiguous: plain multiply-adds on long rows are several times faster
    # than many tiny 3 x 3 products.
    local = rotations.reshape(math.prod(batch), joints, 9).permute(1, 2, 0).contiguous()
    local = local.unflatten(1, (3, 3))
    levels, order = _levels(tuple(parents), rotations.device)
    # All joints equally far from the root at once; their parents are in the level before.
    world = [local[:1]]
    points = [root_positions.reshape(1, math.prod(batch), 3).mT]
    for members, parents_in_level in levels:
        parent, start = world[-1], points[-1]
        if parents_in_level is not None:
            parent, start = parent[parents_in_level], start[parents_in_level]
        points.append(start + _turn(parent, offsets[members]))
        world.append(_product(parent, local[members]))
    orientations, positions = _in_order(world, order), _in_order(points, order)
    if len(end_parents):
        ends = list(end_parents)
        tips = positions[ends] + _turn(orientations[ends], end_offsets.to(rotations))
        positions = torch.cat([positions, tips])
    positions = positions.permute(2, 0, 1).reshape(*batch, len(positions), 3)
    return positions, orientations.permute(3, 0, 1, 2).reshape(rotations.shape)


def heading(rotations: Tensor) -> Tensor:
    """Which way a body faces: the yaw of its root, by swing-twist decomposition about y.

    ``R = yaw_matrix(heading(R)) @ swing``, where the swing's rotation vector has no y component.
    Of all turns about y this one is the nearest to R. Unlike an Euler angle it does not run away
    when the body pitches by 90 degrees; only a body that is exactly upside down (turned by pi about
    a horizontal axis) has no heading: 0 is returned there, with zero gradient.

    Parameters
    ----------
    rotations : (..., 3, 3), world orientations.

    Returns
    -------
    yaw : (...) radians in [-pi, pi]; 0 faces +z, positive turns towards +x (left).
    """
    # with the quaternion (w, x, y, z) these are 4 w y and 2 (w² - y²); the yaw is 2 atan2(y, w)
    sine = rotations[..., 0, 2] - rotations[..., 2, 0]
    cosine = rotations[..., 0, 0] + rotations[..., 2, 2]
    upside_down = sine.detach() ** 2 + cosine.detach() ** 2 < torch.finfo(sine.dtype).eps ** 2
    return torch.atan2(sine.masked_fill(upside_down, 0), cosine.masked_fill(upside_down, 1))


def yaw_matrix(yaw: Tensor) -> Tensor:
    """Rotation (..., 3, 3) about the vertical by yaw (...) radians: turns +z towards +x."""
    sine, cosine = yaw.sin(), yaw.cos()
    zero, one = torch.zeros_like(yaw), torch.ones_like(yaw)
    rows = [cosine, zero, sine, zero, one, zero, -sine, zero, cosine]
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


@lru_cache(maxsize=64)
def _levels(
    parents: tuple[int, ...], device: torch.device
) -> tuple[list[tuple[Tensor, Tensor | None]], list[int]]:
    """Joints by their distance from the root.

    Returns for each level below the root its joints and where in the level above their parents
    are (None: one each, in this order), and the order that brings the joints of all levels, root
    first, back into their own.
    """
    depth, place = [0], [0]
    members: list[list[int]] = [[0]]
    for joint, parent in enumerate(parents[1:], start=1):
        depth.append(depth[parent] + 1)
        if depth[joint] == len(members):
            members.append([])
        place.append(len(members[depth[joint]]))
        members[depth[joint]].append(joint)
    flat = [joint for level in members for joint in level]
    above = [[place[parents[joint]] for joint in level] for level in members[1:]]
    # Kept for later calls: made while sampling, they must serve when training.
    with torch.inference_mode(False):
        levels = [
            (
                torch.tensor(level, device=device),
                None if rows == [*range(len(before))] else torch.tensor(rows, device=device),
            )
            for before, level, rows in zip(members, members[1:], above, strict=False)
        ]
    order = sorted(range(len(flat)), key=flat.__getitem__)
    return levels, order


def _in_order(levels: list[Tensor], order: list[int]) -> Tensor:
    """Joints of all levels in their own order, copied once."""
    joints = [joint for level in levels for joint in level.unbind()]
    return torch.stack([joints[i] for i in order])


def _product(a: Tensor, b: Tensor) -> Tensor:
    """Matrix products of two (joints, 3, 3, batch) stacks."""
    return (a.unsqueeze(3) * b.unsqueeze(1)).sum(2)


def _turn(orientations: Tensor, offsets: Tensor) -> Tensor:
    """Offsets (joints, 3) turned by orientations (joints, 3, 3, batch): (joints, 3, batch)."""
    return (orientations * offsets[:, None, :, None]).sum(2)
