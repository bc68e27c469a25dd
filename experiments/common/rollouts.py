"""Long samples of a generator and when they fail: what several experiments share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import max_pool1d

from motionlab import Skeleton, metrics
from motionlab.contacts import foot_points, rest_heights
from motionlab.encodings import Encoding
from motionlab.training import Prepared

from . import record

OBSERVED = 2.0  # seconds of real motion before a sample begins
AWAY, WHOLE = 5.0, 1.0  # cm beyond all real clips, and seconds throughout: off the floor
AT_ONCE = 450_000  # frames in memory: 120 MB of features
KINDS = ("frozen", "diverged", "off floor")


@dataclass(frozen=True, eq=False)
class Judge:
    """What failure is, read off real motion on the same skeleton.

    low, high : cm, height of the lowest foot below (above) which a body is off the floor if it
        stays there for a second.
    lasting : seconds for which a body must have diverged on end.
    """

    limits: metrics.Limits
    low: float
    high: float
    fps: float
    lasting: float = 0.0

    @classmethod
    def fit(cls, clips: Sequence[Tensor], skeleton: Skeleton, fps: float) -> Judge:
        """From positions (frames, points, 3) of real clips, a second or longer."""
        highs, lows = zip(*(_held(clip, skeleton, fps) for clip in clips), strict=True)
        return cls(
            metrics.Limits.fit(clips, skeleton, fps),
            min(float(low.min()) for low in lows) - AWAY,
            max(float(high.max()) for high in highs) + AWAY,
            fps,
        )

    def config(self) -> dict:
        """What counts as failure, fit for JSON: for whoever has no data. See `from_config`."""
        limits = {key: its for key, its in vars(self.limits).items() if key != "skeleton"}
        limits["bones"] = self.limits.bones.tolist()
        kept = {key: its for key, its in vars(self).items() if key != "limits"}
        return record.rounded(kept | {"limits": limits})

    @classmethod
    def from_config(cls, config: dict, skeleton: Skeleton) -> Judge:
        limits = dict(config["limits"])
        limits["bones"] = torch.tensor(limits["bones"])
        return cls(**config | {"limits": metrics.Limits(skeleton, **limits)})

    def failures(self, positions: Tensor) -> dict[str, float]:
        """Seconds until one motion (frames, points, 3) fails in each way; infinite if never."""
        found = {
            "frozen": float(metrics.time_to_freeze(positions, self.limits, self.fps)),
            "diverged": float(
                metrics.time_to_divergence(positions, self.limits, self.fps, self.lasting)
            ),
            "off floor": math.inf,
        }
        whole = len(positions)
        if math.isfinite(found["diverged"]):
            whole = round(found["diverged"] * self.fps)
        if whole >= WHOLE * self.fps:
            high, low = _held(positions[:whole], self.limits.skeleton, self.fps)
            off = (high > self.high) | (low < self.low)
            if off.any():
                found["off floor"] = int(off.int().argmax()) / self.fps
        return found


def _held(positions: Tensor, skeleton: Skeleton, fps: float) -> tuple[Tensor, Tensor]:
    """Heights (windows,) in cm above (below) which the lowest foot is for a whole second."""
    flat = rest_heights(skeleton)
    if flat.min() < 0:  # the rest pose hangs from a root at the origin: let it stand
        flat = flat - flat.min()
    lowest = 100 * (positions[..., foot_points(skeleton), 1] - flat.to(positions)).amin(-1)
    pool = lambda values: max_pool1d(values[None], round(WHOLE * fps), 1)[0]
    return -pool(-lowest), pool(lowest)


def judge_of(data: Prepared) -> Judge:
    """The judge made of the training clips, mirror images left out."""
    encoding = data.encoding
    clips = [encoding.positions(clip) for clip in data.clips("train")]
    names = [n for n, split in zip(data.names, data.splits, strict=True) if split == "train"]
    clips = [clip for clip, n in zip(clips, names, strict=True) if not n.endswith("_mirrored")]
    clips = [clip for clip in clips if len(clip) >= WHOLE * encoding.fps]
    return Judge.fit(clips, encoding.skeleton, encoding.fps)


def spread_evenly(count: int, wanted: int) -> list[int]:
    """At most `wanted` of `count` indices."""
    return torch.linspace(0, count - 1, min(count, wanted)).round().long().tolist()


@torch.no_grad()
def sampled(
    model: nn.Module, begun: Tensor, frames: int, seed: int, done: Sequence[int] = (), **sampling
) -> Iterator[tuple[int, Tensor]]:
    """Samples that go on from begun (starts, seen, dim), in batches that fit into memory.

    Yields the number of the batch and its features (batch, frames, dim); batches in `done` are
    left out. Each has its own source of chance, so that leaving out changes nothing.
    """
    for number, some in enumerate(begun.split(max(1, AT_ONCE // frames))):
        if number not in done:
            generator = torch.Generator().manual_seed(seed * 1_000 + number)
            yield (
                number,
                model.generate(frames, model.observe(some), generator=generator, **sampling),
            )


def points_of(encoding: Encoding, features: Tensor) -> Tensor:
    """Positions of features (frames, dim) that may not be finite: what is not stays so."""
    positions = encoding.positions(features.nan_to_num(0.0, 0.0, 0.0))
    bad = ~features.isfinite().all(-1)
    return positions.masked_fill((bad.cumsum(-1) > 0)[:, None, None], torch.nan)
