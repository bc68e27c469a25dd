"""How the joint axes of two skeletons lie to each other.

Every rig draws its joints' axes in its own way: along the bones, along the world, or any way at
all. For each role this module finds the constant rotation A (3, 3) with ``R_target = R_source @ A``
for the world orientations R, so that both bodies stand alike. What standing is, is learned

* from the source's rest pose, where that is a person standing upright,
* else from a reference motion of the same skeleton in which a person stands upright,
* else from the motion itself, where it is upright: bones, and pairs of limbs, say how they lie in
  the frame of the joint that they hang on, knees and elbows tell their hinges by bending, and what
  is left is taken from the mean pose. Rigs drawn along the axes are known by their bones; there,
  what was learned is put on the axis that it lies near to.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import roma
import torch
from torch import Tensor

from ..ik.turns import place, shortest_turn
from ..roles import SIDES
from ..skeleton import Skeleton
from .kept_axes import kept

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
# In rigs drawn along the axes, what a motion tells on average is within this of an axis,
_SNAP = 30.0  # degrees
_ALONG, _EXACT = 3.0, 0.5  # and a bone within this of its axis, most bones within this,
_ACROSS = 12.0  # or within this of being square to the hinge about which it turns.
_UPRIGHT, _SHARE = 0.7, 0.05  # of a trunk one long, what points up; of frames, those that must
# A bone of the trunk tells nothing that is farther than this from where the mean pose has it.
_COS_ASTRAY = math.cos(math.radians(45.0))
_NEVER = 50.0  # degrees from the rest pose, on average of what a trunk does while it is upright
SHORT = 0.01  # metres; a shorter bone tells no direction
_SQUARE = 0.9  # cosine between the lines through hips and shoulders of a body that only stands
_STRIDE = 0.1  # of legs one long, how far one may point ahead of the other in a stance
_LEFT, _UP = torch.tensor([1.0, 0.0, 0.0]), torch.tensor([0.0, 1.0, 0.0])


def alignment(motion: Motion, target: Skeleton, reference: Motion | None) -> dict[str, Tensor]:
    """Rotation A (3, 3) per role that both skeletons have: ``R_target = R_source @ A``.

    The target's rest pose must be a standing body facing +z (`stands`). Warns where neither rest
    pose nor motion tells how the source stands.
    """
    roles = [role for role in target.roles if role in motion.skeleton.roles]
    stance = stance_of(motion, reference)
    if stance is None:
        return _from_motion(motion, target, roles)
    if reference is None:
        axes = _from_stance(stance, target, roles)
        return axes | _contradicted(axes, motion)
    return kept(reference, (target, *roles), lambda: _from_stance(reference, target, roles))


def _contradicted(axes: dict[str, Tensor], motion: Motion) -> dict[str, Tensor]:
    """Axes of joints of the trunk that never are in motion as at rest, though that seems to stand.

    A joint in the place of another, of which no bone tells how it lies: a pelvis, say. Heads may
    look anywhere.
    """
    source, points = motion.skeleton, motion.positions()
    rises = rising(points, source)
    if rises.float().mean() < _SHARE:
        return {}
    ahead, orientations = facing(points[rises], source), motion.orientations()[rises]
    trunk = [joint for joint, _ in TRUNK if joint in axes and joint != "head"]
    seen = {joint: _mean(orientations[:, source.roles[joint]].mT @ ahead) for joint in trunk}
    apart = lambda joint: roma.rotmat_geodesic_distance(axes[joint], seen[joint])
    return {joint: its for joint, its in seen.items() if apart(joint) > math.radians(_NEVER)}


def stance_of(motion: Motion, reference: Motion | None = None) -> Motion | None:
    """A motion of the skeleton that stands: the reference, or the rest pose, or None.

    A rest pose that leans as a whole, straight from feet to shoulders, is set upright.
    """
    skeleton = motion.skeleton
    if reference is not None or not upright(skeleton):
        return reference
    points = skeleton.rest_points[None]
    trunk = _up(points, skeleton, "upper_leg", "upper_arm")
    legs = _up(points, skeleton, "foot", "upper_leg")
    rest = torch.eye(3).repeat(1, skeleton.joints, 1, 1)
    if (trunk * legs).sum() > math.cos(math.radians(_EXACT)):
        rest[:, 0] = shortest_turn(trunk, _UP)
    return replace(motion, root_positions=torch.zeros(1, 3), rotations=rest, contacts=None)


def stands(skeleton: Skeleton) -> bool:
    """Whether the rest pose is a body standing upright with straight legs, facing +z."""
    points, roles = skeleton.rest_points, skeleton.roles
    across = points[roles["left_upper_leg"]] - points[roles["right_upper_leg"]]
    return upright(skeleton) and bool(across[0] > 0.9 * across.norm())


def upright(skeleton: Skeleton) -> bool:
    """Whether the rest pose is a body standing upright with straight legs, wherever it faces.

    A step is no stance: both legs point equally far ahead.
    """
    points, roles = skeleton.rest_points, skeleton.roles
    at = lambda role: points[roles[role]]
    across = at("left_upper_leg") - at("right_upper_leg")
    shoulders = at("left_upper_arm") - at("right_upper_arm")
    if _unit(across) @ _unit(shoulders) < _SQUARE:
        return False
    if across.norm() == 0 or across[[0, 2]].norm() < 0.9 * across.norm():
        return False
    ahead = torch.linalg.cross(_unit(across), _UP)
    for part, straight in (("lower_leg", 0.85), ("foot", 0.9)):
        legs = [_unit(at(f"{side}_{part}") - at(f"{side}_upper_leg")) for side in SIDES]
        if max(leg[1] for leg in legs) > -straight or ((legs[0] - legs[1]) @ ahead).abs() > _STRIDE:
            return False
    return bool(_up(points[None], skeleton, "upper_leg", "upper_arm")[0, 1] > 0.95)


def rising(points: Tensor, skeleton: Skeleton) -> Tensor:
    """In which frames (frames,) the trunk points up, more or less."""
    return _up(points, skeleton, "upper_leg", "upper_arm")[:, 1] > _UPRIGHT


def limb_length(skeleton: Skeleton, limb: str, sides: Sequence[str] = SIDES) -> float:
    """Length in metres of a limb's two long bones ("arm", "leg"), mean over sides."""
    parts = (f"upper_{limb}", f"lower_{limb}", "foot" if limb == "leg" else "hand")
    joints = [[skeleton.roles[f"{side}_{part}"] for part in parts] for side in sides]
    bones = skeleton.rest_points[torch.tensor(joints)].diff(dim=1)  # (sides, 2, 3)
    return float(bones.norm(dim=-1).sum() / len(sides))


