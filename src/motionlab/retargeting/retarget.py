"""Bringing a motion to another body: what it does stays, how long its bones are changes.

    motion.retarget()                          # to Skeleton.canonical()
    motion.retarget(skeleton, reference=stand)

In this order:

1. Joints find each other by their roles (`Skeleton.roles`); each takes the world orientation of its
   like, up to the constant rotation between the axes of the two rigs (`rest_alignment`). Joints of
   the source without a role, such as those of a longer spine, fold into these.
2. The way of the hips is scaled by the ratio of the legs' lengths, in all three directions: speeds
   scale with the body. Ankles follow on ways scaled alike, relative to the floor.
3. Feet are brought to the ground and held still while in contact (`feet.planting`), the hips are
   shifted up or down with them, and lowered where a leg would not reach.
4. Legs reach for the ankles by inverse kinematics, knees bending the way they did; hands keep
   their way relative to the shoulder, scaled by the ratio of the arms' lengths.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import torch
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from ..errors import RetargetError
from ..feet.planting import Foot, bridged, find_contacts, levelled, plant
from ..ik import two_bone
from ..ik.turns import shortest_turn
from ..roles import SIDES
from ..skeleton import Skeleton
from .rest_alignment import ELBOW, SHORT, alignment, bone, rest_points, stands

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
_REACH, _STRETCHED = 0.998, 0.9999  # shares of its length that a leg may be stretched to
_SINK_TIME, _SETTLE_TIME = 0.06, 0.35  # seconds


@torch.no_grad()
def retarget(
    motion: Motion, skeleton: Skeleton | None = None, *, reference: Motion | None = None
) -> Motion:
    """The motion on another skeleton, feet on the floor y = 0 and still while in contact.

    Parameters
    ----------
    motion : from any source whose joints are called as people call them.
    skeleton : where to; `Skeleton.canonical` if None. Its rest pose must be a standing body that
        faces +z. A motion that is on it already comes back as it is.
    reference : a motion of the source's skeleton in which a person stands upright, arms hanging or
        spread. It tells how joint axes lie where the rest pose is no standing body; without it
        they are guessed from the motion itself, for which it should be upright most of the time.

    Returns
    -------
    Motion : same frame rate, name and source; `contacts` are true where heel (ankle joint) or toes
        are held still. No gradients flow.

    Raises
    ------
    RetargetError : a skeleton lacks roles or limbs, its rest pose can't be used, or there is no
        frame.
    """
    skeleton = Skeleton.canonical() if skeleton is None else skeleton
    if not _moves(motion) or not isinstance(skeleton, Skeleton):
        raise RetargetError(
            "retarget takes a Motion and a Skeleton, not "
            f"{type(motion).__name__} and {type(skeleton).__name__}."
        )
    if motion.skeleton.matches(skeleton):
        return motion
    _check(motion, skeleton, reference)
    return _retarget(motion, skeleton, reference)


def _moves(value: object) -> bool:
    """Is it a Motion? Told by its skeleton: `Motion.retarget` hands over to this module."""
    return isinstance(getattr(value, "skeleton", None), Skeleton)


def _check(motion: Motion, skeleton: Skeleton, reference: Motion | None) -> None:
    for name, its in (("motion's skeleton", motion.skeleton), ("target skeleton", skeleton)):
        missing = [role for role in NEEDED if role not in its.roles]
        if missing:
            found = ", ".join(f"{role} = {its.names[joint]}" for role, joint in its.roles.items())
            raise RetargetError(
                f"The {name} has no joint for {', '.join(missing)}; its joints are "
                f"{', '.join(its.names)}. Understood: {found or 'none'}. Say the others where the "
                f"skeleton is made or read, as read_bvh(path, roles={{{missing[0]!r}: 'NAME'}}), on the "
                "command line with --roles; `motionlab info FILE` shows and explains the table."
            )
        for joint, child in _BONES:
            offset = its.below(joint, child)
            if offset is None or offset.norm() < SHORT:
                raise RetargetError(
                    f"The {name} has no bone from {joint} to {child}: the one must hang on the "
                    f"other, at least {100 * SHORT:g} cm away."
                )
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
        raise RetargetError(f"{motion!r} has no frame to bring to another skeleton.")
    if reference is not None and not (
        _moves(reference) and len(reference) and reference.skeleton.names == motion.skeleton.names
    ):
        raise RetargetError(
            f"The reference {reference!r} must be a motion with a frame and the joints of "
            f"{motion!r}."
        )


def _retarget(motion: Motion, skeleton: Skeleton, reference: Motion | None) -> Motion:
    points, orientations = motion.positions(), motion.orientations()
    source = motion.skeleton.roles
    turned = {
        role: orientations[:, source[role]] @ turn
        for role, turn in alignment(motion, skeleton, reference).items()
    }
    world = _fill(turned, skeleton)
    scale = _length(skeleton, "leg") / _length(motion.skeleton, "leg")
    at = {role: points[:, joint] * scale for role, joint in source.items()}
    feet = {}
    for i, side in enumerate(SIDES):
        given = None if motion.contacts is None else motion.contacts[:, 2 * i : 2 * i + 2]
        feet[side] = _foot(at, world, side, skeleton, motion.fps, given)

    legs = torch.stack([skeleton.below("hips", f"{side}_upper_leg") for side in SIDES])
    middle = (at["left_upper_leg"] + at["right_upper_leg"]) / 2
    hips = middle - _turn(world["hips"], legs.mean(0))
    # Where the floor lies, and how high the ankles, both feet agree on but for their unevenness.
    hips[:, 1] += _lift(feet.values(), motion.fps)
    hips[:, 1] -= _sink(hips, world["hips"], feet, at, skeleton, motion.fps)

    for side, leg in zip(SIDES, legs, strict=True):
        foot = feet[side]
        start = hips + _turn(world["hips"], leg)
        world |= _leg(start, foot.ankle, at, world, side, skeleton)
        world |= {f"{side}_foot": foot.foot, f"{side}_toes": foot.toes}
        world |= _arm(at, world, side, motion.skeleton, skeleton, scale)
    return replace(
        motion,
        skeleton=skeleton,
        # a root above the hips, as some rigs have it, goes with them
        root_positions=hips - rest_points(skeleton)[skeleton.roles["hips"]],
        rotations=_local(world, skeleton),
        contacts=torch.cat([foot.contacts for foot in feet.values()], -1),
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


def _length(skeleton: Skeleton, limb: str) -> float:
    """Length in metres of the limb's two long bones, mean of left and right."""
    parts = (f"upper_{limb}", f"lower_{limb}", "foot" if limb == "leg" else "hand")
    points, roles = rest_points(skeleton), skeleton.roles
    joints = [[points[roles[f"{side}_{part}"]] for part in parts] for side in SIDES]
    return float(sum((b - a).norm() + (c - b).norm() for a, b, c in joints) / len(SIDES))


