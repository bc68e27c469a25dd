"""Poses that no body of the data takes: knees that give way, a foot turned about, a torso bent double.

A motion may keep to its path by the millimetre and hold such poses: distances do not see them.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import torch
from torch import Tensor

from ..encodings import JointAngles
from ..encodings.base import drawn_as_canonical
from ..errors import MetricError
from ..motion import Motion
from ..skeleton import Skeleton

_HEIGHT = 3  # the channel of it
_FILE = Path(__file__).with_name("pose_ranges.json")  # experiments/data/fit_pose_ranges.py


def broken_frames(motion: Motion) -> Tensor:
    """Whether a body holds a pose beyond those of the training data, bool (frames,).

    Beyond means: the height of the root, its tilt, or one of the three numbers of a joint (its
    rotation vector from the mean pose), lies farther outside the range that it has in the training
    split of `locomotion` than any does in the validation split. Recorded motion that lies there is
    not broken; it is another than walking, running and turning. Of bodies with other legs the height
    is not judged.

    Raises
    ------
    MetricError : a skeleton that is not drawn like `Skeleton.canonical`.
    """
    if not drawn_as_canonical(motion.skeleton):
        raise MetricError(
            "broken_frames knows the ranges of the canonical skeleton's joints; bring the motion there "
            "with motion.retarget(Skeleton.canonical())."
        )
    encoding = JointAngles(motion.skeleton, motion.fps)
    return beyond(encoding, encoding.encode(motion)) > 0


def knows(encoding: JointAngles) -> bool:
    """Whether `beyond` can judge an encoding's features."""
    return encoding.rotation == "vector" and drawn_as_canonical(encoding.skeleton)


def beyond(encoding: JointAngles, features: Tensor) -> Tensor:
    """By how much (..., frames), radians or metres, features (..., frames, dim) lie beyond; else below 0.

    encoding : one that this module `knows`.
    """
    off, margins = _off(encoding, features)
    return (off - margins).amax(-1)


def outside(encoding: JointAngles, features: Tensor) -> Tensor:
    """The same of each channel (..., frames, channels), 0 within, from the range itself on: what
    the data themselves never do, with no margin."""
    return _off(encoding, features)[0].clamp(min=0)


def within(encoding: JointAngles, features: Tensor) -> Tensor:
    """The features (..., frames, dim) with each joint's numbers brought back into their range."""
    first, last = encoding.slices["pose"].start, encoding.slices["pose"].stop
    low, high, _ = (edge[first - _HEIGHT :].to(features) for edge in _ranges())
    body = features[..., first:last].clamp(low, high)
    return torch.cat([features[..., :first], body, features[..., last:]], -1)


def ranges(encoding: JointAngles) -> tuple[int, Tensor, Tensor]:
    """The first channel that is judged, and the least and the largest value of it and those behind it.

    encoding : one that this module `knows`.
    """
    first = _HEIGHT if encoding.skeleton.matches(Skeleton.canonical()) else _HEIGHT + 1
    low, high, _ = (edge[first - _HEIGHT :] for edge in _ranges())
    return first, low, high


def _off(encoding: JointAngles, features: Tensor) -> tuple[Tensor, Tensor]:
    """How far outside its range each channel is, and the margins (channels,)."""
    first, low, high = ranges(encoding)
    body = features[..., first : encoding.slices["pose"].stop]
    off = torch.maximum(low.to(body) - body, body - high.to(body))
    return off, _ranges()[2][first - _HEIGHT :].to(body)


@cache
def _ranges() -> tuple[Tensor, Tensor, Tensor]:
    """Least and largest value of each channel from the height on, and its margin."""
    found = json.loads(_FILE.read_text(encoding="utf-8"))
    with torch.inference_mode(False):
        low, high = torch.tensor(list(found["ranges"].values())).unbind(1)
        height, turns = found["margins"]
        margins = torch.full_like(low, turns)
        margins[0] = height
        return low, high, margins