def facing(points: Tensor, skeleton: Skeleton) -> Tensor:
    """Frames (frames, 3, 3) that face as hips and shoulders do: left, up and ahead in columns."""
    left = _across(points, skeleton) * torch.tensor([1.0, 0.0, 1.0])
    return frame(left, _UP.expand_as(left))


def _across(points: Tensor, skeleton: Skeleton) -> Tensor:
    """Vectors (frames, 3) to the left, hips and shoulders counting alike."""
    at = lambda role: points[:, skeleton.roles[role]]
    hips = _unit(at("left_upper_leg") - at("right_upper_leg"))
    return hips + _unit(at("left_upper_arm") - at("right_upper_arm"))


def _up(points: Tensor, skeleton: Skeleton, lower: str, upper: str) -> Tensor:
    """Unit vectors (frames, 3) from between two joints to between two others."""
    between = lambda part: sum(points[:, skeleton.roles[f"{side}_{part}"]] for side in SIDES)
    return _unit(between(upper) - between(lower))


def frame(first: Tensor, second: Tensor) -> Tensor:
    """Right-handed frames (..., 3, 3): first column along `first`, second near `second`."""
    x = _unit(first)
    z = _unit(torch.linalg.cross(x, second, dim=-1))
    return torch.stack([x, torch.linalg.cross(z, x, dim=-1), z], -1)


def bone(skeleton: Skeleton, joint: str, child: str) -> Tensor | None:
    """Where a limb's joint points in its own frame (3,): at its child or else at its end site.

    A single joint on which nothing hangs is an end site, too.
    """
    offset = skeleton.below(joint, child)
    if offset is None:
        start = skeleton.roles[joint]
        ends = zip(skeleton.end_parents, skeleton.end_offsets, strict=True)
        tips = [offset for parent, offset in ends if parent == start]
        on = [point for point, parent in enumerate(skeleton.point_parents) if parent == start]
        if not tips and len(on) == 1 and on[0] not in skeleton.point_parents:
            tips = [skeleton.offsets[on[0]]]
        offset = tips[0] if tips else torch.zeros(3)
    return offset if offset.norm() > SHORT else None


