"""Bringing a motion to another body: what it does stays, how long its bones are changes.

    motion.retarget()                          # to Skeleton.canonical()
    motion.retarget(skeleton, reference=stand)

In this order:

1. Joints find each other by their roles (`Skeleton.roles`); each takes the world orientation of its
   like, up to the constant rotation between the axes of the two rigs (`rest_alignment`). Joints of
   the source without a role, such as those of a longer spine, fold into these.
2. The way of the hips is scaled by the ratio of the legs' lengths, in all three directions: speeds
   scale with the body. Ankles follow on ways scaled alike, relative to the floor.
3. Feet are brought to the ground and held still while in contact (`feet.planting`). The hips follow
   those that stand, so that their legs stay as stretched as they were, and come down where a leg
   that must stand would not reach. A foot that does not touch moves nothing.
4. Legs reach for the ankles by inverse kinematics, knees bending the way they did; hands keep
   their way relative to the shoulder, scaled by the ratio of the arms' lengths.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import torch
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from ..errors import RetargetError
from ..feet.flat import levelled
from ..feet.planting import Foot, Sole, find_contacts, let_go, plant
from ..ik import two_bone
from ..ik.turns import shortest_turn
from ..roles import SIDES
from ..skeleton import Skeleton
from .flat_feet import HANGING, Stance, ends_of, scaled, toes_up, with_flat_feet
from .hips import follow, sink, stretched
from .joints_between import settled
from .rest_alignment import (
    SHORT,
    alignment,
    bone,
    elbow_axis,
    limb_length,
    stance_of,
    stands,
)

if TYPE_CHECKING:
    from ..motion import Motion

NEEDED = ("hips", "chest") + tuple(
    f"{side}_{part}"
    for side in SIDES
    for part in ("upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
)
_BONES = tuple(
    (f"{side}_{part}", f"{side}_{child}")
    for side in SIDES
    for limb in (("upper_arm", "lower_arm", "hand"), ("upper_leg", "lower_leg", "foot"))
    for part, child in pairwise(limb)
)
_TOE_HEIGHT = 0.0251 / 0.8007  # of a flat foot's toe joint above the floor, in lengths of the leg
_STRAIGHT = 0.005  # metres off the line between its ends, of the middle of a limb
_SETTLE_TIME = 0.35  # seconds


@torch.no_grad()
def retarget(
    motion: Motion, skeleton: Skeleton | None = None, *, reference: Motion | Stance | None = None
) -> Motion:
    """The motion on another skeleton, feet on the floor y = 0 and still while in contact.

    Parameters
    ----------
    motion : from any source whose joints are called as people call them.
    skeleton : where to; `Skeleton.canonical` if None. Its rest pose must be a standing body that
        faces +z. A motion that is on it already, whatever its joints are called, is not changed.
    reference : a motion of the source's skeleton in which a person stands upright, arms hanging or
        spread. It tells how joint axes lie where the rest pose is no standing body; without it
        they are guessed from the motion itself, for which it should be upright most of the time. Or
        what `stance.stances` found in all clips of the rig, which knows its flat feet, too.

    Returns
    -------
    Motion : same frame rate, name and source; `contacts` are true where heel (ankle joint) or toes
        are held still. No gradients flow.

    Raises
    ------
    RetargetError : a skeleton lacks roles or limbs, its rest pose can't be used, or there is no
        frame.

    Warns where neither rest pose, reference nor motion tells how the source stands.
    """
    skeleton = Skeleton.canonical() if skeleton is None else skeleton
    if not _moves(motion) or not isinstance(skeleton, Skeleton):
        raise RetargetError(
            "retarget takes a Motion and a Skeleton, not "
            f"{type(motion).__name__} and {type(skeleton).__name__}."
        )
    if motion.skeleton.matches(skeleton):
        return motion
    if _same_body(motion.skeleton, skeleton):
        return replace(motion, skeleton=skeleton)
    stance = reference if isinstance(reference, Stance) else Stance(reference)
    _check(motion, skeleton, stance.motion)
    if reference is not None and stance is not reference:
        stance = with_flat_feet(reference, [reference, motion])
    return _retarget(settled(motion), skeleton, stance.settled())


def _moves(value: object) -> bool:
    """Is it a Motion? Told by its skeleton: `Motion.retarget` hands over to this module."""
    return isinstance(getattr(value, "skeleton", None), Skeleton)


def _tell_placed(name: str, skeleton: Skeleton) -> None:
    """That joints were told by their bones, which a rig with joints of its own can mislead."""
    if placed := skeleton.roles.placed:
        found = ", ".join(f"{role} = {skeleton.names[skeleton.roles[role]]}" for role in placed)
        warnings.warn(
            f"Names of the {name} do not tell which joint is which; by the lengths of bones it is "
            f"{found}. Look whether it moves well; roles=, with a table that `motionlab info` prints, says "
            "it for certain.",
            stacklevel=5,
        )


def _same_body(one: Skeleton, other: Skeleton) -> bool:
    """Whether two skeletons differ in the names of their joints alone, not in what these mean."""
    if one.joints != other.joints or one.roles != other.roles:
        return False
    return replace(one, names=other.names, roles=None).matches(other)


def _check(motion: Motion, skeleton: Skeleton, reference: Motion | None) -> None:
    for name, its in (("motion's skeleton", motion.skeleton), ("target skeleton", skeleton)):
        missing = [role for role in NEEDED if role not in its.roles]
        if missing:
            found = ", ".join(f"{role} = {its.names[joint]}" for role, joint in its.roles.items())
            raise RetargetError(
                f"The {name} has no joint for {', '.join(missing)}; its joints are "
                f"{', '.join(its.names)}. Understood: {found or 'none'}. Say the others where the "
                f"skeleton is made or read, as read_bvh(path, roles={{{missing[0]!r}: 'NAME'}}); "
                "`motionlab info FILE` shows and explains the table."
            )
        for joint, child in _BONES:
            offset = its.below(joint, child)
            if offset is None or offset.norm() < SHORT:
                raise RetargetError(
                    f"The {name} has no bone from {joint} to {child}: the one must hang on the "
                    f"other, at least {100 * SHORT:g} cm away."
                )
        _tell_placed(name, its)
    if any(skeleton.below("hips", f"{side}_upper_leg") is None for side in SIDES):
        raise RetargetError("The target skeleton's upper legs do not hang on its hips.")
    if any(bone(skeleton, f"{side}_foot", f"{side}_toes") is None for side in SIDES):
        raise RetargetError(
            "The target skeleton's feet have neither toes nor end sites, so where they stand is "
            "not known; give them such, at least 1 cm away from the ankle."
        )
    if not stands(skeleton):
        raise RetargetError(
            "The target skeleton's rest pose is not a person standing upright and facing +z; "
            "retarget to a skeleton in such a pose, such as Skeleton.canonical()."
        )
    if len(motion) == 0:
        raise RetargetError(
            f"{motion.name or 'The motion'} has no frame to bring to another skeleton."
        )
    if reference is not None and not (
        _moves(reference) and len(reference) and reference.skeleton.names == motion.skeleton.names
    ):
        raise RetargetError(
            f"reference={getattr(reference, 'name', reference)!r} must be a motion with a frame and "
            f"the joints of {motion.name or 'the motion'}."
        )


def _retarget(motion: Motion, skeleton: Skeleton, stance: Stance) -> Motion:
    axes = alignment(motion, skeleton, stance.motion)
    at, turned, scale = scaled(motion, skeleton, axes)
    world = _fill(turned, skeleton)
    feet = _feet(at, world, motion, skeleton, *_level(stance, motion, axes))

    legs = torch.stack([skeleton.below("hips", f"{side}_upper_leg") for side in SIDES])
    middle = (at["left_upper_leg"] + at["right_upper_leg"]) / 2
    hips = middle - _turn(world["hips"], legs.mean(0))
    starts = hips + (world["hips"] @ legs.T).permute(2, 0, 1)
    stretch = stretched(at, motion.skeleton, skeleton)
    moved = follow(feet, starts, stretch, motion.fps)
    moved[:, 1] -= sink(feet, starts + moved, stretch, skeleton, motion.fps)

    planted = zip(feet, starts + moved, stretch, strict=True)
    feet = []
    for side, (foot, start, length) in zip(SIDES, planted, strict=True):
        if not foot.touches.any():
            foot = replace(foot, ankle=foot.ankle + moved, shift=moved)
        longest = limb_length(skeleton, "leg", [side])
        foot = let_go(foot, start, length, longest, motion.fps)
        feet.append(foot)
        world |= _leg(start, foot.ankle, at, world, side, skeleton)
        world |= {f"{side}_foot": foot.foot, f"{side}_toes": foot.toes}
        world |= _arm(at, world, side, motion.skeleton, skeleton, scale)
    return replace(
        motion,
        skeleton=skeleton,
        # a root above the hips, as some rigs have it, goes with them
        root_positions=hips + moved - skeleton.rest_points[skeleton.roles["hips"]],
        rotations=_local(world, skeleton),
        contacts=torch.cat([foot.contacts for foot in feet], -1),
    )


def _fill(turned: dict[str, Tensor], skeleton: Skeleton) -> dict[str, Tensor]:
    """World orientations of all the target's roles; what the source lacks follows what it is on."""
    world, names = {}, {joint: role for role, joint in skeleton.roles.items()}
    for role, joint in skeleton.roles.items():
        above = skeleton.parents[joint]
        while above >= 0 and above not in names:
            above = skeleton.parents[above]
        world[role] = turned[role] if role in turned else world[names.get(above, "hips")]
    return world


