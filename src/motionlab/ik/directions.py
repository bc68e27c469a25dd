"""A first pose in closed form: every joint turns so that its bones point where the targets are.

Positions show a joint's whole orientation only where bones leave it in different directions (hips,
chest). Where one bone leaves, they show its direction and hide the turn about it, the twist. What
decides the twist here: the neutral pose; the bend of a hinge below (`hinge.py`); or the joints of
known orientation at both ends of a chain, between which it is shared out. Nothing in here jumps
when the targets move a little, so that smooth points give smooth rotations.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from ..skeleton import Skeleton
from .hinge import Hinge
from .turns import nearest_rotation, place, swing, turn_about, twist_about, unit

SHORT = 1e-4  # metres; a shorter bone has no direction
# How much of a Procrustes fit the neutral pose decides: only what the bones leave open.
_NEUTRAL_SHARE = 1e-6
# Bones go different ways if their unit vectors' second singular value is above this.
_SPREAD = 0.1


class Bone(NamedTuple):
    """A point whose direction from a joint depends on that joint's orientation alone."""

    point: int
    offset: Tensor  # (3,) metres, in the joint's frame
    own: bool = True  # or passed on by a child in the same place


def leaving_bones(skeleton: Skeleton, neutral: Tensor) -> list[list[Bone]]:
    """The bones that leave each joint; a child in the same place passes on its own.

    The CMU skeletons have such children: hip joints that lie in the middle of the hips. As these
    may turn by themselves, they are asked only where a joint's own bones leave its turn open.
    """
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets]).to(neutral)
    found: list[list[Bone]] = [[] for _ in skeleton.names]
    passed: list[list[Bone]] = [[] for _ in skeleton.names]
    for point, parent in reversed([*enumerate(skeleton.point_parents)]):  # children before parents
        if point < skeleton.joints and not _show_orientation(found[point]):
            found[point] = passed[point] + found[point]
        if parent < 0:
            break
        if offsets[point].norm() > SHORT:
            found[parent].insert(0, Bone(point, offsets[point]))
        elif point < skeleton.joints:
            # except a fingertip: it says nothing of the hand
            bones = [bone for bone in found[point] if bone.point < skeleton.joints]
            passed[parent][:0] = [Bone(b.point, neutral[point] @ b.offset, False) for b in bones]
    return found


def _show_orientation(leaving: list[Bone]) -> bool:
    """Whether bones leave in ways different enough to show the joint's whole orientation."""
    ways = [unit(bone.offset) for bone in leaving]
    return len(ways) > 1 and bool(torch.linalg.svdvals(torch.stack(ways))[1] > _SPREAD)


