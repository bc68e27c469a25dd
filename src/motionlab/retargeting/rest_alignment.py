"""How the joint axes of two skeletons lie to each other.

Every rig draws its joints' axes in its own way: along the bones, along the world, or any way at
all. For each role this module finds the constant rotation A (3, 3) with ``R_target = R_source @ A``
for the world orientations R, so that both bodies stand alike. What standing is, is learned

* from the source's rest pose, where that is a person standing upright,
* else from a reference motion of the same skeleton in which a person stands upright,
* else from the motion itself: the trunk's axes are those that lie nearest to the body's, knees and
  elbows tell their hinges by bending.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations, product
from typing import TYPE_CHECKING

import roma
import torch
from torch import Tensor

from ..ik.turns import shortest_turn
from ..roles import SIDES
from ..skeleton import Skeleton

if TYPE_CHECKING:
    from ..motion import Motion

TRUNK = (
    ("hips", "spine"),
    ("spine", "chest"),
    ("chest", "neck"),
    ("neck", "head"),
    ("head", ""),
    ("left_shoulder", "left_upper_arm"),
    ("right_shoulder", "right_upper_arm"),
)
# Child along which the bone of a limb's joint points, in the order of the limb.
LIMBS = (
    ("upper_arm", "lower_arm"),
    ("lower_arm", "hand"),
    ("hand", ""),
    ("upper_leg", "lower_leg"),
    ("lower_leg", "foot"),
    ("foot", "toes"),
    ("toes", ""),
)
_ABOVE = {"lower_arm": "upper_arm", "hand": "lower_arm", "lower_leg": "upper_leg"}
# Axes about which elbows (left, right) and knees bend where the body stands in a T-pose facing +z.
ELBOW = {"left": (0.0, -1.0, 0.0), "right": (0.0, 1.0, 0.0)}
KNEE = (1.0, 0.0, 0.0)
# Axes drawn along the body's are within this of them, on average over a motion.
_SNAP = 30.0  # degrees
_ALONG = 3.0  # degrees between a bone and the axis along which it is drawn
SHORT = 0.01  # metres; a shorter bone tells no direction
_UP = torch.tensor([0.0, 1.0, 0.0])


def alignment(motion: Motion, target: Skeleton, reference: Motion | None) -> dict[str, Tensor]:
    """Rotation A (3, 3) per role that both skeletons have: ``R_target = R_source @ A``.

    The target's rest pose must be a standing body facing +z (`stands`).
    """
    source = motion.skeleton
    roles = [role for role in target.roles if role in source.roles]
    if reference is None and stands(source):
        at_rest = torch.eye(3).expand(1, source.joints, 3, 3)
        rest = replace(motion, root_positions=torch.zeros(1, 3), rotations=at_rest, contacts=None)
        return _from_stance(rest, target, roles)
    if reference is not None:
        return _from_stance(reference, target, roles)
    return _from_motion(motion, target, roles)


def stands(skeleton: Skeleton) -> bool:
    """Whether the rest pose is a body standing upright with straight legs, facing +z."""
    points, roles = rest_points(skeleton), skeleton.roles
    at = lambda role: points[roles[role]]
    across = at("left_upper_leg") - at("right_upper_leg")
    if across[0] < 0.9 * across.norm() or across.norm() == 0:
        return False
    legs = all(
        _unit(at(f"{side}_foot") - at(f"{side}_upper_leg"))[1] < -0.9
        and _unit(at(f"{side}_lower_leg") - at(f"{side}_upper_leg"))[1] < -0.85
        for side in SIDES
    )
    middle = (at("left_upper_leg") + at("right_upper_leg")) / 2
    shoulders = (at("left_upper_arm") + at("right_upper_arm")) / 2
    return bool(legs and _unit(shoulders - middle)[1] > 0.9)


def rest_points(skeleton: Skeleton) -> Tensor:
    """Points (points, 3) of the rest pose, the root at the origin."""
    points = torch.zeros(skeleton.points, 3)
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
    for point, parent in enumerate(skeleton.point_parents):
        if parent >= 0:
            points[point] = points[parent] + offsets[point]
    return points


def facing(points: Tensor, skeleton: Skeleton) -> Tensor:
    """Frames (frames, 3, 3) that face as hips and shoulders do: left, up and ahead in columns."""
    at = lambda role: points[:, skeleton.roles[role]]
    hips = _unit(at("left_upper_leg") - at("right_upper_leg"))
    shoulders = _unit(at("left_upper_arm") - at("right_upper_arm"))
    left = (hips + shoulders) * torch.tensor([1.0, 0.0, 1.0])
    return frame(left, _UP.expand_as(left))


def frame(first: Tensor, second: Tensor) -> Tensor:
    """Right-handed frames (..., 3, 3): first column along `first`, second near `second`."""
    x = _unit(first)
    z = _unit(torch.linalg.cross(x, second, dim=-1))
    return torch.stack([x, torch.linalg.cross(z, x, dim=-1), z], -1)


def bone(skeleton: Skeleton, joint: str, child: str) -> Tensor | None:
    """Where a limb's joint points in its own frame (3,): at its child or else at its end site."""
    offset = skeleton.below(joint, child)
    if offset is None:
        ends = zip(skeleton.end_parents, skeleton.end_offsets, strict=True)
        start = skeleton.roles[joint]
        offset = next((offset for parent, offset in ends if parent == start), torch.zeros(3))
    return offset if offset.norm() > SHORT else None


