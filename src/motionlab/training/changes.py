"""Moments of a motion at which it has just begun to change: a gait to another one, or its heading.

A change is told from positions alone, by how fast the root goes to where the body faces and by
where it faces, in the second before a moment and in the two seconds after it::

    for name, share in changing(points, skeleton, 30.0).items():  # "walk to run", "turn left 90°"
        moments = share.isfinite().nonzero()

It has begun and no more: of the whole change the second before the moment holds a share within
`BEGUN`. Who has seen that second can know of it, and has some of it before him.
"""

from __future__ import annotations

import torch
from torch import Tensor

from ..metrics import facing
from ..skeleton import Skeleton

SEEN, AHEAD = 1.0, 2.0  # seconds that must lie before a moment, and after it
BEGUN = (0.2, 0.75)
GAITS = {"stand": (-0.15, 0.15), "walk": (0.5, 1.8), "run": (1.8, 9.0)}  # m/s ahead
CHANGES = (("stand", "walk"), ("walk", "run"), ("run", "walk"))
LEAST = 0.5  # m/s from one gait to the other
ANGLES = (90, -90, 180, -180)  # degrees to the left
NEAR = 15  # degrees by which a turn may differ from its name
BEND = 60  # degrees that the body may turn while its gait changes
STEADY = 15  # degrees that the body may turn in half a second before a turn, and after it
NAMES = (
    *(f"{first} to {then}" for first, then in CHANGES),
    *(f"turn {'left' if angle > 0 else 'right'} {abs(angle)}°" for angle in ANGLES),
)


def changing(points: Tensor, skeleton: Skeleton, fps: float) -> dict[str, Tensor]:
    """For each of `NAMES`, where it has begun, the share (frames,) that has been seen; elsewhere NaN.

    points : (frames, points, 3) in metres, of any length; a moment is the first frame not seen.
    """
    moments = torch.arange(len(points))[round(SEEN * fps) : -round(AHEAD * fps)]
    found = [_gaits(points, skeleton, fps, moments), _turns(points, skeleton, fps, moments)]
    whole = {}
    for name, share in (found[0] | found[1]).items():
        whole[name] = torch.full((len(points),), torch.nan, dtype=torch.float64)
        whole[name][moments] = share
    return whole


def _gaits(points: Tensor, skeleton: Skeleton, fps: float, moments: Tensor) -> dict[str, Tensor]:
    """From 1 to 1/2 s before a moment one gait; from 1/2 to 1 and from 1 to 3/2 s after it the other.

    Where it is on its way is told by the last 0.3 s.
    """
    root, yaw = points[:, 0, [0, 2]].double(), _heading(points, skeleton)

    def ahead(start: float, stop: float) -> Tensor:
        """Metres a second (moments,) to where the body faces in the middle of the span."""
        a, b = _span(moments, fps, start, stop)
        way = yaw[(a + b) // 2]
        metres = ((root[b] - root[a]) * torch.stack([way.sin(), way.cos()], dim=-1)).sum(-1)
        return metres * fps / (b - a)

    before, now, soon, later = ahead(-1, -0.5), ahead(-0.3, 0), ahead(0.5, 1), ahead(1, 1.5)
    size = (soon + later) / 2 - before
    share = (now - before) / size
    begun = _begun(share) & (size.abs() >= LEAST)
    begun &= _turned(yaw, moments, fps, -1, 1.5).abs() < BEND
    found = {}
    for name, (first, then) in zip(NAMES, CHANGES, strict=False):
        (low, high), (least, most) = GAITS[first], GAITS[then]
        is_so = begun & (low <= before) & (before < high)
        for speed in (soon, later):
            is_so &= (least <= speed) & (speed < most)
        found[name] = share.where(is_so, torch.nan)
    return found


def _turns(points: Tensor, skeleton: Skeleton, fps: float, moments: Tensor) -> dict[str, Tensor]:
    """From 1/2 s before a moment to 3/2 s after it; steady in the half second before and after."""
    yaw = _heading(points, skeleton)
    turned = lambda start, stop: _turned(yaw, moments, fps, start, stop)
    whole = turned(-0.5, 1.5)
    share = turned(-0.5, 0) / whole
    begun = _begun(share)
    begun &= (turned(-1, -0.5).abs() < STEADY) & (turned(1.5, 2).abs() < STEADY)
    found = {}
    for name, angle in zip(NAMES[len(CHANGES) :], ANGLES, strict=True):
        found[name] = share.where(begun & ((whole - angle).abs() < NEAR), torch.nan)
    return found


def _begun(share: Tensor) -> Tensor:
    return (share >= BEGUN[0]) & (share <= BEGUN[1])


def _heading(points: Tensor, skeleton: Skeleton) -> Tensor:
    """Radians (frames,) to the left of +z, without jumps."""
    yaw = facing(points.double(), skeleton)
    step = yaw.diff()
    return torch.cat([yaw[:1], yaw[:1] + torch.atan2(step.sin(), step.cos()).cumsum(0)])


def _turned(yaw: Tensor, moments: Tensor, fps: float, start: float, stop: float) -> Tensor:
    """Degrees (moments,) to the left, from and to seconds after each moment."""
    a, b = _span(moments, fps, start, stop)
    return (yaw[b] - yaw[a]).rad2deg()


def _span(moments: Tensor, fps: float, start: float, stop: float) -> tuple[Tensor, Tensor]:
    return moments + round(start * fps), moments + round(stop * fps)
