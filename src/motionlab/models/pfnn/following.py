"""Characters driven by a PFNN are led along paths: the comparison of RNN-GAN's table 1 and figure 12."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor
from tqdm import tqdm

from ...errors import ModelError
from ...motion import Motion
from ...paths import Curves, Path, flat, upright
from .layout import GAITS
from .network import Pfnn
from .walk import Frame, begin, lead, step

_DOWN = 0.5  # a foot for which the network says more is in contact
_JOG = 2.0  # metres a second from which on one does not walk


@torch.no_grad()
def follow(
    network: Pfnn,
    paths: Sequence[Tensor],
    speed: float | Sequence[float],
    *,
    seconds: float | None = None,
    gait: str | None = None,
) -> list[Motion]:
    """Characters that are led along paths at a speed, all of them at once.

    In each frame the trajectory to come is replaced by the points of the path that one would reach
    at this speed from the nearest place on it; the network does the rest. It needs no search and
    never looks back: what it strays, it strays. Nor need it be as fast as the points: on a straight
    line the authors' network makes 1.0 m/s of 1.0, 1.1 of 1.2, 1.3 of 1.5, and in its jog 2.0 of 3.0.

    Parameters
    ----------
    network : of the authors (`load_authors`) or one's own.
    paths : of each its corners (n, 2), x and z in metres. Each character begins at the first, faces
        the second, and goes straight on after the last.
    speed : metres a second; one for all or one a path.
    seconds : how long; None: as each path takes at this speed.
    gait : which of `GAITS` a network that is told one is to show; None: walk, or jog from 2 m/s on.

    Returns
    -------
    list of Motion, one a path, with contacts, on the network's skeleton at its rate.

    Raises
    ------
    WayError : a path that is none.
    ModelError : no list of paths, a speed or time not above 0, an unknown gait.
    """
    if isinstance(paths, Tensor) or not len(paths):
        raise ModelError("follow: paths must be a list, of one path or more: [points].")
    its, speeds = network.layout, _speeds(speed, len(paths))
    if seconds is not None and not 0 < seconds < math.inf:
        raise ModelError(f"follow: seconds is {seconds!r}; it must be a number above 0.")
    gaits = _gaits(network, gait, speeds)
    beyond = float(speeds.max()) * ((seconds or 0.0) + 3 * its.reach / its.fps)
    ways = [Path.through(path, corner=0) for path in paths]
    curves, which = Curves(ways, beyond), torch.arange(len(ways))
    lengths = torch.tensor([way.length for way in ways])
    ends = lengths / speeds if seconds is None else torch.full_like(speeds, seconds)
    counts = (ends * its.fps).round().long().clamp(min=1).tolist()

    ahead = torch.arange(1, its.reach) * (speeds[:, None] / its.fps)
    along = torch.zeros_like(lengths)

    def led(arcs: Tensor) -> tuple[Tensor, Tensor]:
        there = curves.at(arcs, which), curves.ways(arcs, which)
        return tuple(upright(part).to(ahead) for part in there)

    start, facing = led(along[:, None])
    walk, frames = begin(network, start[:, 0], facing[:, 0]), []
    for _ in tqdm(range(max(counts)), "walking", unit="frame", leave=False, delay=2):
        along = curves.onward(flat(walk.root[0]), along, which)
        walk = lead(walk, *led(along[:, None] + ahead))
        frame, walk = step(network, walk, gaits)
        frames.append(frame)
    shown = Frame(*(torch.stack(parts, dim=1) for parts in zip(*frames, strict=True)))
    return [
        _motion(network, Frame(*(part[row, :count] for part in shown)))
        for row, count in enumerate(counts)
    ]


def _speeds(speed: float | Sequence[float], count: int) -> Tensor:
    """One speed a path."""
    try:
        speeds = torch.as_tensor(speed, dtype=torch.float32).expand(count)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ModelError(
            f"follow: speed is {speed!r}; it must be a number, or one for each of {count} paths."
        ) from error
    if not ((speeds > 0) & speeds.isfinite()).all():
        raise ModelError(f"follow: speed is {speed!r}; it must be above 0.")
    return speeds


def _gaits(network: Pfnn, gait: str | None, speeds: Tensor) -> Tensor:
    """Weights (batch, gaits) of the gaits at some speeds (batch,)."""
    if gait not in (None, *GAITS[:-1]):
        raise ModelError(f"There is no gait {gait!r}; there are {', '.join(GAITS[:-1])}.")
    weights = torch.zeros(len(speeds), network.layout.gaits)
    if network.layout.gaits:
        usual = ["jog" if speed >= _JOG else "walk" for speed in speeds.tolist()]
        which = torch.tensor([GAITS.index(gait or its) for its in usual])
        weights[torch.arange(len(speeds)), which] = 1
    return weights


def _motion(network: Pfnn, frames: Frame) -> Motion:
    """What was shown (frames, ...) as motion: hips where they were said to be, bones of one length."""
    its = network.layout
    parents = torch.tensor(its.skeleton.parents[1:])
    local = torch.cat(
        [frames.rotations[:, :1], frames.rotations[:, parents].mT @ frames.rotations[:, 1:]], dim=1
    )
    return Motion(
        its.skeleton, frames.joints[:, 0], local, its.fps,
        name="pfnn", source="pfnn", contacts=frames.contacts > _DOWN,
    )  # fmt: skip
