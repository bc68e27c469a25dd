"""How a PFNN goes on from recorded motion: straight ahead, at the pace of the last second.

It has no memory to be warmed: it takes over the trajectory of the last second, the last frame, and of many
phases that whose first frame fits best. Then it is led, as a player would lead it.
"""

from __future__ import annotations

import math

import torch
from scipy.ndimage import gaussian_filter1d
from torch import Tensor, nn

from motionlab.metrics import facing
from motionlab.models.pfnn.following import _motion
from motionlab.models.pfnn.walk import Frame, Walk, lead, step
from motionlab.paths import upright

from .begun import Begun
from .going_on import GoOn, pace

PHASES = 36
SMOOTH = 1 / 3  # seconds, as in training: the way a body faces without the swing of its hips


def led(network: nn.Module) -> GoOn:
    """A PFNN that is led straight on."""

    @torch.no_grad()
    def go_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
        its, shown = network.layout, []
        speed, way = pace(begun)
        strides = upright(way) * (speed / its.fps)[:, None]
        walk = in_phase(network, taken_over(network, begun, strides))
        ways = walk.directions[:, -1:].expand(-1, its.reach - 1, -1)
        ahead = torch.arange(1, its.reach)[:, None] * strides[:, None]
        gaits = torch.zeros(len(begun), its.gaits)
        for _ in range(frames):
            walk = lead(walk, walk.root[0][:, None] + ahead, ways)
            frame, walk = step(network, walk, gaits)
            shown.append(frame)
        whole = Frame(*(torch.stack(parts, 1) for parts in zip(*shown, strict=True)))
        motions = [_motion(network, Frame(*(part[i] for part in whole))) for i in range(len(begun))]
        return torch.stack([motion.positions()[:, : its.skeleton.joints] for motion in motions])

    return go_on


def taken_over(network: nn.Module, begun: Begun, strides: Tensor) -> Walk:
    """The walk of somebody who goes on as he went; strides (starts, 3) are of a frame."""
    its, points = network.layout, begun.points
    root = upright(points[:, :, 0][..., [0, 2]])
    yaw = facing(points, begun.encoding.skeleton)
    smooth = gaussian_filter1d(
        torch.stack([yaw.sin(), yaw.cos()], -1).numpy(), SMOOTH * its.fps, axis=1, mode="nearest"
    )
    ways = torch.nn.functional.normalize(upright(torch.from_numpy(smooth)), dim=-1)
    ahead = torch.arange(1, its.reach + 1)[:, None] * strides[:, None]
    return Walk(
        torch.cat([root[:, -its.reach :], root[:, -1:] + ahead], 1).float(),
        torch.cat([ways[:, -its.reach :], ways[:, -1:].expand(-1, its.reach, -1)], 1).float(),
        points[:, -1].float(), (points[:, -1] - points[:, -2]).float(), torch.zeros(len(begun)),
    )  # fmt: skip


def in_phase(network: nn.Module, walk: Walk) -> Walk:
    """The same, of `PHASES` in the one whose next frame is nearest to where the joints are going."""
    count = len(walk.phase)
    many = Walk(*(part.repeat_interleave(PHASES, 0) for part in walk))
    phases = (torch.arange(PHASES) * (2 * math.pi / PHASES)).repeat(count)
    gaits = torch.zeros(len(phases), network.layout.gaits)
    frame, _ = step(network, many._replace(phase=phases), gaits)
    off = (frame.joints - many.joints - many.velocities).square().sum((-1, -2))
    best = off.view(count, PHASES).argmin(1)
    return walk._replace(phase=phases.view(count, PHASES)[torch.arange(count), best])
