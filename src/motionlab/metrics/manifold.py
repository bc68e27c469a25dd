"""How far from real motion: nearest windows, STRNN's manifold distance, and is it a replay?

Windows of generated features are compared with every window of real ones. The distance of two
windows is the mean over their frames of the Euclidean norm of the difference (STRNN, eq. 12), in
the unit of the features: give features in which all channels weigh alike, such as standardised
ones. Real motion that the real windows do not hold (another split, another half) is the floor:
unseen real motion is not at distance 0 either.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..errors import MetricError
from .checks import check_features, check_positive, check_rate

# Windows compared at a time: small enough for the cache, large enough for matrix products.
ROWS, COLUMNS = 512, 1024
# Matrix products leave rounding errors; so many of the nearest are measured again without.
CANDIDATES = 4


class Nearest(NamedTuple):
    """For each window of the samples the nearest of all reference windows; all are (windows,).

    `distance` is in the unit of the features. The window is `clip` of the samples from second
    `time` on; what it is nearest to is `match_clip` of the reference from second `match_time` on.
    """

    distance: Tensor
    clip: Tensor
    time: Tensor
    match_clip: Tensor
    match_time: Tensor


def manifold_distance(
    samples: Sequence[Tensor],
    real: Sequence[Tensor],
    fps: float,
    window: float = 4 / 3,
    step: float = 1 / 3,
) -> Tensor:
    """Mean distance of each clip's windows to their nearest real windows (STRNN, eq. 12, 13).

    The paper cuts windows of 40 frames every 10 frames: the defaults at 30 fps. It does not see what
    is missing: a body that stands is near to real ones that stand. The reverse does,
    ``manifold_distance(real, samples, fps)``: how far real motion is from the nearest that was made.

    Parameters
    ----------
    samples, real : clips of features, each (frames, dim); or one tensor (clips, frames, dim).
    fps : frames per second of all of them.
    window, step : seconds.

    Returns
    -------
    (clips,) in the unit of the features; lower is nearer. Their mean is the paper's measure.

    Raises
    ------
    MetricError : a clip is shorter than a window, not finite, or of another dimension.
    """
    nearest = nearest_window_distance(samples, real, fps=fps, window=window, step=step)
    count = int(nearest.clip[-1]) + 1
    total = nearest.distance.new_zeros(count).index_add(0, nearest.clip, nearest.distance)
    return total / torch.bincount(nearest.clip, minlength=count)


def nearest_window_distance(
    samples: Sequence[Tensor],
    reference: Sequence[Tensor],
    fps: float,
    window: float = 4 / 3,
    step: float = 1 / 3,
    reference_step: float | None = None,
) -> Nearest:
    """For each window of the samples the nearest reference window, found by comparing all pairs.

    A sample that replays training data scores 0, if it is compared at every frame of it
    (``reference_step=0``); on a grid of steps a replay may fall between two windows.

    Parameters
    ----------
    samples, reference : clips of features, each (frames, dim); or one tensor (clips, frames, dim).
    fps : frames per second of all of them.
    window, step : seconds that a window lasts, and from one window to the next.
    reference_step : the same for the reference; None is `step`, 0 is every frame.

    Returns
    -------
    Nearest : distances and where they were found. Memory grows with the number of windows, not
        with the number of pairs.

    Raises
    ------
    MetricError : a clip is shorter than a window, not finite, or of another dimension.
    """
    fps = check_rate(fps)
    length = max(1, round(check_positive(window, "window") * fps))
    stride = max(1, round(check_positive(step, "step") * fps))
    reference_stride = stride
    if reference_step == 0:
        reference_stride = 1
    elif reference_step is not None:
        reference_step = check_positive(reference_step, "reference_step")
        reference_stride = max(1, round(reference_step * fps))
    ours, at, clip, time = _windows(samples, "samples", length, stride)
    theirs, there, match_clip, match_time = _windows(
        reference, "reference", length, reference_stride, ours.shape[-1]
    )
    # Norms from matrix products lose digits where features are far from 0.
    middle = theirs.mean(0)
    distance, match = _nearest(ours - middle, at, theirs - middle, there, length)
    return Nearest(distance, clip, time / fps, match_clip[match], match_time[match] / fps)


def replay_share(samples: Tensor, held_out: Tensor, quantile: float = 0.01) -> float:
    """Share of windows nearer to the training data than real motion it does not hold ever comes.

    Both are distances to the training windows, ``nearest_window_distance(...).distance``: of
    samples, and of real clips that were held out. Real motion scores about `quantile`, a replay
    of training clips 1; a model that copies scores in between.

    Raises
    ------
    MetricError : no distances, or a quantile that is not between 0 and 1.
    """
    if not 0 <= quantile <= 1:
        raise MetricError(f"replay_share: quantile is {quantile!r}; it must lie between 0 and 1.")
    if len(samples) == 0 or len(held_out) == 0:
        raise MetricError("replay_share: no windows to compare; give distances of one or more.")
    limit = np.quantile(np.asarray(held_out), quantile)
    return float((np.asarray(samples) <= limit).mean())


def _windows(
    clips: Sequence[Tensor], name: str, length: int, stride: int, dim: int | None = None
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """All frames in one table (frames, dim); of each window its row there, its clip and frame."""
    if len(clips) == 0:
        raise MetricError(f"{name} is empty; give one clip or more.")
    tables, rows, numbers, frames = [], [], [], []
    row = 0
    for number, clip in enumerate(clips):
        clip = check_features(clip, length, f"{name}[{number}]", dim)
        if clip.ndim != 2:
            raise MetricError(
                f"{name}[{number}] has shape {tuple(clip.shape)}; a clip is (frames, dim): give a "
                "list of clips, or one tensor (clips, frames, dim)."
            )
        dim = clip.shape[-1]
        starts = torch.arange(0, len(clip) - length + 1, stride, device=clip.device)
        tables.append(clip.detach().float())
        rows.append(row + starts)
        numbers.append(torch.full_like(starts, number))
        frames.append(starts)
        row += len(clip)
    return tuple(map(torch.cat, (tables, rows, numbers, frames)))


def _nearest(
    ours: Tensor, at: Tensor, theirs: Tensor, there: Tensor, length: int
) -> tuple[Tensor, Tensor]:
    """Distance to, and number of, the nearest of `theirs` for each window of `ours`.

    Windows are named by the row at which they start, so that none is ever copied out.
    """
    distances, matches = [], []
    for some in at.split(ROWS):
        best = ours.new_full((len(some), 0), 0)
        index = some.new_zeros(len(some), 0)
        for begin in range(0, len(there), COLUMNS):
            others = there[begin : begin + COLUMNS]
            total = ours.new_zeros(len(some), len(others))
            for frame in range(length):
                total += torch.cdist(
                    ours[some + frame],
                    theirs[others + frame],
                    compute_mode="use_mm_for_euclid_dist",
                )
            numbers = torch.arange(begin, begin + len(others), device=at.device)
            best = torch.cat([best, total], 1)
            index = torch.cat([index, numbers.expand(len(some), -1)], 1)
            best, order = best.topk(min(CANDIDATES, best.shape[1]), dim=1, largest=False)
            index = index.gather(1, order)
        exact = _exact(ours, some, theirs, there[index], length)
        distance, choice = exact.min(1)
        distances.append(distance)
        matches.append(index.gather(1, choice[:, None])[:, 0])
    return torch.cat(distances), torch.cat(matches)


def _exact(ours: Tensor, at: Tensor, theirs: Tensor, there: Tensor, length: int) -> Tensor:
    """Mean per-frame norms (windows, candidates) of windows `at` to candidates `there`."""
    total = ours.new_zeros(there.shape)
    for frame in range(length):
        total += (ours[at + frame][:, None] - theirs[there + frame]).norm(dim=-1)
    return total / length