def first_pose(
    skeleton: Skeleton,
    targets: Tensor,
    seen: Tensor,
    neutral: Tensor,
    hinges: dict[int, Hinge],
    smooth: float,
) -> tuple[Tensor, Tensor]:
    """Root positions and local rotations that point the bones at their targets.

    Parameters
    ----------
    targets : (batch, frames, points, 3) metres.
    seen : (batch, frames, points), from 1, a target that counts, to 0, one that is not there.
    neutral : (joints, 3, 3), local rotations of the neutral pose.
    hinges : by the joint above each.
    smooth : see `solve`.

    Returns
    -------
    root_positions : (batch, frames, 3) metres.
    rotations : (batch, frames, joints, 3, 3), local.
    """
    targets, seen = list(targets.unbind(-2)), list(seen[..., None].unbind(-2))
    leaving = leaving_bones(skeleton, neutral)
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets]).to(neutral)
    bending = {hinge.lower: hinge for hinge in hinges.values()}
    root, turned = _whole_body(skeleton, torch.stack(targets), torch.stack(seen), neutral)
    places, world = {0: root}, []
    for joint, parent in enumerate(skeleton.parents):
        pose = (turned if parent < 0 else world[parent]) @ neutral[joint]
        # From the joint's own target if it has one, so that errors do not add up down the tree.
        here = seen[joint] * targets[joint] + (1 - seen[joint]) * places[joint]
        if hinge := hinges.get(joint):
            lower, end = hinge.lower, hinge.end
            lengths = offsets[lower].norm(), offsets[end].norm()
            guess = hinge.middle(pose, here, targets[end], lengths)
            targets[lower] = seen[lower] * targets[lower] + (1 - seen[lower]) * guess
            seen[lower] = seen[lower] + (1 - seen[lower]) * seen[end]
        ways = [
            seen[point] * unit(targets[point] - here) + (1 - seen[point]) * unit(pose @ offset)
            for point, offset, _ in leaving[joint]
        ]
        if joint in bending:
            pose = bending[joint].bend_to(world[parent], pose, ways[0])
        if len(ways) == 1:
            pose = swing(pose @ leaving[joint][0].offset, ways[0]) @ pose
        elif ways:
            pose = _procrustes(ways, leaving[joint], pose)
            own = [pair for pair in zip(leaving[joint], ways, strict=True) if pair[0].own]
            if 0 < len(own) < len(ways):  # they point their way whatever the children do
                bone, way = max(own, key=lambda pair: pair[0].offset.norm())
                pose = swing(pose @ bone.offset, way) @ pose
        if hinge:
            below = seen[lower] * seen[end] * unit(targets[end] - targets[lower])
            pose = hinge.twist_above(pose, unit(pose @ offsets[lower]), below, smooth)
        world.append(pose)
        for point, above in enumerate(skeleton.point_parents):
            if above == joint:
                places[point] = places[joint] + pose @ offsets[point]
    _share_twist(skeleton, world, leaving, neutral, set(hinges))
    local = [world[0]]
    local += [world[p].mT @ world[j] for j, p in enumerate(skeleton.parents) if p >= 0]
    return root, torch.stack(local, dim=-3)


def _whole_body(
    skeleton: Skeleton, targets: Tensor, seen: Tensor, neutral: Tensor
) -> tuple[Tensor, Tensor]:
    """Root position, and the turn that brings the neutral pose nearest to all targets."""
    still = place(skeleton, neutral.new_zeros(3), neutral)[0][:, None, None]
    total = seen.sum(0).clamp(min=1e-9)
    middle, still_middle = (seen * targets).sum(0) / total, (seen * still).sum(0) / total
    outer = (targets - middle)[..., :, None] * (still - still_middle)[..., None, :]
    turn = nearest_rotation((seen[..., None] * outer).sum(0) + 1e-6 * torch.eye(3).to(targets))
    beside = middle - (turn @ still_middle[..., None])[..., 0]
    return seen[0] * targets[0] + (1 - seen[0]) * beside, turn


def _procrustes(ways: list[Tensor], leaving: list[Bone], pose: Tensor) -> Tensor:
    """The orientation that best points bones their ways, longer bones counting more.

    What the bones leave open comes from `pose` (..., 3, 3).
    """
    matrix = _NEUTRAL_SHARE * sum(bone.offset.square().sum() for bone in leaving) * pose
    for way, bone in zip(ways, leaving, strict=True):
        matrix = matrix + bone.offset.norm() * way[..., :, None] * bone.offset
    return nearest_rotation(matrix)


def _share_twist(
    skeleton: Skeleton,
    world: list[Tensor],
    leaving: list[list[Bone]],
    neutral: Tensor,
    hinged: set[int],
) -> None:
    """Share the twist between two joints of known orientation out over the joints between.

    Turns the orientations in `world` about their own bones, which moves no point.
    """
    shown = {joint for joint, bones in enumerate(leaving) if _show_orientation(bones)}
    for joint in sorted(shown):
        chain: list[int] = []
        above = skeleton.parents[joint]
        while above >= 0 and above not in shown | hinged:
            chain.insert(0, above)
            above = skeleton.parents[above]
        if above < 0 or not chain:
            continue
        ways = [unit(world[between] @ leaving[between][0].offset) for between in chain]
        straight = world[chain[-1]] @ neutral[joint]
        twist = twist_about(world[joint] @ straight.mT, ways[-1]) / (len(chain) + 1)
        for count, (between, way) in enumerate(zip(chain, ways, strict=True), start=1):
            world[between] = turn_about(way, count * twist) @ world[between]