def elbow_axis(side: str, upper_arm: Tensor) -> Tensor:
    """Axis (3,) about which an elbow bends at rest: that of a T-pose, turned along with the upper
    arm (3,) wherever the rest pose has it. Of an arm that hangs, a T-pose's lies along the bone."""
    spread = torch.tensor([1.0 if side == "left" else -1.0, 0.0, 0.0])
    return shortest_turn(spread, upper_arm) @ torch.tensor(ELBOW[side])


def _from_stance(stance: Motion, target: Skeleton, roles: list[str]) -> dict[str, Tensor]:
    """From a motion whose mean pose stands: limbs turned the shortest way from there.

    How limbs are turned about their bones is not asked: that of the stance is taken for that of the
    target's rest pose. The elbows of `cmu` are hinges 30 degrees away from `ELBOW`, so on another
    body its elbows keep bending 30 degrees away from there. Points are not touched by that. What
    bends tell could be used instead, but of arms that hang straight it says little, and each clip
    of one body would get axes of its own.
    """
    source = stance.skeleton
    points, orientations = place(source, stance.root_positions, stance.rotations)
    turned = orientations[:, [source.roles[role] for role in roles]].mT
    axes = dict(zip(roles, _mean(turned @ facing(points, source)[:, None]), strict=True))
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
    trunk, rises = _up(points, source, "upper_leg", "upper_arm"), rising(points, source)
    if rises.float().mean() >= _SHARE:
        points, orientations = points[rises], orientations[rises]
        ahead = facing(points, source)
    else:
        warnings.warn(
            f"{motion.name or 'motion'}: read it with another up= if the person should stand, or pass "
            "reference=, a motion of this skeleton in which a person stands upright. As it is, the rest "
            "pose is no standing body and the trunk is upright in hardly any frame, so that how the "
            "axes of the joints lie is a guess.",
            stacklevel=5,
        )
        left = _across(points, source)
        ahead = frame(left - (left * trunk).sum(-1, keepdim=True) * trunk, trunk)
    world = {role: orientations[:, source.roles[role]] for role in roles}
    axes: dict[str, Tensor] = {}
    drawn = _drawn_along_axes(source)
    for joint, child in TRUNK:
        if joint not in roles:
            continue
        ours, theirs = bone(target, joint, child), bone(source, joint, child)
        if child in roles:
            theirs = _lies(points, world[joint], source, joint, child)
            theirs = None if theirs is None or theirs.norm() < SHORT else theirs
        if theirs is None and joint == "head" and "neck" in axes:
            axes[joint] = axes["neck"]
        else:
            seen = _mean(world[joint].mT @ ahead)
            pair = _pair(source, joint, lambda *of: _lies(points, world[of[0]], source, *of))
            axes[joint] = _trunk_axes(seen, ours, theirs, pair, drawn)
    for side in SIDES:
        at = lambda part, side=side: points[:, source.roles[f"{side}_{part}"]]
        for parts in (
            ("upper_arm", "lower_arm", "hand"),
            ("upper_leg", "lower_leg", "foot", "toes"),
        ):
            if not all(f"{side}_{part}" in roles for part in parts[:3]):
                continue
            rest_hinge = torch.tensor(KNEE)
            if parts[0] == "upper_arm":
                upper = bone(target, f"{side}_upper_arm", f"{side}_lower_arm")
                rest_hinge = elbow_axis(side, upper)
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
                axis = (world[joint].mT @ hinge[..., None]).mean(0)[:, 0]
                nearest = _nearest_axis(axis)
                if drawn and (nearest @ _unit(theirs)).abs() < math.sin(math.radians(_ACROSS)):
                    axis = nearest
                axes[joint] = frame(theirs, axis) @ frame(ours, rest_hinge).mT
    return axes


def _lies(points: Tensor, world: Tensor, source: Skeleton, joint: str, child: str) -> Tensor | None:
    """Where one joint lies in the frame of another (3,): as at rest, which is None if it hangs elsewhere.

    If there are joints between, whose rest pose may be any, as in motion, where it lies still there:
    of a spine that bends, the mean is a posture.
    """
    start, end = source.roles[joint], source.roles[child]
    seen = (world.mT @ (points[:, end] - points[:, start])[..., None])[..., 0]
    still = (seen - seen.mean(0)).norm(dim=-1).max() < SHORT
    between = source.parents[end] != start
    return seen.mean(0) if between and still else source.below(joint, child)


