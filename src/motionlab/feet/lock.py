"""Feet that rest where their contact labels say they do (RNN-GAN, section 5.1, post-processing).

A toe that is in contact is held at one place of the floor, the leg is bent to reach it, and before
and after each contact the foot eases from and to where it was. All clips of a batch, all frames and
both feet are worked on at once. On any rig: what is known of its legs comes from `legs`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import torch
from torch import Tensor
from torch.nn.functional import max_pool1d, pad

from ..errors import ModelError
from ..ik.turns import dot, length, product, shortest_turn, unit
from ..kinematics import forward_kinematics
from ..motion import Motion
from ..skeleton import Skeleton
from .legs import PARTS, flat_toes, knee_fronts, leg_joints, leg_lengths, legs_alone
from .marks import clean, distance, longest, numbered, resting
from .planting import off_the_floor, steps

FASTEST = 0.9  # m/s, twice the labels' threshold; a faster foot doesn't rest, whatever its label
FARTHEST = 0.12  # metres that a foot may be from its place and still be held there
RESTS = 0.005  # m/s; a toe that is slower is still, and slides nowhere
BLEND = 0.25  # seconds from a foot's own way to where it is held
REACH = 0.97  # share of its length to which a leg may be stretched; near 1 knees snap
NEAR = 0.04  # metres that a foot may be moved while its leg stays as straight as it was
STRAIGHT = 0.02  # metres that a knee lies beside its leg; its front has no say from twice as much
BACKWARDS = 0.07  # metres that it may lie behind its leg and yet come out in front, if it comes out
SETTLE = 0.15  # seconds over which the body comes down if a leg is too short


def lock_feet(
    motion: Motion,
    contacts: Tensor | None = None,
    *,
    floor: float | None = 0.0,
    blend: float = BLEND,
    deepest: float = math.inf,
    level: bool = True,
) -> Motion:
    """The motion with its toes held still while they are in contact.

    Parameters
    ----------
    motion : with feet, toes and legs that its skeleton names.
    contacts : bool (frames, 2), left and right toe; or (frames, 4) as of a Motion, whose toes are
        taken. None: the motion's own. Where a toe is still for most of a contact, it is held from
        the first to the last frame in which it is.
    floor : height of the floor in metres. None: where toes lie while they are in contact.
    blend : seconds over which a foot eases into a contact, and out of it.
    deepest : metres that the body may come down for a foot to reach its place; one that asks for more is
        let go until it comes down anew. It may be a little more where the body eases down.
    level : whether toes in contact are all at one height, the floor's. False: each stays as high as it is,
        frame by frame, and only slides are taken away. Toes of true walks rise and sink by a centimetre or
        two as the foot rolls, and legs that are nearly straight reach no farther down.

    Returns
    -------
    Motion : on the same skeleton; only legs, feet and the root's height differ. Nothing but the
        floor is changed where there is no contact.

    Raises
    ------
    ModelError : contacts of another shape or kind, or none, a blend, floor or depth that is none.
    SkeletonError : the skeleton lacks a joint of a leg, or its legs do not hang together.
    """
    contacts = motion.contacts if contacts is None else contacts
    if contacts is None:
        raise ModelError(
            "lock_feet: this motion has no contacts. Give them, as `motionlab.contacts.label` does."
        )
    place, rotations = lock(
        motion.skeleton, motion.root_positions, motion.rotations, contacts, motion.fps,
        floor=floor, blend=blend, deepest=deepest, level=level,
    )  # fmt: skip
    return replace(motion, root_positions=place, rotations=rotations)


def lock(
    skeleton: Skeleton,
    root_positions: Tensor,
    rotations: Tensor,
    contacts: Tensor,
    fps: float,
    *,
    floor: float | None = 0.0,
    blend: float = BLEND,
    deepest: float = math.inf,
    level: bool = True,
) -> tuple[Tensor, Tensor]:
    """`lock_feet` for many motions of equal length at once.

    Parameters
    ----------
    root_positions : (..., frames, 3) metres.
    rotations : (..., frames, joints, 3, 3), local.
    contacts : bool (..., frames, 2) or (..., frames, 4).

    Returns
    -------
    root_positions and rotations like those given.
    """
    contacts = _checked(contacts, root_positions, floor, blend, deepest)
    legs, kept = legs_alone(skeleton)
    joints = leg_joints(legs)
    points, world = _forward(legs, root_positions, _picked(rotations, kept))
    leg_lengths(legs, points[..., :1, :, :])  # refuses legs that lack a bone
    at = {part: points[..., joints[part], :] for part in PARTS}  # (..., frames, 2, 3)
    toes = at["toes"]
    speeds = steps(toes) * fps
    held = resting(clean(contacts & (speeds < FASTEST), fps), speeds < RESTS)
    flat = flat_toes(legs, points, held)
    ground = _ground(toes, held, flat, floor) if level else None
    for _ in range(2):  # a foot that is dragged along is let go, and then its place is another
        onto = _onto_places(toes, held, ground)
        rests = held & (length(onto) < FARTHEST)
        if deepest < math.inf:
            ankle = at["foot"] + onto
            ankle[..., 1] -= _usual(onto[..., 1], held)  # what a lower floor asks of all alike
            rests = longest(rests & (_needed(at, ankle) <= deepest), held)
        held = rests
    shift = _shift(_onto_places(toes, held, ground), held, blend * fps)
    toe_heights = None
    if level:
        shift = _above(shift, at, ground, ground - flat)
        toe_heights = toes[..., 1] + shift[..., 1] - (ground - flat)[..., None, :]
    ankle = at["foot"] + shift

    sunk = root_positions - _sink(at, ankle, fps)
    hips = at["upper_leg"] + (sunk - root_positions)[..., None, :]
    rotations = rotations.clone()
    for joint, turn in _bent(legs, joints, points, world, hips, ankle, toe_heights).items():
        rotations[..., kept[joint], :, :] = turn
    return sunk, rotations


# -- where feet are to be ---------------------------------------------------------------------------


def _ground(toes: Tensor, held: Tensor, flat: Tensor, floor: float | None) -> Tensor:
    """Heights (..., 2) of resting toe joints: the plane of contact."""
    if floor is not None:
        return (flat + floor).expand(*toes.shape[:-3], 2)
    return _usual(toes[..., 1], held)[..., 0, :]


def _usual(values: Tensor, held: Tensor) -> Tensor:
    """Median (..., 1, 2) of values (..., frames, 2) while feet are held; 0 if they never are."""
    median = torch.where(held, values, torch.nan).nanmedian(-2, keepdim=True).values
    return torch.nan_to_num(median, nan=0.0)


def _onto_places(toes: Tensor, held: Tensor, ground: Tensor | None) -> Tensor:
    """How far toes are from their places (..., frames, 2, 3) while they are held, else 0.

    A place is where a toe joint is on average over one contact, on the ground; None: as high as it is.
    """
    number = numbered(held).mT[..., None, :]
    along = toes.movedim(-3, -1)  # frames last, as they lie in memory
    index = number.expand_as(along)
    none = along.new_zeros(*along.shape[:-1], along.shape[-1] + 1)
    sums = none.scatter_add(-1, index, along)
    counts = none[..., :1, :].scatter_add(-1, number, torch.ones_like(along[..., :1, :]))
    places = sums / counts.clamp(min=1)
    if ground is not None:
        places[..., 1, :] = ground[..., None]
    onto = (places.gather(-1, index) - along) * held.mT[..., None, :]
    if ground is None:
        onto[..., 1, :] = 0
    return onto.movedim(-1, -3)


def _shift(onto: Tensor, held: Tensor, blend: float) -> Tensor:
    """How far feet are to be moved (..., frames, 2, 3), also between contacts.

    There, what the last frame of one contact asks for fades out and what the first of the next one
    asks for fades in, each over `blend` frames.
    """
    since, until = distance(held, before=True), distance(held, before=False)
    last = held.shape[-2] - 1
    at = torch.arange(last + 1, device=held.device)[:, None]
    before = onto.gather(-3, (at - since).clamp(min=0)[..., None].expand_as(onto))
    after = onto.gather(-3, (at + until).clamp(max=last)[..., None].expand_as(onto))
    between = _fading(since, blend)[..., None] * before + _fading(until, blend)[..., None] * after
    return torch.where(held[..., None], onto, between)


def _fading(distance: Tensor, blend: float) -> Tensor:
    """From 1 at distance 0 to 0 at `blend` frames, level at both ends."""
    left = (1 - distance / max(blend, 1e-9)).clamp(0, 1)
    return left * left * (3 - 2 * left)


def _above(shift: Tensor, at: dict[str, Tensor], ground: Tensor, floor: Tensor) -> Tensor:
    """The shift, with feet lifted where they would be in the floor: ankles and toe joints."""
    toe = at["toes"][..., 1] + shift[..., 1] - ground[..., None, :]
    ankle = at["foot"][..., 1] + shift[..., 1] - floor[..., None, :]
    lift = -torch.minimum(toe, ankle).clamp(max=0)
    return shift + torch.stack([torch.zeros_like(lift), lift, torch.zeros_like(lift)], dim=-1)


def _sink(at: dict[str, Tensor], ankle: Tensor, fps: float) -> Tensor:
    """How far the root comes down (..., frames, 3) for both legs to reach their ankles."""
    down = _smoothed_over(_needed(at, ankle).amax(-1), SETTLE * fps)
    return torch.stack([torch.zeros_like(down), down, torch.zeros_like(down)], dim=-1)


def _needed(at: dict[str, Tensor], ankle: Tensor) -> Tensor:
    """How far a hip has to come down (..., frames, 2) for its leg to reach its ankle."""
    hip, knee, foot = (at[part] for part in PARTS[:3])
    longest = length(knee - hip) + length(foot - knee)
    stays = length(foot - hip).minimum(longest) - (length(ankle - foot) - NEAR).clamp(min=0)
    reach = torch.maximum(REACH * longest, stays)
    way = hip - ankle
    level = way[..., 0].square() + way[..., 2].square()
    needed = way[..., 1] - (reach.square() - level).clamp(min=1e-4).sqrt()
    return torch.where(needed > 1e-4, needed, 0)


def _smoothed_over(values: Tensor, sigma: float) -> Tensor:
    """A smooth curve (..., frames) that is nowhere below `values`."""
    if not values.any():
        return values
    reach = max(1, math.ceil(2 * sigma))
    rows = values.reshape(-1, 1, values.shape[-1])
    widest = max_pool1d(rows, 2 * reach + 1, stride=1, padding=reach)
    bell = torch.exp(-(torch.arange(-reach, reach + 1).to(values) / sigma).square() / 2)
    widened = pad(widest, (reach, reach), mode="replicate")
    return torch.conv1d(widened, (bell / bell.sum())[None, None]).reshape(values.shape)


# -- how legs get there -----------------------------------------------------------------------------


def _bent(
    skeleton: Skeleton, joints: dict, points: Tensor, world: Tensor,
    hips: Tensor, ankle: Tensor, toe_heights: Tensor | None,
) -> dict[int, Tensor]:  # fmt: skip
    """Local rotations of legs that reach their ankles, by joint; feet keep the way they point."""
    rotations = {}
    fronts = knee_fronts(skeleton, points, world)
    for i in range(2):
        upper, lower, foot, toes = (joints[part][i] for part in PARTS)
        knee_was = points[..., lower, :] - points[..., upper, :]
        shin_was = points[..., foot, :] - points[..., lower, :]
        reach = ankle[..., i, :] - hips[..., i, :]
        knee = _knee(knee_was, shin_was, reach, fronts[..., i, :])
        shin = reach - knee
        # the smallest turns of the bones as they were, so that no bone is twisted
        turned = {
            upper: product(shortest_turn(knee_was, knee), world[..., upper, :, :]),
            lower: product(shortest_turn(shin_was, shin), world[..., lower, :, :]),
            foot: world[..., foot, :, :],
        }
        a_joint = foot != toes < skeleton.joints  # not the end of the foot
        if a_joint and toe_heights is not None:
            turned[toes] = _toes_up(skeleton, toes, world, toe_heights[..., i])
        for joint, whole in turned.items():
            above = _carried(skeleton, skeleton.parents[joint], turned, world)
            rotations[joint] = product(above.mT, whole)
    return rotations


def _carried(skeleton: Skeleton, joint: int, turned: dict[int, Tensor], world: Tensor) -> Tensor:
    """World orientation of a joint that goes along with the nearest one above it that was turned.

    Some rigs have joints between those of a leg, which spread its twist.
    """
    above = joint
    while above >= 0 and above not in turned:
        above = skeleton.parents[above]
    if above < 0 or above == joint:
        return turned.get(joint, world[..., joint, :, :])
    stays = product(world[..., above, :, :].mT, world[..., joint, :, :])
    return product(turned[above], stays)


def _toes_up(skeleton: Skeleton, toes: int, world: Tensor, heights: Tensor) -> Tensor:
    """World orientation of toes, pitched up where their tip would be in the floor.

    heights : (..., frames) metres of the toe joint above the floor.
    """
    ends = zip(skeleton.end_parents, skeleton.end_offsets, strict=True)
    tip = next((offset for parent, offset in ends if parent == toes), torch.zeros(3))
    was = world[..., toes, :, :]
    return off_the_floor(was.reshape(-1, 3, 3), heights.reshape(-1), tip.to(was)).reshape(was.shape)


def _knee(knee_was: Tensor, shin_was: Tensor, reach: Tensor, front: Tensor) -> Tensor:
    """Where a knee is (..., 3), seen from the hip, once its ankle is at `reach` (..., 3).

    It stays in the plane in which it was bent, as that plane turns with the line from hip to ankle:
    a leg whose ankle is where it was keeps its knee, be it bent backwards or folded up.
    `two_bone`, which stays a little short of straight, would move that of a straight leg.
    """
    thigh, shank = (length(bone, keepdim=True) for bone in (knee_was, shin_was))
    distance = length(reach, keepdim=True).clamp(min=1e-9)
    # law of cosines: how far down the line and how far beside it; a leg out of reach is straight
    along = (thigh**2 + distance**2 - shank**2) / (2 * distance)
    along = torch.minimum(torch.maximum(along, -thigh), thigh)
    beside = (thigh**2 - along**2).clamp(min=0).sqrt()

    line_was, line = unit(knee_was + shin_was), unit(reach)
    aside = knee_was - dot(knee_was, line_was, keepdim=True) * line_was
    aside = dot(shortest_turn(line_was, line), aside[..., None, :])
    return along * line + beside * _aside(aside, beside, line, front)


def _aside(was: Tensor, beside: Tensor, line: Tensor, front: Tensor) -> Tensor:
    """Which way from the line from hip to ankle a knee lies (..., 3), one long.

    As it `was`; but a leg that was nearly straight or bent a little backwards, whose knee is to come
    out farther, says little or wrong of where to: so far as it comes out, its front says it.
    """
    out = length(was, keepdim=True)
    front = unit(front - dot(front, line, keepdim=True) * line)
    backwards = dot(was, front, keepdim=True) < 0
    share = (2 - out / torch.where(backwards, BACKWARDS, STRAIGHT)).clamp(0, 1)
    return unit(was + share * 3 * (beside - out).clamp(min=1e-7) * front)


def _picked(rotations: Tensor, joints: list[int]) -> Tensor:
    """Rotations (..., frames, joints, 3, 3) of some joints, the frames side by side in memory.

    So `forward_kinematics` wants them, and brings them there in twice the time.
    """
    rows = [9 * joint + i for joint in joints for i in range(9)]
    flat = rotations.reshape(-1, rotations.shape[-3] * 9).T
    picked = flat.index_select(0, torch.tensor(rows, device=flat.device))
    return picked.T.reshape(*rotations.shape[:-3], len(joints), 3, 3)


def _forward(skeleton: Skeleton, root_positions: Tensor, rotations: Tensor):
    """Points (..., frames, points, 3) and world orientations (..., frames, joints, 3, 3)."""
    return forward_kinematics(
        skeleton.parents, skeleton.offsets.to(rotations), root_positions, rotations,
        skeleton.end_parents, skeleton.end_offsets.to(rotations),
    )  # fmt: skip


def _checked(contacts, root_positions: Tensor, floor, blend, deepest) -> Tensor:
    """Contacts (..., frames, 2) of the toes; raises ModelError."""
    contacts = torch.as_tensor(contacts, device=root_positions.device)
    shape = tuple(contacts.shape)
    if contacts.dtype != torch.bool or shape not in [
        (*root_positions.shape[:-1], n) for n in (2, 4)
    ]:
        raise ModelError(
            f"lock_feet: contacts are {contacts.dtype} of shape {shape}; they must be bool, "
            f"{(*root_positions.shape[:-1], 2)} for both toes (or 4 with the heels)."
        )
    if not 0 <= blend < math.inf or not (floor is None or math.isfinite(floor)):
        raise ModelError(
            f"lock_feet: blend {blend} s, floor {floor} m; both must be numbers, blend from 0."
        )
    if not deepest >= 0:
        raise ModelError(f"lock_feet: deepest is {deepest} m; it must be 0 or more.")
    return contacts if shape[-1] == 2 else contacts[..., [1, 3]]