def _sole(side: str, skeleton: Skeleton) -> Sole:
    sole, tip = bone(skeleton, f"{side}_foot", f"{side}_toes"), None
    if f"{side}_toes" in skeleton.roles:
        tip = bone(skeleton, f"{side}_toes", "")
    height = _TOE_HEIGHT * limb_length(skeleton, "leg")
    heights = torch.tensor([height - float(sole[1]), height])
    return Sole(sole, torch.zeros(3) if tip is None else tip, heights)


def _level(
    stance: Stance, motion: Motion, axes: dict[str, Tensor]
) -> tuple[Tensor | None, Tensor | None]:
    """Radians (2,) by which toes point up in the stance and in flat feet, None if that isn't known."""
    stands = stance_of(motion, stance.motion)
    if stands is None:
        return None, None
    pitches = toes_up(stands, axes)
    flat = None if stance.flat is None else pitches + torch.tensor(stance.flat)
    return (pitches if pitches.abs().max() < HANGING else None), flat


def _feet(
    at: dict[str, Tensor],
    world: dict[str, Tensor],
    motion: Motion,
    skeleton: Skeleton,
    stance: Tensor | None,
    flat: Tensor | None,
) -> list[Foot]:
    """Both feet on the ground, from where they are scaled. stance, flat : see `levelled`."""
    fps = motion.fps
    drawn, ankles, toes = ends_of(at, world, skeleton)
    level = levelled(drawn, ankles, toes, fps, stance, flat)
    if motion.contacts is None:
        contacts = find_contacts(ankles, toes, level, _speed(at, fps), fps)
    else:
        contacts = torch.stack([motion.contacts[:, :2], motion.contacts[:, 2:]])
    feet = []
    for i, (side, foot) in enumerate(zip(SIDES, level, strict=True)):
        # where the toes point, if they are a joint
        pointing = world.get(f"{side}_toes", drawn[i])
        feet.append(plant(ankles[i], foot, pointing, contacts[i], _sole(side, skeleton), fps))
    return feet


