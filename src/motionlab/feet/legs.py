"""The legs of any rig: which joints they are, which way knees point, how high toes are on a floor.

How a rig draws the axes of its joints, and how it poses at rest, says nothing of its legs unless
the rest pose is a person who stands. Else the motion tells: a shank bends away from where its knee
points, and the knee of a leg that stays straight points where the hips face.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import torch
from torch import Tensor

from ..errors import SkeletonError
from ..ik.turns import dot, length, unit
from ..roles import SIDES
from ..skeleton import Skeleton
from .contacts import foot_points, rest_heights, stands_on_floor

PARTS = ("upper_leg", "lower_leg", "foot", "toes")
_BONE = 0.01  # metres; a shorter thigh or shank is none
_STRAIGHT = 0.05  # sine of the bend that says as much of a knee's front as the hips do
_DOUBT = 0.5  # of 1: how much less the hips agree with the rest pose than with themselves
# Heights of a flat foot's ankle and toe joint in lengths of the leg, those of the canonical body.
_ANKLE, _TOE = 0.125, 0.0314


def leg_joints(skeleton: Skeleton) -> dict[str, list[int]]:
    """Joints of both legs, left first: {part: [left, right]}; toes as `contacts.foot_points`.

    Raises
    ------
    SkeletonError : a joint is missing, or does not hang on the one above it.
    """
    joints = {part: [skeleton.role(f"{side}_{part}") for side in SIDES] for part in PARTS[:3]}
    for side in SIDES:
        parts = [part for part in PARTS if f"{side}_{part}" in skeleton.roles]
        for part, child in pairwise(parts):
            if skeleton.below(f"{side}_{part}", f"{side}_{child}") is None:
                raise _no_bone(skeleton, side, part, child)
    if 0 in joints["upper_leg"]:
        raise SkeletonError(
            f"The root of this skeleton, {skeleton.names[0]}, is an upper leg: both legs must hang "
            "on hips. Say which joints they are with read_bvh(path, roles={'hips': 'NAME'})."
        )
    return joints | {"toes": [foot_points(skeleton)[1], foot_points(skeleton)[3]]}


@lru_cache(maxsize=16)
def legs_alone(skeleton: Skeleton) -> tuple[Skeleton, list[int]]:
    """The legs, with what they hang on and their toes' tips, and which joints of the whole these are.

    Where legs are does not hang on arms: to leave these out is to save half the kinematics.
    """
    joints, toes = leg_joints(skeleton), foot_points(skeleton)
    kept = {joint for joint, above in enumerate(skeleton.parents) if above in toes}
    for point in toes:
        while point >= 0:
            kept.add(point)
            point = skeleton.point_parents[point]
    kept = sorted(joint for joint in kept if joint < skeleton.joints)
    number = {joint: i for i, joint in enumerate(kept)} | {-1: -1}
    ends = [i for i, above in enumerate(skeleton.end_parents) if above in toes + joints["foot"]]
    legs = Skeleton(
        tuple(skeleton.names[joint] for joint in kept),
        tuple(number[skeleton.parents[joint]] for joint in kept),
        skeleton.offsets[kept],
        tuple(number[skeleton.end_parents[i]] for i in ends),
        skeleton.end_offsets[ends],
        roles={
            role: skeleton.names[skeleton.roles[role]] if role in skeleton.roles else ""
            for role in (f"{side}_{part}" for side in SIDES for part in PARTS)
        },
    )
    return legs, kept


def leg_lengths(skeleton: Skeleton, points: Tensor) -> Tensor:
    """Lengths (2, 2) in metres of thigh and shank, each left first, as they are in motion.

    At rest a joint between may fold them.

    Parameters
    ----------
    points : (..., frames, points, 3) metres.

    Raises
    ------
    SkeletonError : one is shorter than 1 cm.
    """
    joints = leg_joints(skeleton)
    lengths = []
    for part, child in pairwise(PARTS[:3]):
        bones = length(points[..., joints[child], :] - points[..., joints[part], :])
        lengths.append(bones.reshape(-1, 2).median(dim=0).values)
        for side, short in zip(SIDES, (lengths[-1] < _BONE).tolist(), strict=True):
            if short:
                raise _no_bone(skeleton, side, part, child)
    return torch.stack(lengths)


def _no_bone(skeleton: Skeleton, side: str, part: str, child: str) -> SkeletonError:
    names = (skeleton.names[skeleton.roles[f"{side}_{p}"]] for p in (part, child))
    return SkeletonError(
        f"The {side} leg of this skeleton has no bone from {part} to {child} "
        f"({' and '.join(names)}): the one must hang on the other, and thigh and shank be 1 cm long "
        f"at least. Say which joints they are with read_bvh(path, roles={{'{side}_{child}': "
        "'NAME'})."
    )


def knee_fronts(skeleton: Skeleton, points: Tensor, world: Tensor) -> Tensor:
    """Which way both knees point (..., frames, 2, 3), left first, were their legs straight.

    Arguments as of `knee_front`.
    """
    thighs = world[..., leg_joints(skeleton)["upper_leg"], :, :]
    return dot(thighs, knee_front(skeleton, points, world)[..., None, :])


def knee_front(skeleton: Skeleton, points: Tensor, world: Tensor) -> Tensor:
    """The same in the frames of the thighs, where it is one direction (..., 1, 2, 3) for a motion.

    If the rest pose stands, and hips face that way in the motion, it is where the hips face at
    rest; else the motion's.

    Parameters
    ----------
    points : (..., frames, points, 3) metres.
    world : (..., frames, joints, 3, 3), world orientations.
    """
    joints = leg_joints(skeleton)
    thighs = world[..., joints["upper_leg"], :, :]
    hips, knees, ankles = (points[..., joints[part], :] for part in PARTS[:3])
    ahead = _facing(hips, ankles)
    mean = _in_frames(thighs, ahead).mean(-3, keepdim=True)
    front = front_at_rest(skeleton)
    if front is None:
        sure = mean.new_zeros(mean.shape[:-1], dtype=torch.bool)
        front = torch.zeros_like(mean)
    else:
        front = front.to(points)
        doubt = mean.norm(dim=-1) - dot(mean, front)
        sure = (doubt < _DOUBT).all(-1, keepdim=True)  # a rest pose wrong of one leg is no witness
    if not sure.all():
        bent = _bends(hips, knees, ankles)
        # who bends backwards is a broken figure, and no other rig
        bent = bent * (dot(bent, ahead, keepdim=True) > 0)
        seen = unit(_in_frames(thighs, bent + _STRAIGHT * ahead).mean(-3, keepdim=True))
        front = torch.where(sure[..., None], front, seen)
    return front


def flat_toes(skeleton: Skeleton, points: Tensor, held: Tensor) -> Tensor:
    """Heights (2,) or (..., 2) in metres of both toes above the floor when their feet stand flat.

    Those of the rest pose if it stands on the floor y = 0. Else as on the canonical body, for legs
    of this length; or more, where the toes' tips lie lower while they are held.

    Parameters
    ----------
    points : (..., frames, points, 3) metres.
    held : bool (..., frames, 2), where toes rest on the floor.
    """
    if stands_on_floor(skeleton):
        heights = rest_heights(skeleton).to(points)
        return heights[[1, 3]] - heights.amin().clamp(max=0)
    joints, legs = leg_joints(skeleton), leg_lengths(skeleton, points).sum(0)
    found = []
    for i, (foot, toe) in enumerate(zip(joints["foot"], joints["toes"], strict=True)):
        tips = [toe] + [point for point, above in enumerate(skeleton.point_parents) if above == toe]
        drop = points[..., toe, 1] - points[..., tips, 1].amin(-1)
        drop = torch.where(held[..., i], drop, torch.nan).nanmedian(-1).values.nan_to_num(0.0)
        found.append(torch.maximum(drop, (_ANKLE if toe == foot else _TOE) * legs[i]))
    return torch.stack(found, -1)


def front_at_rest(skeleton: Skeleton) -> Tensor | None:
    """Where the hips face (2, 3), by the left and by the right leg; None if they don't stand."""
    joints, rest = leg_joints(skeleton), skeleton.rest_points
    hips, knees, ankles = (rest[joints[part]] for part in PARTS[:3])
    if (unit(hips - ankles)[:, 1] < 0.9).any() or (unit(hips - knees)[:, 1] < 0.85).any():
        return None
    front = _facing(hips, ankles)
    return None if (front.norm(dim=-1) < 0.5).any() else unit(front)


def _facing(hips: Tensor, ankles: Tensor) -> Tensor:
    """At right angles to the hips and to each leg (..., 2, 3); less than 1 long in a split."""
    across = hips[..., :1, :] - hips[..., 1:, :]
    return torch.linalg.cross(unit(across).expand_as(hips), unit(hips - ankles))


def _in_frames(frames: Tensor, vectors: Tensor) -> Tensor:
    """Vectors (..., 3) of the world in frames (..., 3, 3)."""
    return dot(frames.mT, vectors[..., None, :])


def _bends(hips: Tensor, knees: Tensor, ankles: Tensor) -> Tensor:
    """Out of the knees (..., 2, 3), at right angles to thighs, as long as the sine of the bend."""
    thigh, shank = unit(knees - hips), unit(ankles - knees)
    return dot(shank, thigh, keepdim=True) * thigh - shank
