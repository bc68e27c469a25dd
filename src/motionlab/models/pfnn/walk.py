"""A character driven by a PFNN, frame after frame.

Holden, Komura and Saito (2017), *Phase-Functioned Neural Networks for Character Control*, *Runtime*,
and the code of their demonstration, `pfnn.cpp`, without what that corrects after the network: no
inverse kinematics holds the feet. `solvers.lock_feet` does, afterwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from ...encodings.path import turned
from ...kinematics import yaw_matrix
from ...paths import flat, upright
from .layout import join, split
from .network import Pfnn

_BLEND = 0.5  # share of the predicted joints; the rest are the old ones, moved by their velocities


class Walk(NamedTuple):
    """All that goes on from frame to frame; the present is in the middle of a trajectory.

    places, directions : (batch, 2 reach, 3) metres on the ground, and of length 1.
    joints, velocities : (batch, J, 3) of the frame before, metres and metres a frame, in the world.
    phase : (batch,) radians.
    """

    places: Tensor
    directions: Tensor
    joints: Tensor
    velocities: Tensor
    phase: Tensor

    @property
    def root(self) -> tuple[Tensor, Tensor]:
        """Where the root is (batch, 3), and its yaw (batch,) in radians."""
        now = self.places.shape[1] // 2
        return self.places[:, now], yaw_of(self.directions[:, now])


class Frame(NamedTuple):
    """What a step shows.

    joints : (batch, J, 3) metres in the world; rotations : (batch, J, 3, 3) from there to the joint;
    contacts : (batch, 4), near 1 where a foot rests: left heel, left toe, right heel, right toe.
    """

    joints: Tensor
    rotations: Tensor
    contacts: Tensor


def begin(network: Pfnn, places: Tensor, directions: Tensor) -> Walk:
    """The mean pose, at phase 0, at places (batch, 3), having stood there, facing (batch, 3)."""
    its = network.layout
    mean = split(its.said, network.said.mean.expand(len(places), -1))
    facing = yaw_of(directions)[:, None]
    repeated = lambda rows: rows[:, None].expand(-1, 2 * its.reach, -1)
    return Walk(
        repeated(places), repeated(directions),
        turned(mean["joints"], facing) + places[:, None], turned(mean["velocities"], facing),
        torch.zeros(len(places)),
    )  # fmt: skip


def lead(walk: Walk, places: Tensor, directions: Tensor) -> Walk:
    """The same with another trajectory to come: (batch, reach - 1, 3) each, the next frame first."""
    upto = slice(None, walk.places.shape[1] - places.shape[1])
    return walk._replace(
        places=torch.cat([walk.places[:, upto], places], dim=1),
        directions=torch.cat([walk.directions[:, upto], directions], dim=1),
    )


def step(network: Pfnn, walk: Walk, gaits: Tensor) -> tuple[Frame, Walk]:
    """One frame more.

    gaits : (batch, gaits) weights of the gaits over the whole trajectory.
    """
    its = network.layout
    said = split(its.said, network(seen(network, walk, gaits), walk.phase))
    place, yaw = walk.root
    joints = turned(said["joints"], yaw[:, None]) + place[:, None]
    velocities = turned(said["velocities"], yaw[:, None])
    joints = torch.lerp(walk.joints + velocities, joints, _BLEND)
    rotations = yaw_matrix(yaw)[:, None] @ _rotation(said["rotations"])

    # who stands neither moves on nor, but for a tenth, through the stride
    going = (1 - gaits[:, :1].sum(-1)).clamp(min=0) ** 0.25
    place = place + turned(upright(going[:, None] * said["step"]), yaw)
    yaw = yaw - going * said["turn"][:, 0]
    phase = walk.phase + (0.9 * going + 0.1) * 2 * math.pi * said["phase"][:, 0]
    past = slice(1, its.reach + 1)
    after = Walk(
        torch.cat([walk.places[:, past], _ahead(network, said["places"], yaw, place)], dim=1),
        torch.cat([walk.directions[:, past], _ahead(network, said["directions"], yaw)], dim=1),
        joints, velocities, phase % (2 * math.pi),
    )  # fmt: skip
    # the present is where the step leads, whatever was said of the trajectory
    after.places[:, its.reach] = place
    after.directions[:, its.reach] = upright(torch.stack([yaw.sin(), yaw.cos()], dim=-1))
    return Frame(joints, rotations, said["contacts"]), after


def seen(network: Pfnn, walk: Walk, gaits: Tensor) -> Tensor:
    """What the network sees (batch, inputs) of a walk on flat ground."""
    its = network.layout
    place, yaw = walk.root
    some = slice(None, None, its.stride)
    places = turned(walk.places[:, some] - place[:, None], -yaw[:, None])
    last = slice(its.reach - 1, its.reach)
    before, yaw_before = walk.places[:, last], yaw_of(walk.directions[:, last])
    values = {
        "places": flat(places).mT,
        "directions": flat(turned(walk.directions[:, some], -yaw[:, None])).mT,
        "gaits": gaits[..., None].expand(-1, -1, its.points),
        "joints": turned(walk.joints - before, -yaw_before),
        "velocities": turned(walk.velocities, -yaw_before),
        "grounds": place.new_zeros(len(place), *its.seen["grounds"]),
    }
    return join(its.seen, values)


def yaw_of(directions: Tensor) -> Tensor:
    """Yaw (...) in radians of directions (..., 3) on the ground, from +z towards +x."""
    return torch.atan2(directions[..., 0], directions[..., 2])


def _ahead(network: Pfnn, said: Tensor, yaw: Tensor, place: Tensor | None = None) -> Tensor:
    """Points (batch, 2, N / 2) of the next root's frame as frames (batch, reach, 3) of the world.

    Between them lie straight lines; after the last one the trajectory holds still, as it does in the
    published code: whoever leads the character says better. Without a place they are directions.
    """
    its = network.layout
    frames = torch.arange(its.reach, dtype=said.dtype) / its.stride
    first = frames.floor().long()
    last = said.shape[-1] - 1
    ends = said[..., first], said[..., (first + 1).clamp(max=last)]
    points = turned(upright(torch.lerp(*ends, frames - first).mT), yaw[:, None])
    if place is None:
        return torch.nn.functional.normalize(points, dim=-1)
    return points + place[:, None]


def _rotation(half: Tensor) -> Tensor:
    """Rotations (..., 3, 3) of logarithms of quaternions (..., 3)."""
    import roma  # loads torch's compiler, which takes as long as the rest of torch

    return roma.rotvec_to_rotmat(2 * half)
