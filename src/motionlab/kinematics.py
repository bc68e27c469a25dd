"""Forward kinematics: local joint rotations in, joint positions out.

Every joint carries a rotation relative to its parent. Multiplying them down the tree gives the
joint's orientation in the world; adding each bone, turned by its parent's orientation, gives its
position. Batched over any leading dimensions and differentiable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import torch
from torch import Tensor


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
    """
    batch, joints = rotations.shape[:-3], len(parents)
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
        parent = world[-1][parents_in_level]
        points.append(points[-1][parents_in_level] + _turn(parent, offsets[members]))
        world.append(_product(parent, local[members]))
    orientations, positions = torch.cat(world)[order], torch.cat(points)[order]
    if len(end_parents):
        ends = list(end_parents)
        tips = positions[ends] + _turn(orientations[ends], end_offsets.to(rotations))
        positions = torch.cat([positions, tips])
    positions = positions.permute(2, 0, 1).reshape(*batch, len(positions), 3)
    return positions, orientations.permute(3, 0, 1, 2).reshape(rotations.shape)


@lru_cache(maxsize=64)
def _levels(
    parents: tuple[int, ...], device: torch.device
) -> tuple[list[tuple[Tensor, Tensor]], Tensor]:
    """Joints by their distance from the root.

    Returns for each level below the root its joints and where in the level above their parents
    are, and the order that brings the joints of all levels, root first, back into their own.
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
            (torch.tensor(level, device=device), torch.tensor(rows, device=device))
            for level, rows in zip(members[1:], above, strict=True)
        ]
        return levels, torch.tensor(flat, device=device).argsort()


def _product(a: Tensor, b: Tensor) -> Tensor:
    """Matrix products of two (joints, 3, 3, batch) stacks."""
    return (a.unsqueeze(3) * b.unsqueeze(1)).sum(2)


def _turn(orientations: Tensor, offsets: Tensor) -> Tensor:
    """Offsets (joints, 3) turned by orientations (joints, 3, 3, batch): (joints, 3, batch)."""
    return (orientations * offsets[:, None, :, None]).sum(2)
