"""Strides: when each foot stands, when it comes down, and where between two strikes a body is.

The phase is that of Holden, Komura and Saito (2017), *Phase-Functioned Neural Networks for Character
Control*, *Motion Capture and Control Parameters*: 0 when the right foot comes down, π when the left
one does, 2π when the right one does again.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from ..errors import MotionError
from ..roles import SIDES

# Seconds within which no foot comes down twice (a sprinter's takes 0.45 from strike to strike), and
# within which both come down together.
_LEAST, _TOGETHER = 0.4, 0.1


def stances(labels: np.ndarray, fps: float, shortest: float = 0.07) -> list[list[tuple[int, int]]]:
    """For each foot, left and right, the spans of frames (start, stop) in which it is down.

    Parameters
    ----------
    labels : bool (frames, 4) as of `contacts.label`, or (frames, 2), of one point a foot.
    fps : frames per second.
    shortest : seconds; gaps in a contact, and contacts, that are shorter are taken for flicker.
    """
    least = shortest * fps
    feet = []
    for side in range(len(SIDES)):
        down = labels.reshape(len(labels), len(SIDES), -1)[:, side].any(-1)
        edges = np.flatnonzero(np.diff(down.astype(int), prepend=0, append=0)).reshape(-1, 2)
        spans: list[tuple[int, int]] = []
        for start, stop in edges.tolist():
            if spans and start - spans[-1][1] < least:
                spans[-1] = (spans[-1][0], stop)
            else:
                spans.append((start, stop))
        # A span at either end of the motion may be the visible part of a long one.
        last = len(down)
        feet.append([(a, b) for a, b in spans if b - a >= least or a == 0 or b == last])
    return feet


def strikes(labels: np.ndarray, fps: float, shortest: float = 0.07) -> list[tuple[int, int]]:
    """Frames in which a foot comes down, and which: 0 is the left one, 1 the right one; in order.

    Arguments as of `stances`. What is down from the first frame on did not come down.
    """
    feet = stances(labels, fps, shortest)
    return sorted((start, side) for side, foot in enumerate(feet) for start, _ in foot if start)


def phase(labels: Tensor, fps: float, shortest: float = 0.07) -> Tensor:
    """Where in the stride a body is, (frames,) radians in float64, which grow from frame to frame.

    A multiple of 2π when the right foot comes down and half a turn off that when the left one does;
    in between as time goes by. Two strikes of one foot in a row are a whole stride apart, unless
    they are no 0.4 s apart: then the second is none. Nor is a landing with both feet, within 0.1 s.
    Who stands still makes a long stride.

    Parameters
    ----------
    labels : bool (frames, 4): left heel, left toe, right heel, right toe; or (frames, 2).
    fps, shortest : as of `stances`.

    Returns
    -------
    (frames,) ; NaN before the first strike and after the last, where nobody knows.

    Raises
    ------
    MotionError : labels of another kind, or a rate that is not positive.
    """
    labels = torch.as_tensor(labels)
    if labels.dtype != torch.bool or labels.ndim != 2 or labels.shape[1] not in (2, 4):
        raise MotionError(
            f"phase: labels are {labels.dtype} of shape {tuple(labels.shape)}; they must be bool, "
            "(frames, 4) or (frames, 2), as `motionlab.contacts.label` gives them."
        )
    if not 0 < fps < math.inf:
        raise MotionError(f"phase: fps is {fps!r}; it must be a positive number.")
    frames, turns = _milestones(strikes(labels.numpy(force=True), fps, shortest), fps)
    found = np.full(len(labels), np.nan)
    if len(frames) > 1:
        within = slice(frames[0], frames[-1] + 1)
        found[within] = np.interp(np.arange(len(labels))[within], frames, turns)
    return torch.from_numpy(2 * np.pi * found)


def _milestones(found: list[tuple[int, int]], fps: float) -> tuple[list[int], list[float]]:
    """Frames of strikes that tell the phase, and turns of it there."""
    landings = {
        strike
        for one, other in pairwise(found)
        if one[1] != other[1] and other[0] - one[0] < _TOGETHER * fps
        for strike in (one, other)
    }
    frames: list[int] = []
    turns: list[float] = []
    latest = [-math.inf, -math.inf]  # of each foot
    last = None
    for frame, side in found:
        if (frame, side) in landings or frame - latest[side] < _LEAST * fps:
            continue
        before = 0.5 * (side == 0) if last is None else turns[-1] + (1.0 if side == last else 0.5)
        frames.append(frame)
        turns.append(before)
        latest[side], last = frame, side
    return frames, turns
