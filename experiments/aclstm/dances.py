"""The dances as the networks see them, and the held-out moments at which all of them begin.

of("indian"), of("indian", 60.0), seeds("indian", 20)
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import torch
from torch import Tensor

from motionlab import MotionLabError, encodings
from motionlab.training import Prepared
from motionlab.training.dances import DanceWindows

FPS = 30.0  # of all rows but one, and of the grid from which moments are chosen
SEEN = 10  # frames that a network is given, at its own rate
AHEAD = 0.64  # seconds after them that must have been recorded


class Seeds(NamedTuple):
    """Recorded motion around some moments.

    seen : (moments, SEEN, dim), frames up to each; true : (moments, frames, dim), those after it.
    """

    seen: Tensor
    true: Tensor
    clips: tuple[str, ...]  # where each is from


@cache
def found(style: str) -> Prepared:
    """As `motionlab prepare` leaves them."""
    return Prepared.find(style)


@cache
def of(style: str, fps: float = FPS) -> Prepared:
    """Each recording once, at a rate at which some network is trained."""
    data = found(style)
    clips = zip(data.features.split(data.lengths.tolist()), data.names, data.splits, strict=True)
    # the odd and even frames of one recording are nearly the same at 30 frames a second
    kept = [
        (clip, name, split) for clip, name, split in clips if not re.search(r"_[2-9]/\d$", name)
    ]
    clips, names, splits = zip(*kept, strict=True)
    stride = data.encoding.fps / fps
    if stride < 1:
        raise MotionLabError(f"{style} has {data.encoding.fps:g} frames a second, not {fps:g}.")
    clips = [_at_every(clip, stride) for clip in clips]
    return replace(
        data, features=torch.cat(clips), lengths=torch.tensor([len(clip) for clip in clips]),
        names=names, splits=splits, hash=f"{data.hash}-{fps:g}",
        encoding=encodings.from_config({**data.encoding.config(), "fps": fps}),
    )  # fmt: skip


def _at_every(clip: Tensor, stride: float) -> Tensor:
    """A clip (frames, dim) at every so many frames, the first of them after one stride."""
    frames = int((len(clip) - 1) // stride)
    (whole,) = DanceWindows([clip], frames, stride, tempo=0.0, turn=False).tiles(1)
    return whole[0]


def moments(style: str, count: int, split: str = "test") -> list[tuple[int, float]]:
    """Clip of a split, and seconds in it, of moments spread evenly over them all."""
    ahead = math.ceil(AHEAD * FPS)
    lengths = [len(clip) for clip in of(style).clips(split)]
    grid = [
        (number, (frame + 1) / FPS)
        for number, length in enumerate(lengths)
        for frame in range(SEEN - 1, length - ahead)
    ]
    count = min(count, len(grid))
    return [grid[int((i + 0.5) * len(grid) / count)] for i in range(count)]


def seeds(style: str, count: int, fps: float = FPS, split: str = "test") -> Seeds:
    """The same moments at any rate: frames before and after them."""
    data = of(style, fps)
    names = [name for name, its in zip(data.names, data.splits, strict=True) if its == split]
    clips, ahead = data.clips(split), math.ceil(AHEAD * fps)
    found = [(number, round(seconds * fps)) for number, seconds in moments(style, count, split)]
    return Seeds(
        torch.stack([clips[number][at - SEEN : at] for number, at in found]),
        torch.stack([clips[number][at : at + ahead] for number, at in found]),
        tuple(names[number] for number, _ in found),
    )
