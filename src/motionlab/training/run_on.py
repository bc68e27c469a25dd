"""Runs that go on: recorded runs end after a few strides, in the middle of one.

A room with cameras is soon crossed. Most runs of the data speed up from a stand and are over after
one to three seconds; nowhere do they show what comes after. A network that has learned from them
knows how a run begins, and when it goes on by itself it slows down, or falls into the walk that it
knows better. So that it sees runs that last, a clip that ends in a run goes on here: back by one
stride, to the frame that is most like its last ones, and on from there, again and again.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ..encodings import Encoding, Normalizer

SPEED = 2.0  # m/s over the ground from which we call it a run
END = 0.5  # seconds over which speed is told; at the end of a clip, in which a stride may end
STRIDE = (0.4, 1.2)  # seconds of the two steps of a run
LIKE = 0.15  # seconds over which two moments are compared
# Root mean square over these, in deviations of the features, up to which two moments are alike.
# Neighbouring strides of a run differ by 0.2 to 0.5; a run by 1 and more from its braking.
ALIKE = 0.6
WAYS = 4  # strides to choose from at each repetition, the most alike
FADE = 0.25  # seconds in which a repetition loses the little that it begins beside the last frame


def run_on(
    clips: Sequence[Tensor], encoding: Encoding, normalizer: Normalizer, frames: int, seed: int = 0
) -> list[Tensor]:
    """The same clips, those that end in a run brought to a length by repeating their last strides.

    Parameters
    ----------
    clips : features (frames, dim) of `JointAngles`.
    frames : length to which a run is brought; longer ones, and all else, are left as they are.
    seed : of the choice among strides that end alike.
    """
    generator = torch.Generator().manual_seed(seed)
    found = []
    for clip in clips:
        runs = len(clip) < frames and bool(running(clip, encoding)[-1])
        ways = strides(clip, normalizer, encoding.fps) if runs else []
        found.append(_repeated(clip, ways, encoding, frames, generator) if ways else clip)
    return found


def running(clip: Tensor, encoding: Encoding) -> Tensor:
    """Which frames (frames,) of features (frames, dim) of `JointAngles` are of a run: by the mean
    speed of the half second before each."""
    steps = clip[:, :2].norm(dim=-1)  # metres over the ground since the frame before
    last = torch.arange(1, len(clip) + 1)
    first = (last - round(END * encoding.fps)).clamp(min=0)
    so_far = torch.cat([torch.zeros(1), steps.cumsum(0)])
    return (so_far[last] - so_far[first]) / (last - first) * encoding.fps >= SPEED


def strides(clip: Tensor, normalizer: Normalizer, fps: float) -> list[tuple[int, int]]:
    """First and last frame of strides at the end of a run (frames, dim), the most alike first.

    A stride (a, b) ends as it begins: frames up to b are like those up to a.
    """
    like, end = round(LIKE * fps), round(END * fps)
    if len(clip) < like:
        return []
    # moment i ends with frame i + like - 1
    moments = normalizer(clip).unfold(0, like, 1).flatten(1)
    apart = torch.cdist(moments[-end:], moments) / moments.shape[1] ** 0.5
    last = torch.arange(len(moments))
    ago = last[-end:, None] - last  # (ends, moments) frames from a to b
    apart[(ago < round(STRIDE[0] * fps)) | (ago > round(STRIDE[1] * fps))] = torch.inf
    best = apart.flatten().argsort()[:WAYS].tolist()
    found = [(i % len(moments), len(moments) - len(apart) + i // len(moments)) for i in best]
    good = apart.flatten()[best] <= ALIKE
    return [(a + like - 1, b + like - 1) for (a, b), ok in zip(found, good, strict=True) if ok]


def _repeated(
    clip: Tensor, ways: list[tuple[int, int]], encoding: Encoding, frames: int,
    generator: torch.Generator,
) -> Tensor:  # fmt: skip
    """A clip (frames, dim) up to the end of a stride, then strides at random."""
    fade = 1 - torch.arange(1, round(FADE * encoding.fps) + 1) / (FADE * encoding.fps + 1)
    least = round(STRIDE[0] * encoding.fps)
    a, b = ways[0]
    parts, length = [clip[: b + 1]], b + 1
    while length < frames:
        possible = [way for way in ways if way[1] - a >= least]
        c, d = possible[int(torch.randint(len(possible), (), generator=generator))]
        stride = clip[a + 1 : d + 1].clone()
        beside = clip[b] - clip[a]
        if "contacts" in encoding.slices:
            beside[encoding.slices["contacts"]] = 0.0  # they are 0 or 1
        stride[: len(fade)] += fade[:, None] * beside
        parts.append(stride)
        length += len(stride)
        a, b = c, d
    return torch.cat(parts)[:frames]