def _mean(rotations: Tensor) -> Tensor:
    """Mean (..., 3, 3) of rotations (frames, ..., 3, 3)."""
    return roma.special_procrustes(rotations.mean(0))


def _trunk_axes(
    seen: Tensor, ours: Tensor, theirs: Tensor | None, pair: Tensor | None, drawn: bool
) -> Tensor:
    """Axes (3, 3) of a joint of the trunk, from its bone and from the pair of limbs that it bears.

    seen : (3, 3), the axes as the mean pose tells them, blurred by all that the body does.
    ours, theirs : (3,), the bone in the target's frame and in the source's, if it has one.
    pair : (3,), from right to left between limbs that hang on the source's joint, if there are any.
    drawn : whether the source's rig is drawn along the axes.
    """
    if ours is None or (theirs is not None and _unit(theirs) @ (seen @ _unit(ours)) < _COS_ASTRAY):
        ours, theirs = _UP, None  # as where hips lie before the spine, so that their bone goes back
    second = _UP if ours[0].abs() > ours[1].abs() else _LEFT  # besides the bone: of a collar, up
    along, left = _along(theirs), _along(pair)
    if not drawn or (along is None and left is None and theirs is not None and pair is not None):
        if pair is not None:
            return frame(pair, seen @ _UP if theirs is None else theirs)
        return seen if theirs is None else frame(theirs, seen @ second) @ frame(ours, second).mT
    if along is not None:
        beside = pair if pair is not None and second is _LEFT else _nearest_axis(seen @ second)
        return frame(along, beside) @ frame(ours, second).mT
    left = _nearest_axis(seen @ _LEFT) if left is None else left
    return frame(left, _nearest_axis(seen @ _UP))


def _drawn_along_axes(skeleton: Skeleton) -> bool:
    """Whether most bones lie along coordinate axes in the frames of their joints, and legs beside
    each other do."""
    limbs = tuple((f"{side}_{part}", f"{side}_{child}") for side in SIDES for part, child in LIMBS)
    bones = [bone(skeleton, *pair) for pair in TRUNK + limbs if pair[0] in skeleton.roles]
    bones = [each for each in bones if each is not None]
    legs = _pair(skeleton, "hips")
    if legs is not None and _axis_near(legs, _EXACT) is None:
        return False
    return sum(_axis_near(each, _EXACT) is not None for each in bones) > len(bones) / 2


def _pair(
    skeleton: Skeleton, joint: str, lies: Callable[[str, str], Tensor | None] | None = None
) -> Tensor | None:
    """From right to left (3,) between the legs that hang on the hips, or collars or arms on a chest.

    lies : where a joint lies in another's frame; None: as at rest.
    """
    for part in {"hips": ("upper_leg",), "chest": ("shoulder", "upper_arm")}.get(joint, ()):
        if all(f"{side}_{part}" in skeleton.roles for side in SIDES):
            ends = [(lies or skeleton.below)(joint, f"{side}_{part}") for side in SIDES]
            if all(end is not None for end in ends) and (ends[0] - ends[1]).norm() > SHORT:
                return ends[0] - ends[1]
    return None


def _along(direction: Tensor | None) -> Tensor | None:
    """The coordinate axis along which a direction (3,) is drawn, if there is one."""
    return None if direction is None else _axis_near(direction, _ALONG)


def _axis_near(direction: Tensor, degrees: float) -> Tensor | None:
    """The coordinate axis (3,) within so many degrees of a direction (3,), if there is one."""
    direction = _unit(direction)
    largest = direction.abs().argmax()
    axis = torch.zeros(3)
    axis[largest] = direction[largest].sign()
    return axis if direction @ axis > math.cos(math.radians(degrees)) else None


def _nearest_axis(direction: Tensor) -> Tensor:
    """The coordinate axis next to a direction (3,), if it lies near; else the direction."""
    axis = _axis_near(direction, _SNAP)
    return _unit(direction) if axis is None else axis


def _unit(vectors: Tensor) -> Tensor:
    return vectors / vectors.norm(dim=-1, keepdim=True).clamp(min=1e-9)