def _speed(at: dict[str, Tensor], fps: float) -> Tensor:
    """Speed (frames,) of the body over the ground, metres a second, smoothed."""
    middle = (at["left_upper_leg"] + at["right_upper_leg"])[:, [0, 2]] / 2
    if len(middle) == 1:
        return torch.zeros(1)
    smooth = gaussian_filter1d(middle.numpy(), _SETTLE_TIME * fps, axis=0, mode="nearest")
    return torch.gradient(torch.from_numpy(smooth), spacing=1 / fps, dim=0)[0].norm(dim=-1)


def _leg(
    start: Tensor, ankle: Tensor, at: dict, world: dict, side: str, skeleton: Skeleton
) -> dict[str, Tensor]:
    """World orientations of thigh and shank."""
    thigh, shank, foot = (f"{side}_{part}" for part in ("upper_leg", "lower_leg", "foot"))
    ahead = world[thigh][..., 2]
    aside = _aside(at[thigh], at[shank], at[foot])
    # A knee that went backwards lies where a straight one does.
    aside = aside + (-(aside * ahead).sum(-1, keepdim=True)).clamp(min=0) * ahead
    knee = _bend(aside, ahead)
    offsets = (skeleton.below(*pair) for pair in pairwise((thigh, shank, foot)))
    upper, lower = two_bone(start, ankle, knee, *offsets)
    return {thigh: upper, shank: upper @ lower}


