"""PFNN given the same commands as ours: its trajectory to come bends towards what is asked.

As in its authors' demonstration: the way ahead is blended from the one that the character is on to the
one that is asked, and the gait is told: stand, walk, or jog from 2 m/s on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch

from motionlab import Motion
from motionlab.models.pfnn.following import _JOG, _motion
from motionlab.models.pfnn.layout import GAITS
from motionlab.models.pfnn.network import Pfnn
from motionlab.models.pfnn.walk import Frame, begin, lead, step
from motionlab.paths import upright
from motionlab.solvers.live_aim import STILL
from motionlab.solvers.live_going import wrapped

BLEND = 0.25  # seconds in which the way ahead has come to what is asked, but for a third
CHANGE = 0.2  # seconds in which gait and speed have


@torch.no_grad()
def steered(network: Pfnn, commands: Sequence[tuple], seconds: float) -> Motion:
    """A character who obeys commands (second, m/s or None, degrees or None) for some seconds."""
    its, waiting = network.layout, list(commands)
    speed, direction, pace = 0.0, 0.0, float(commands[0][1])
    ahead = torch.arange(1, its.reach) / its.fps
    walk = begin(network, torch.zeros(1, 3), torch.tensor([[0.0, 0.0, 1.0]]))
    gaits, frames = _gait(network, pace), []
    for frame in range(round(seconds * its.fps)):
        while waiting and waiting[0][0] * its.fps <= frame:
            _, new, degrees = waiting.pop(0)
            speed = speed if new is None else new
            direction = direction if degrees is None else math.radians(degrees)
        share = min(1.0, 1 / (CHANGE * its.fps))
        pace += share * (speed - pace)
        gaits = torch.lerp(gaits, _gait(network, speed), share)
        root, yaw = walk.root
        off = wrapped(direction - yaw)
        way = yaw + off * (1 - (-ahead / BLEND).exp())
        ways = torch.stack([way.sin(), way.cos()], -1)[None]
        places = root[:, None, [0, 2]] + (ways * (pace / its.fps)).cumsum(1)
        walk = lead(walk, upright(places), upright(ways))
        shown, walk = step(network, walk, gaits)
        frames.append(shown)
    whole = Frame(*(torch.stack(parts, 1)[0] for parts in zip(*frames, strict=True)))
    return _motion(network, whole)


def _gait(network: Pfnn, speed: float) -> torch.Tensor:
    weights = torch.zeros(1, network.layout.gaits)
    if network.layout.gaits:
        name = "stand" if speed < STILL else "jog" if speed >= _JOG else "walk"
        weights[0, GAITS.index(name)] = 1
    return weights
