"""How good trained weights are: the likelihood of clips they never saw, and samples beside the data.

data = Prepared.find("locomotion")
found = evaluate(motionlab.load("lstm-gmm-contacts"), data, "val")
found.log_likelihood, found.samples["speed (m/s)"], found.data["speed (m/s)"]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from .. import metrics
from ..encodings import Encoding
from ..errors import TrainingError
from ..feet import contacts
from ..metrics import Interval, Limits
from ..skeleton import Skeleton
from .prepared import SPLITS, Prepared

MOST = 5_000_000  # frames of all samples: what fits in memory
OBSERVED = 1.0  # seconds of real motion that a model sees before it goes on by itself
SHORTEST = 2.0  # seconds; shorter clips say little of speed or of standing still


@dataclass(frozen=True)
class Evaluation:
    """What `evaluate` found. Intervals are over clips and over samples."""

    log_likelihood: Interval
    """Nats a frame of the split's clips, each from its first frame on; in normalised units."""
    samples: dict[str, Interval]
    """Metrics of the samples that did not diverge."""
    data: dict[str, Interval]
    """The same of the split's clips, each as much as it is long."""
    starts: int
    """Number of samples."""
    frozen: int
    """Samples that stopped for good."""
    diverged: int
    """Samples that left what bodies do."""


def evaluate(
    model: nn.Module,
    data: Prepared,
    split: str = "val",
    *,
    starts: int = 20,
    seconds: float = 20.0,
    seed: int = 0,
    **sampling: float,
) -> Evaluation:
    """Held-out likelihood, and samples that go on from held-out motion beside that motion.

    Samples begin after one second of real motion each, spread evenly over the split. What counts
    as frozen and as diverged is read off the training clips (`metrics.Limits`). Contacts are found
    by the rule of `motionlab.contacts`, in samples and data alike, not taken from the network.

    Parameters
    ----------
    model : of the same encoding as the data, but for contacts, which it need not have.
    starts, seconds : how many samples, and how long.
    sampling : temperature and the like, for ``model.generate``.

    Raises
    ------
    TrainingError : no such split, features of another kind, too few starts, too short a time.
    """
    data, clips = _fitting(model, data, split)
    fps, skeleton = model.encoding.fps, model.encoding.skeleton
    if not (starts >= 1 and seconds >= 1 and starts * seconds * fps <= MOST):
        raise TrainingError(
            f"evaluate: {starts} starts, {seconds} s; ask for 1 or more of both, and for no more "
            f"than {MOST / fps / 3600:.0f} hours of samples in all."
        )
    begun = starting_windows(clips, starts, round(OBSERVED * fps))
    with torch.no_grad():
        made = model.generate(
            round(seconds * fps), model.observe(begun, doubt=False),
            generator=torch.Generator().manual_seed(seed), **sampling,
        )  # fmt: skip
        training = [model.encoding.positions(clip) for clip in data.clips("train")]
        limits = Limits.fit(training, skeleton, fps)
        whole = made.isfinite().all(-1).all(-1)
        points = model.encoding.positions(made.nan_to_num(0.0, 0.0, 0.0))
    lost = ~whole | metrics.time_to_divergence(points, limits, fps).isfinite()
    frozen = metrics.time_to_freeze(points, limits, fps).isfinite() & ~lost
    long = [clip for clip in clips if len(clip) >= SHORTEST * fps]
    return Evaluation(
        likelihood(model, clips), _of_clips(model.encoding, list(made[~lost])),
        _of_clips(model.encoding, long), len(begun), int(frozen.sum()), int(lost.sum()),
    )  # fmt: skip


@torch.no_grad()
def likelihood(model: nn.Module, clips: Sequence[Tensor]) -> Interval:
    """Log-likelihood in nats a frame of features (frames, dim), a clip of one frame left out."""
    logs = [model.log_prob(clip[None])[0] for clip in clips if len(clip) > 1]
    return _weighted([(log.mean().item(), len(log)) for log in logs])


def starting_windows(clips: Sequence[Tensor], count: int, frames: int) -> Tensor:
    """Windows (count, frames, dim) spread evenly over the clips; fewer if there are no more."""
    windows = [window for clip in clips for window in clip.split(frames) if len(window) == frames]
    if not windows:
        raise TrainingError(f"No clip has the {frames} frames that a model is to see at first.")
    chosen = torch.linspace(0, len(windows) - 1, min(count, len(windows))).round().long()
    return torch.stack([windows[i] for i in chosen])


def _fitting(model: nn.Module, data: Prepared, split: str) -> tuple[Prepared, list[Tensor]]:
    """The data as the model's encoding has them, and the clips of a split."""
    if split not in SPLITS:
        raise TrainingError(f"There is no split {split!r}; there are {', '.join(SPLITS)}.")
    data = data.matching(model.encoding)
    if not (clips := data.clips(split)):
        raise TrainingError(f"The data have no clips in the split {split!r}.")
    return data, clips


def measured(positions: Tensor, skeleton: Skeleton, fps: float) -> dict[str, float]:
    """Means over one finite motion (frames, points, 3) in metres; contacts as `contacts` finds them."""
    down = contacts.label_positions(positions, skeleton, fps)
    turning = metrics.turn_rate(positions, skeleton, fps).abs()
    return {
        "speed (m/s)": float(metrics.speed(positions, fps).mean()),
        "turn rate, unsigned (rad/s)": float(turning.mean()),
        "acceleration (m/s²)": float(metrics.acceleration(positions, fps)),
        "jerk (m/s³)": float(metrics.jerk(positions, fps)),
        "foot skate (cm/s)": float(metrics.foot_skate(positions, down, skeleton, fps)),
        "foot skate, weighted (cm/s)": float(metrics.foot_skate_weighted(positions, skeleton, fps)),
    }


def over_all(values: Sequence[dict[str, float]], frames: Sequence[float]) -> dict[str, Interval]:
    """Means over all frames of some motions, of what `measured` found; intervals over motions.

    What is not finite is left out: feet that never rest have no skate.
    """
    found = {}
    for key in values[0] if values else ():
        pairs = [(v[key], n) for v, n in zip(values, frames, strict=True) if math.isfinite(v[key])]
        if pairs:
            found[key] = _weighted(pairs)
    return found


def _of_clips(encoding: Encoding, clips: Sequence[Tensor]) -> dict[str, Interval]:
    """Metrics over clips of features (frames, dim)."""
    points = [encoding.positions(clip) for clip in clips]
    values = [measured(clip, encoding.skeleton, encoding.fps) for clip in points]
    return over_all(values, [len(clip) for clip in clips])


def _weighted(pairs: Sequence[tuple[float, float]]) -> Interval:
    """Mean of (value, frames) over frames, the interval over clips."""
    return metrics.bootstrap(
        pairs, lambda some: sum(v * n for v, n in some) / sum(n for _, n in some)
    )