def _arm(
    at: dict, world: dict, side: str, source: Skeleton, skeleton: Skeleton, scale: float
) -> dict[str, Tensor]:
    """World orientations of upper and lower arm: as the source's, swung for the hand's place."""
    upper, lower, hand = (f"{side}_{part}" for part in ("upper_arm", "lower_arm", "hand"))
    ratio = limb_length(skeleton, "arm") / limb_length(source, "arm") / scale
    # In the frame of the upper arm, elbows lie on one side; where the arm is straight, on average.
    aside = _aside(at[upper], at[lower], at[hand])
    side_of_elbow = (world[upper].mT @ aside[..., None]).mean(0)[:, 0]
    side_of_elbow = side_of_elbow - torch.tensor([0.0, 0.0, 1e-4])
    elbow = _bend(aside, _turn(world[upper], side_of_elbow / side_of_elbow.norm()))
    offsets = [skeleton.below(*pair) for pair in pairwise((upper, lower, hand))]
    reach = ratio * (at[hand] - at[upper])
    hinge = tuple(elbow_axis(side, offsets[0]).tolist())
    first, second = two_bone(torch.zeros_like(reach), reach, elbow, *offsets, hinge=hinge)
    wanted = {upper: first, lower: first @ second}
    return {
        joint: shortest_turn(_turn(world[joint], offset), _turn(turn, offset)) @ world[joint]
        for (joint, turn), offset in zip(wanted.items(), offsets, strict=True)
    }


def _aside(first: Tensor, middle: Tensor, last: Tensor) -> Tensor:
    """Where a limb's middle joint lies beside the line between its ends, (frames, 3) metres."""
    along = last - first
    along = along / along.norm(dim=-1, keepdim=True).clamp(min=1e-9)
    aside = middle - first
    return aside - (aside * along).sum(-1, keepdim=True) * along


def _bend(aside: Tensor, hint: Tensor) -> Tensor:
    """Which way a limb bends: where its middle joint lies, or the hint where it is straight."""
    return aside + (_STRAIGHT - aside.norm(dim=-1, keepdim=True)).clamp(min=0) * hint


def _local(world: dict[str, Tensor], skeleton: Skeleton) -> Tensor:
    """Local rotations (frames, joints, 3, 3); joints without a role stay as at rest."""
    names = {joint: role for role, joint in skeleton.roles.items()}
    whole: list[Tensor] = []
    local = []
    for joint, parent in enumerate(skeleton.parents):
        eye = torch.eye(3).expand_as(world["hips"])
        above = whole[parent] if parent >= 0 else eye
        whole.append(world[names[joint]] if joint in names else above)
        local.append(above.mT @ whole[joint])
    return torch.stack(local, 1)


def _turn(orientations: Tensor, offset: Tensor) -> Tensor:
    return (orientations @ offset[..., None])[..., 0]