def _from_stance(stance: Motion, target: Skeleton, roles: list[str]) -> dict[str, Tensor]:
    """From a motion whose mean pose stands: limbs turned the shortest way from there.

    How limbs are turned about their bones is not asked: that of the stance is taken for that of the
    target's rest pose. The elbows of `cmu` are hinges 30 degrees away from `ELBOW`, so on another
    body its elbows keep bending 30 degrees away from there. Points are not touched by that. What
    bends tell could be used instead, but of arms that hang straight it says little, and each clip
    of one body would get axes of its own.
    """
    source = stance.skeleton
    ahead = facing(stance.positions(), source)
    orientations = stance.orientations()
    axes = {role: _mean(orientations[:, source.roles[role]].mT @ ahead) for role in roles}
    for side in SIDES:
        turned: dict[str, Tensor] = {}
        for part, child in LIMBS:
            joint = f"{side}_{part}"
            if joint not in roles:
                continue
            ours = bone(target, joint, f"{side}_{child}")
            theirs = bone(source, joint, f"{side}_{child}")
            before = turned.get(_ABOVE.get(part, ""), torch.eye(3))
            if ours is None or theirs is None:
                turned[part] = before
            else:
                turned[part] = shortest_turn(before @ ours, axes[joint].mT @ theirs) @ before
            axes[joint] = axes[joint] @ turned[part]
    return axes


def _from_motion(motion: Motion, target: Skeleton, roles: list[str]) -> dict[str, Tensor]:
    """From whatever the person does, most of it upright."""
    source, points, orientations = motion.skeleton, motion.positions(), motion.orientations()
    ahead = facing(points, source)
    world = {role: orientations[:, source.roles[role]] for role in roles}
    axes: dict[str, Tensor] = {}
    for joint, child in TRUNK:
        if joint not in roles:
            continue
        ours, theirs = bone(target, joint, child), bone(source, joint, child)
        if theirs is None and joint == "head" and "neck" in axes:
            axes[joint] = axes["neck"]
        else:
            axes[joint] = _snapped(_mean(world[joint].mT @ ahead), ours, theirs)
    for side in SIDES:
        at = lambda part, side=side: points[:, source.roles[f"{side}_{part}"]]
        for parts, rest_hinge in (
            (("upper_arm", "lower_arm", "hand"), ELBOW[side]),
            (("upper_leg", "lower_leg", "foot", "toes"), KNEE),
        ):
            if not all(f"{side}_{part}" in roles for part in parts[:3]):
                continue
            # Where the limb is straight the product is small and says little.
            hinge = torch.linalg.cross(at(parts[1]) - at(parts[0]), at(parts[2]) - at(parts[1]))
            theirs = None
            for i, part in enumerate(parts):
                joint = f"{side}_{part}"
                if joint not in roles:
                    continue
                child = f"{side}_{parts[i + 1]}" if i + 1 < len(parts) else ""
                # A bone without length goes on as the one before it where nothing is turned.
                here, ours = bone(source, joint, child), bone(target, joint, child)
                theirs = theirs if here is None else here
                if ours is None or theirs is None:
                    continue
                axis = _nearest_axis((world[joint].mT @ hinge[..., None]).mean(0)[:, 0])
                axes[joint] = frame(theirs, axis) @ frame(ours, torch.tensor(rest_hinge)).mT
    return axes


def _mean(rotations: Tensor) -> Tensor:
    """Mean (3, 3) of rotations (frames, 3, 3)."""
    return roma.special_procrustes(rotations.mean(0))


def _snapped(rotation: Tensor, ours: Tensor | None, theirs: Tensor | None) -> Tensor:
    """The rotation with axes along the axes that is meant by one that a body's sway has blurred.

    Where the source's bone lies along an axis, it is one that brings the target's bone there,
    else the nearest, if that lies near.
    """
    turns = torch.tensor([
        [[sign[i] * (p[i] == j) for j in range(3)] for i in range(3)]
        for p in permutations(range(3)) for sign in product((1.0, -1.0), repeat=3)
    ])  # fmt: skip
    turns = turns[torch.linalg.det(turns) > 0]
    if ours is not None and theirs is not None:
        fitting = turns[turns @ _unit(ours) @ _unit(theirs) > math.cos(math.radians(_ALONG))]
        if len(fitting):
            return fitting[(fitting * rotation).sum((1, 2)).argmax()]
    nearest = turns[(turns * rotation).sum((1, 2)).argmax()]
    angle = torch.rad2deg(roma.rotmat_geodesic_distance(nearest, rotation))
    return nearest if angle < _SNAP else rotation


def _nearest_axis(direction: Tensor) -> Tensor:
    """The coordinate axis next to a direction (3,), if it lies near; else the direction."""
    direction = _unit(direction)
    largest = direction.abs().argmax()
    axis = torch.zeros(3)
    axis[largest] = direction[largest].sign()
    return axis if torch.rad2deg(torch.arccos(direction @ axis)) < _SNAP else direction


def _unit(vectors: Tensor) -> Tensor:
    return vectors / vectors.norm(dim=-1, keepdim=True).clamp(min=1e-9)
