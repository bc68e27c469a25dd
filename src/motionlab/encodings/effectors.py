"""The body around its root; hands, toes and head, and how they move."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from torch import Tensor

from ..errors import EncodingError
from ..kinematics import forward_kinematics
from ..skeleton import Skeleton
from .path import turned

Array = TypeVar("Array", Tensor, np.ndarray)


def body_points(
    skeleton: Skeleton, rotations: Tensor, root_positions: Tensor | None = None
) -> Tensor:
    """Points (..., points, 3) of local rotations (..., joints, 3, 3), by default around the root.

    The root's place in the world, which may be far away, would cost the points' precision.
    """
    if root_positions is None:
        root_positions = rotations.new_zeros(*rotations.shape[:-3], 3)
    return forward_kinematics(
        skeleton.parents,
        skeleton.offsets,
        root_positions,
        rotations,
        skeleton.end_parents,
        skeleton.end_offsets,
    )[0]


def effector_joints(skeleton: Skeleton) -> dict[str, int]:
    """Joint of each end effector by its role: toes (feet where there are none), hands, head."""
    found = {}
    for role in ("left_toes", "right_toes", "left_hand", "right_hand", "head"):
        instead = role.replace("toes", "foot")
        role = role if role in skeleton.roles else instead
        if role not in skeleton.roles:
            raise EncodingError(
                f"{skeleton!r} has no joint that reads like {role.replace('_', ' ')}, so its end "
                f"effectors are not known. Joints: {', '.join(skeleton.names)}."
            )
        found[role] = skeleton.roles[role]
    return found


class Chains(NamedTuple):
    """The bones from the root to each end effector, all chains beside each other.

    joints : their numbers in the body, the root first. levels : for each step away from the root, which
    of these joints turns what is beyond it, an index an effector. offsets : (levels + 1, effectors, 3)
    metres, from there to the next joint; a chain that has ended has no offset any more, so that it does
    not matter which joint turns it.
    """

    joints: list[int]
    levels: list[list[int]]
    offsets: Tensor


@lru_cache(maxsize=64)
def effector_chains(skeleton: Skeleton) -> Chains:
    """Those of hands, toes and head; raises EncodingError as `effector_joints` does."""
    chains = []  # from the root to an end effector, without it: it carries nothing
    ends = [*effector_joints(skeleton).values()]
    for joint in ends:
        chain: list[int] = []
        while (joint := skeleton.parents[joint]) >= 0:
            chain.insert(0, joint)
        chains.append(chain)
    joints = sorted({0}.union(*chains))
    levels = [[0] * len(ends) for _ in range(max(map(len, chains)))]
    with torch.inference_mode(False):  # made while sampling, it must serve when training
        offsets = torch.zeros(len(levels) + 1, len(ends), 3)
        for i, (chain, end) in enumerate(zip(chains, ends, strict=True)):
            for level, joint in enumerate(chain):
                levels[level][i] = joints.index(joint)
            for level, joint in enumerate([*chain[1:], end], start=1):
                offsets[level, i] = skeleton.offsets[joint]
    return Chains(joints, levels, offsets)


def chain_ends(local: Array, levels: Sequence[Sequence[int]], offsets: Array) -> Array:
    """End effectors (effectors, 3, batch), metres from the root.

    From the tips to the root: a point is turned by one joint after the other. That is a third of the
    multiplications of forward kinematics, which must know how every joint lies in the world. It asks
    for nothing but what tensors and arrays both know: single frames are calculated in numpy.

    local : (joints, 3, 3, batch), rotations of `Chains.joints` relative to their parents.
    levels, offsets : of `Chains`, the offsets an array if the rotations are one.
    """
    ends = offsets[-1][..., None]
    for level in reversed(range(len(levels))):
        ends = (local[levels[level]] * ends[:, None]).sum(2) + offsets[level][..., None]
    return ends


def moving(points: Tensor, steps: Tensor, fps: float, facing: Tensor | None = None) -> Tensor:
    """Points and their velocities over the ground, from frame to frame.

    Velocities need no path: the points of frame t-1 are brought into the frame of t by the step
    between the two, so nothing is summed up and any window of features will do.

    Parameters
    ----------
    points : (..., frames, points, 3) metres, seen from the ground below the root.
    steps : (..., frames, 3), how that place moved and turned, as `path.steps_between` gives it.
    fps : frames per second.
    facing : (..., frames) radians, yaw of the heading as seen there; None if it is zero.

    Returns
    -------
    (..., frames, points, 6), positions (m) and velocities (m/s) in the heading frame of their
    frame; the velocity of row 0 repeats that of row 1, and is zero if there is no row 1.
    """
    x, z, turn = steps[..., 1:, None, :].unbind(-1)
    move = torch.stack([x, torch.zeros_like(x), z], dim=-1)
    before = turned(points[..., :-1, :, :] - move, -turn)
    velocities = fps * (points[..., 1:, :, :] - before)
    if facing is not None:
        points = turned(points, -facing[..., None])
        velocities = turned(velocities, -facing[..., 1:, None])
    first = velocities[..., :1, :, :] if points.shape[-3] > 1 else torch.zeros_like(points)
    return torch.cat([points, torch.cat([first, velocities], dim=-3)], dim=-1)