def _foot(
    at: dict[str, Tensor],
    world: dict[str, Tensor],
    side: str,
    skeleton: Skeleton,
    fps: float,
    contacts: Tensor | None,
) -> Foot:
    """One foot on the ground, from where it is scaled."""
    ankle, foot = at[f"{side}_foot"], world[f"{side}_foot"]
    sole = bone(skeleton, f"{side}_foot", f"{side}_toes")
    pointing, tip = foot, None  # where the toes point, if they are a joint
    if f"{side}_toes" in world:
        pointing, tip = world[f"{side}_toes"], bone(skeleton, f"{side}_toes", "")
    toes = at.get(f"{side}_toes")
    if toes is None:
        toes = ankle + _turn(foot, sole)
    foot = levelled(foot, ankle, toes, fps)
    if contacts is None:
        contacts = find_contacts(ankle, toes, foot, _speed(at, fps), fps)
    toe_height = _TOE_HEIGHT * _length(skeleton, "leg")
    heights = torch.tensor([toe_height - float(sole[1]), toe_height])
    tip = torch.zeros(3) if tip is None else tip
    return plant(ankle, foot, pointing, contacts, sole, tip, heights)


def _speed(at: dict[str, Tensor], fps: float) -> Tensor:
    """Speed (frames,) of the body over the ground, metres a second, smoothed."""
    middle = (at["left_upper_leg"] + at["right_upper_leg"])[:, [0, 2]] / 2
    if len(middle) == 1:
        return torch.zeros(1)
    smooth = gaussian_filter1d(middle.numpy(), _SETTLE_TIME * fps, axis=0, mode="nearest")
    return torch.gradient(torch.from_numpy(smooth), spacing=1 / fps, dim=0)[0].norm(dim=-1)


