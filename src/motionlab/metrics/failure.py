"""When does generated motion fail: freezes, stagnations, divergence, and survival curves.

What counts as failure is read off real motion of the same kind, on the same skeleton and in the
same unit: a body is still when its pose moves far less than real poses do, and frozen when it stays
still until the end for longer than real bodies ever do; it has diverged when it does what lies far
outside everything in the data. A model trained on dances that begin and end in a rest pose may
rest, one trained on walking may not.

    limits = Limits.fit(real, skeleton, fps=30)
    frozen = time_to_freeze(rollouts, limits, fps=30)            # (rollouts,) seconds, inf: never
    curve = survival(frozen, horizon=300)

acLSTM (section 4) tells permanent freezes from "short-term freezing" that recovers, by eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import avg_pool1d

from ..errors import MetricError
from ..skeleton import Skeleton
from .checks import check_positions, check_rate, check_skeleton
from .heading_frame import heading_frame

WINDOW = 0.5  # seconds over which a pose must stay in place to be still: a walk has no such time
STILL = 0.1  # ... moving less than this share of what real poses usually do
PATIENCE, LEAST_PATIENCE = 2.0, 1.0  # times the longest real stillness; seconds
STRETCH = 0.5  # of a mean bone: how much longer than ever in the data a bone may get
AWAY = 0.5  # of the greatest real height of the root: how far outside real heights it may be
HASTE = 2.0  # times the greatest real speed
SPAN = 0.1  # seconds over which speeds are taken, so that they don't depend on the frame rate


@dataclass(frozen=True, eq=False)
class Limits:
    """What real motion does and how far beyond that is failure; made by `Limits.fit`.

    Lengths are in the unit of the positions it was made from, metres unless you took another.

    Parameters
    ----------
    skeleton : the body.
    still : extent of the pose over half a second below which it stands still.
    patience : seconds of stillness to the end from which a motion counts as frozen.
    bones : (points - 1,), lengths beyond which a bone has come apart.
    least_size : total length of all bones below which the body has shrunk.
    heights : least and greatest height of the root.
    speed : of any point, in length a second.
    """

    skeleton: Skeleton
    still: float
    patience: float
    bones: Tensor
    least_size: float
    heights: tuple[float, float]
    speed: float

    @classmethod
    def fit(cls, clips: Sequence[Tensor], skeleton: Skeleton, fps: float) -> Limits:
        """Limits from real clips: each positions (frames, points, 3), all at one frame rate.

        Clips shorter than half a second are left out.

        Raises
        ------
        MetricError : none is longer, wrong shapes, NaN, another skeleton, a bad rate.
        """
        fps = check_rate(fps)
        clips = [
            check_skeleton(c, skeleton, 1, f"clips[{i}]").detach() for i, c in enumerate(clips)
        ]
        if any(clip.ndim != 3 for clip in clips):
            raise MetricError(
                "Limits.fit: a clip must be (frames, points, 3); give a list of them."
            )
        if len({clip.shape[1] for clip in clips}) > 1:
            raise MetricError(
                "Limits.fit: some clips hold joints and some all points; give one or the other."
            )
        clips = [clip for clip in clips if len(clip) >= _window(fps)]
        if not clips:
            raise MetricError(f"Limits.fit: no clip is {WINDOW} s or longer; give longer ones.")
        extents = [pose_extent(clip, skeleton, fps) for clip in clips]
        still = STILL * float(torch.cat(extents).median())
        pauses = [b - a for e in extents for a, b in _intervals(e < still, fps)]
        lengths = torch.cat([_bones(clip, skeleton) for clip in clips])
        heights = torch.cat([clip[:, 0, 1] for clip in clips])
        low, high = float(heights.min()), float(heights.max())
        return cls(
            skeleton,
            still,
            max(LEAST_PATIENCE, PATIENCE * max(pauses, default=0.0)),
            lengths.amax(0) + STRETCH * float(lengths.mean()),
            (1 - STRETCH) * float(lengths.sum(-1).min()),
            (low - AWAY * high, high + AWAY * high),
            HASTE * max(float(_speeds(clip, fps).max()) for clip in clips),
        )


def pose_extent(positions: Tensor, skeleton: Skeleton, fps: float) -> Tensor:
    """How far a pose moves about within half a second: root mean square over points and frames of
    the distance from its own mean, in the unit of positions.

    The pose is relative to the root in the heading frame, so that a statue that slides or turns
    is still; and trembling by a millimetre, however fast, is a millimetre.

    Returns
    -------
    (..., windows), one for each window of half a second; window t begins with frame t.

    Raises
    ------
    MetricError : wrong shape, shorter than half a second, NaN, another skeleton, a bad rate.
    """
    fps = check_rate(fps)
    length = _window(fps)
    positions = check_positions(positions, minimum_frames=length).double()
    pose = heading_frame(positions - positions[..., :1, :], skeleton)[0]
    batch, (frames, points) = pose.shape[:-3], pose.shape[-3:-1]
    pose = pose.reshape(-1, frames, points * 3).mT
    spread = avg_pool1d(pose**2, length, 1) - avg_pool1d(pose, length, 1) ** 2
    return (spread.sum(1) / points).clamp(min=0).sqrt().reshape(*batch, -1)


def time_to_freeze(positions: Tensor, limits: Limits, fps: float) -> Tensor:
    """Seconds after which a motion stands still for good, infinite if it does not.

    For good means until the end, and for `limits.patience` at least: a motion that stopped
    shortly before its end counts as moving. Slow motion and short stagnations are no freeze.

    Parameters
    ----------
    positions : (..., frames, points, 3). NaN and infinite frames are not still.
    limits : from real motion of the same unit.
    fps : frames per second.

    Returns
    -------
    (...) seconds.

    Raises
    ------
    MetricError : wrong shape, shorter than half a second, points of another skeleton, a bad rate.
    """
    fps, rollouts, shape = _rollouts(positions, limits, fps)
    times = []
    for rollout in rollouts:
        pauses = _intervals(_still(rollout, limits, fps), fps)
        start, end = pauses[-1] if pauses else (0.0, 0.0)
        for_good = abs(end - len(rollout) / fps) < 1e-9 and end - start >= limits.patience
        times.append(start if for_good else float("inf"))
    return torch.tensor(times, dtype=torch.float64).reshape(shape)


def stagnations(positions: Tensor, limits: Limits, fps: float) -> list[tuple[float, float]]:
    """Times (start, end) in seconds during which one motion (frames, points, 3) stands still.

    None is shorter than half a second. The last one is the freeze, if there is one. Errors as of
    `time_to_freeze`.
    """
    fps, rollouts, shape = _rollouts(positions, limits, fps)
    if shape:
        raise MetricError(
            f"stagnations: positions has shape {(*shape, *rollouts.shape[1:])}; give one motion, "
            "(frames, points, 3), at a time."
        )
    return _intervals(_still(rollouts[0], limits, fps), fps)


def time_to_divergence(
    positions: Tensor, limits: Limits, fps: float, lasting: float = 0.0
) -> Tensor:
    """Seconds after which a motion leaves what bodies do, infinite if it never does.

    It has left when a value is NaN or infinite, a bone is stretched, the body shrinks, the root
    is far above or below its real heights, or a point moves faster than the limit.

    Parameters, result and errors as of `time_to_freeze`; a single frame is enough.

    lasting : seconds for which it must be like that on end, to tell what recovers from what does
        not: a network that names points has no bones that could not stretch for a moment. A value
        that is not finite never recovers.
    """
    fps, rollouts, shape = _rollouts(positions, limits, fps)
    if not 0 <= lasting < float("inf"):
        raise MetricError(f"lasting is {lasting!r}; it must be a number of seconds, 0 or more.")
    frames, times = max(1, round(lasting * fps)), []
    for rollout in rollouts:
        lost = ~torch.isfinite(rollout).flatten(1).all(1)
        lengths = _bones(rollout, limits.skeleton)
        bad = (
            lost
            | (lengths > limits.bones.to(lengths)).any(1)
            | (lengths.sum(1) < limits.least_size)
        )
        height = rollout[:, 0, 1]
        bad |= (height < limits.heights[0]) | (height > limits.heights[1])
        bad |= (_speeds(rollout, fps) > limits.speed).any(1)
        if frames > 1:  # frame t counts if all from it on are bad, for so long
            long = bad.unfold(0, frames, 1).all(1) if len(bad) >= frames else bad[:0]
            bad = lost | torch.cat([long, lost[len(long) :]])
        times.append(int(bad.int().argmax()) / fps if bad.any() else float("inf"))
    return torch.tensor(times, dtype=torch.float64).reshape(shape)


class Survival(NamedTuple):
    """Share of motions that have not failed at each of `times` (s), a step function, and its 95 %
    band; all (n,) arrays. Draw it with ``where="post"``."""

    times: np.ndarray
    share: np.ndarray
    low: np.ndarray
    high: np.ndarray


def survival(times: Sequence[float], horizon: float | Sequence[float]) -> Survival:
    """Share of motions still alive over time (Kaplan and Meier 1958).

    Parameters
    ----------
    times : seconds to each motion's failure; infinite if it did not fail.
    horizon : seconds for which the motions were watched; one number, or one a motion. A motion
        that lasted so long leaves the count without having failed.

    Returns
    -------
    Survival : from second 0 to the longest horizon, or to the last failure if none is left. The
        band is Wilson's interval with the number of motions that Greenwood's variance stands for
        (Rothman 1978); where none is censored it is Wilson's binomial interval. It is not empty
        when no motion failed.

    Raises
    ------
    MetricError : no motions, a time that is NaN or negative, or a horizon that is not positive.
    """
    try:
        times, horizon = np.asarray(times, dtype=float), np.asarray(horizon, dtype=float)
    except (TypeError, ValueError) as error:
        raise MetricError(f"survival: times and horizon must be seconds: {error}.") from error
    if times.ndim != 1 or len(times) == 0 or np.isnan(times).any() or (times < 0).any():
        raise MetricError("survival: times must be one number of seconds, 0 or more, a motion.")
    if horizon.shape not in ((), times.shape) or not (np.isfinite(horizon) & (horizon > 0)).all():
        raise MetricError("survival: horizon must be seconds, one number or one a motion.")
    horizon = np.broadcast_to(horizon, times.shape)
    failed = times <= horizon
    seen = np.where(failed, times, horizon)
    steps = np.unique(np.r_[0.0, seen])
    deaths = np.array([(failed & (seen == step)).sum() for step in steps])
    at_risk = np.array([(seen >= step).sum() for step in steps])
    share = np.cumprod(1 - deaths / at_risk)
    alive = at_risk > deaths  # once all are dead the share is 0 and has no variance of this form
    terms = np.divide(deaths, at_risk * (at_risk - deaths), out=np.zeros(len(steps)), where=alive)
    variance = share**2 * np.cumsum(terms)
    # where nobody has failed yet, or all have, the number is that of motions watched so far
    count = np.minimum.accumulate(at_risk).astype(float)
    inside = (variance > 0) & (share > 0)
    count[inside] = (share * (1 - share))[inside] / variance[inside]
    for last in np.flatnonzero(share == 0):
        count[last] = count[last - 1] if last else len(times)
    return Survival(steps, share, *_wilson(share, count))


def _wilson(share: np.ndarray, count: np.ndarray, z: float = 1.959964) -> tuple:
    """Wilson's 95 % interval of a share of `count`."""
    middle = (share + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * np.sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    return np.clip(middle - half, 0, share), np.clip(middle + half, share, 1)


def _rollouts(positions: Tensor, limits: Limits, fps: float) -> tuple[float, Tensor, torch.Size]:
    """Motions in a row (rollouts, frames, points, 3), not necessarily finite, and their shape."""
    fps = check_rate(fps)
    if not isinstance(limits, Limits):
        raise MetricError(f"limits is {limits!r}; make them from real motion, with Limits.fit.")
    positions = check_skeleton(positions, limits.skeleton, finite=False)
    if positions.shape[-2] != len(limits.bones) + 1:
        raise MetricError(
            f"positions has {positions.shape[-2]} points and the limits were made from "
            f"{len(limits.bones) + 1}; make both from joints, or both from all points."
        )
    shape = positions.shape[:-3]
    return fps, positions.reshape(-1, *positions.shape[-3:]), shape


def _window(fps: float) -> int:
    """Frames from the beginning to the end of half a second."""
    return max(2, round(WINDOW * fps) + 1)


def _still(rollout: Tensor, limits: Limits, fps: float) -> Tensor:
    """Bool (windows,): the pose stays in place for the half second that begins here."""
    broken = ~torch.isfinite(rollout).flatten(1).all(1)
    clean = rollout.masked_fill(broken[:, None, None], 0.0)
    extent = pose_extent(clean, limits.skeleton, fps)
    touched = broken.unfold(0, _window(fps), 1).any(1)
    return (extent < limits.still) & ~touched


def _intervals(still: Tensor, fps: float) -> list[tuple[float, float]]:
    """Seconds from the first frame of the first to the last of the last of windows that touch."""
    more = _window(fps) - 1
    windows = still.cpu().numpy()
    inside = np.convolve(windows, np.ones(more + 1)) > 0  # frames of any such window
    edges = np.flatnonzero(np.diff(np.r_[0, inside.astype(int), 0])).reshape(-1, 2)
    return [(int(begin) / fps, int(end) / fps) for begin, end in edges]


def _bones(positions: Tensor, skeleton: Skeleton) -> Tensor:
    """Lengths (..., frames, points - 1) from each point to its parent."""
    parents = list(skeleton.point_parents[1 : positions.shape[-2]])
    return (positions[..., 1:, :] - positions[..., parents, :]).norm(dim=-1)


def _speeds(positions: Tensor, fps: float) -> Tensor:
    """Speed (frames, points) of each point over the last tenth of a second; 0 before there is one."""
    lag = max(1, round(SPAN * fps))
    moved = (positions[lag:] - positions[:-lag]).norm(dim=-1) * (fps / lag)
    return torch.cat([moved.new_zeros(min(lag, len(positions)), positions.shape[1]), moved])