def _lift(feet: Iterable[Foot], fps: float) -> Tensor:
    """Metres (frames,) by which the body is raised: as the ankles of flat feet were.

    Then legs are bent as they were.
    """
    lifts = []
    for foot in feet:
        heel = foot.contacts[:, 0]
        lifts.append(bridged(foot.shift, heel if heel.any() else foot.contacts[:, 1])[:, 1])
    lift = torch.stack(lifts).mean(0).numpy()
    return torch.from_numpy(gaussian_filter1d(lift, _SETTLE_TIME * fps, mode="nearest"))


def _sink(
    hips: Tensor,
    orientations: Tensor,
    feet: dict[str, Foot],
    at: dict[str, Tensor],
    skeleton: Skeleton,
    fps: float,
) -> Tensor:
    """Metres (frames,) by which the body must come down for its legs to reach the ankles.

    No leg is stretched beyond `_REACH`, or beyond how far it was.

    hips : (frames, 3) metres; orientations : theirs, (frames, 3, 3).
    """
    leg = _length(skeleton, "leg")
    needed = torch.zeros(len(hips))
    for side, foot in feet.items():
        was = (at[f"{side}_foot"] - at[f"{side}_upper_leg"]).norm(dim=-1)
        reach = was.clamp(min=_REACH * leg, max=_STRETCHED * leg)
        start = hips + _turn(orientations, skeleton.below("hips", f"{side}_upper_leg"))
        way = start - foot.ankle
        level = (way[:, [0, 2]] ** 2).sum(-1)
        needed = needed.maximum(way[:, 1] - (reach**2 - level).clamp(min=0.01).sqrt())
    needed = needed.where(needed > 1e-4, 0.0)
    if not needed.any():
        return needed
    sigma = _SINK_TIME * fps
    widest = maximum_filter1d(needed.numpy(), 2 * round(2 * sigma) + 1)
    return torch.from_numpy(gaussian_filter1d(widest, sigma, truncate=2))


def _leg(
    start: Tensor, ankle: Tensor, at: dict, world: dict, side: str, skeleton: Skeleton
) -> dict[str, Tensor]:
    """World orientations of thigh and shank."""
    thigh, shank, foot = (f"{side}_{part}" for part in ("upper_leg", "lower_leg", "foot"))
    ahead = world[thigh][..., 2]
    aside = _aside(at[thigh], at[shank], at[foot])
    backwards = (aside * ahead).sum(-1, keepdim=True) <= 0
    knee = _bend(aside.masked_fill(backwards, 0.0), ahead)
    offsets = (skeleton.below(*pair) for pair in pairwise((thigh, shank, foot)))
    upper, lower = two_bone(start, ankle, knee, *offsets)
    return {thigh: upper, shank: upper @ lower}


def _arm(
    at: dict, world: dict, side: str, source: Skeleton, skeleton: Skeleton, scale: float
) -> dict[str, Tensor]:
    """World orientations of upper and lower arm: as the source's, swung for the hand's place."""
    upper, lower, hand = (f"{side}_{part}" for part in ("upper_arm", "lower_arm", "hand"))
    ratio = _length(skeleton, "arm") / _length(source, "arm") / scale
    # In the frame of the upper arm, elbows lie on one side; where the arm is straight, on average.
    aside = _aside(at[upper], at[lower], at[hand])
    side_of_elbow = (world[upper].mT @ aside[..., None]).mean(0)[:, 0]
    side_of_elbow = side_of_elbow - torch.tensor([0.0, 0.0, 1e-4])
    elbow = _bend(aside, _turn(world[upper], side_of_elbow / side_of_elbow.norm()))
    offsets = [skeleton.below(*pair) for pair in pairwise((upper, lower, hand))]
    reach = ratio * (at[hand] - at[upper])
    first, second = two_bone(torch.zeros_like(reach), reach, elbow, *offsets, hinge=ELBOW[side])
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
