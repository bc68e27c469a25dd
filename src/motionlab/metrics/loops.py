"""Has generated motion run into a loop: alone, or several rollouts into the same one?

A network without noise that is fed its own output may end on a cycle: it repeats a few seconds for
ever, and from whichever start. Motion change does not see it, for the body moves on. Walking
repeats itself too, but no two strides of a person are the same; a loop is a repetition far closer
than real motion ever comes to its own past:

    tolerance = loop_tolerance(real, skeleton, fps=30)
    found = loop(rollout, skeleton, fps=30, tolerance=tolerance)   # period, start: seconds
    groups = converged(rollouts, skeleton, fps=30, tolerance=tolerance)

Poses are compared relative to the root in the heading frame, so a walker who circles may loop.
Differences are root mean squares over points and frames, as a share of how far the points move
about their mean pose: a number without unit that frame rate and scale leave alone. Between frames
the past is interpolated, for a cycle need not last a whole number of frames; at 30 fps that leaves an
error of up to 0.01, more in a sprint, whose cycle may be found as two strides and not one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from scipy.sparse.csgraph import connected_components
from torch import Tensor
from torch.nn.functional import avg_pool1d, conv1d, pad

from ..errors import MetricError
from ..skeleton import Skeleton
from .checks import check_positions, check_positive, check_rate
from .heading_frame import heading_frame

WINDOW = 1.0  # seconds that are looked for in the past: about a stride
LEAST_PERIOD = 0.4  # seconds; nearer in time any motion is like itself
HOLD = 3.0  # seconds that a repetition must have lasted
CLOSER = 0.3  # share of the closest real repetition below which it is a loop
MOVING = 0.02  # of the body's size: who moves less about the mean pose stands still
TOLERANCE = 0.03  # CLOSER of what walking people reach: see `loop_tolerance`


class Loop(NamedTuple):
    """Period of the cycle and when it was entered, in seconds; both infinite without a loop."""

    period: float
    start: float


def repetition(positions: Tensor, skeleton: Skeleton, fps: float) -> Tensor:
    """How near a motion's last second comes to any earlier one: difference as share of movement.

    0 repeats exactly, 1 is as far as poses of the motion are from their mean. People who walk or
    run reach 0.11 and usually 0.2, whatever their style.

    Parameters
    ----------
    positions : (..., frames, points, 3); 1.5 s or more.

    Returns
    -------
    (...), without unit; infinite where the body stands still.
    """
    poses, fps, shape = _poses(positions, skeleton, fps)
    found = []
    for pose in poses:
        ratio, _ = _recurrence(pose, fps)
        found.append(float(ratio.min()))
    return torch.tensor(found).reshape(shape)


def loop_tolerance(clips: Sequence[Tensor], skeleton: Skeleton, fps: float) -> float:
    """Difference below which a repetition is a loop: 0.3 of the closest in real clips.

    clips : positions (frames, points, 3) each, all at one frame rate; those too short for
    `repetition` are left out. Raises MetricError if none moves for long enough.
    """
    fps = check_rate(fps)
    least = _frames(WINDOW + LEAST_PERIOD, fps) + 2
    found = [repetition(c, skeleton, fps) for c in clips if len(c) >= least]
    closest = min((float(ratio) for ratio in found), default=float("inf"))
    if not np.isfinite(closest):
        raise MetricError(
            "loop_tolerance: no clip moves for 1.5 s or longer; give longer real clips."
        )
    return CLOSER * closest


def loop(positions: Tensor, skeleton: Skeleton, fps: float, tolerance: float = TOLERANCE) -> Loop:
    """The cycle on which one motion ends, if it does.

    Of all lags the shortest for which the motion up to its end is what it was one lag before, for
    three seconds and one whole period at least. A cycle is thus seen after it was gone through
    twice; a body that stands still is frozen, not in a loop.

    Parameters
    ----------
    positions : (frames, points, 3).
    tolerance : greatest difference, a share of the movement, in every second of the repetition.
    """
    poses, fps, shape = _poses(positions, skeleton, fps)
    tolerance = check_positive(tolerance, "tolerance")
    if shape:
        raise MetricError(
            f"loop: positions has {len(shape) + 3} dimensions; give one motion, (frames, points, "
            "3), at a time."
        )
    pose = poses[0]
    ratio, lags = _recurrence(pose, fps)
    # one candidate for every visit of the last second's poses: where the difference is least
    around = pad(ratio, (1, 1), value=float("inf"))
    dip = (ratio <= around[:-2]) & (ratio <= around[2:]) & (ratio < tolerance)
    window, frames = _frames(WINDOW, fps), len(pose)
    for lag in lags[dip].tolist():
        past, moved = _extent(pose[-max(window, round(lag)) :]), _lagged(pose, lag)
        square = (moved**2).sum(1) * 3 / pose.shape[1]
        if len(square) < window:
            continue
        differs = avg_pool1d(square[None], window, 1)[0].sqrt() >= tolerance * past
        again = int(differs.nonzero().max()) + 1 if differs.any() else 0
        span = len(square) - again  # frames from which on it has been like one lag before
        if span >= max(lag, HOLD * fps):
            return Loop(lag / fps, max(0.0, (frames - span - lag) / fps))
    return Loop(float("inf"), float("inf"))


def converged(
    rollouts: Tensor, skeleton: Skeleton, fps: float, tolerance: float = TOLERANCE
) -> Tensor:
    """Which rollouts end in the same motion: a group number (rollouts,) for each, from 0 up.

    Two are in one group if the last three seconds of one are somewhere in the other, to the
    tolerance, at any phase; or if a third one links them. Rollouts that stand still are in no
    one's group: whether they froze in one pose is for `time_to_freeze`.

    Parameters
    ----------
    rollouts : (rollouts, frames, points, 3), from different starts; cut off what they share.
    tolerance : as of `loop`.
    """
    poses, fps, shape = _poses(rollouts, skeleton, fps, seconds=HOLD)
    tolerance = check_positive(tolerance, "tolerance")
    if len(shape) != 1:
        raise MetricError(
            f"converged: rollouts has {len(shape) + 3} dimensions; it must be (rollouts, frames, "
            "points, 3)."
        )
    tails = poses[:, -_frames(HOLD, fps) :]
    extents = torch.stack([_extent(tail) for tail in tails])
    near = torch.stack([_matches(tails, pose)[0].amin(1) for pose in poses], 1)
    same = near < tolerance * extents[:, None]
    _, labels = connected_components(same.cpu().numpy(), directed=False)
    return torch.as_tensor(labels, dtype=torch.long)


def _frames(seconds: float, fps: float) -> int:
    return max(1, round(seconds * fps))


def _poses(
    positions: Tensor, skeleton: Skeleton, fps: float, seconds: float = WINDOW + LEAST_PERIOD
) -> tuple[Tensor, float, torch.Size]:
    """Poses (motions, frames, points * 3) and the leading dimensions of the positions."""
    fps = check_rate(fps)
    positions = check_positions(positions, minimum_frames=_frames(seconds, fps) + 2)
    positions = positions.detach().double()
    pose = heading_frame(positions - positions[..., :1, :], skeleton)[0]
    return pose.reshape(-1, *pose.shape[-3:]).flatten(2), fps, positions.shape[:-3]


def _recurrence(pose: Tensor, fps: float) -> tuple[Tensor, Tensor]:
    """Difference of the last second from each earlier one as a share of the movement since then,
    and the lags (frames) at which it is that small; the shortest lag first."""
    window = _frames(WINDOW, fps)
    difference, start = _matches(pose[None, -window:], pose)
    lags = len(pose) - window - start[0]
    late = lags >= _frames(LEAST_PERIOD, fps)
    difference, lags = difference[0, late].flip(0), lags[late].flip(0)
    # variance of the last n frames for every n, from sums of the reversed motion
    back = pose.flip(0)
    count = torch.arange(1, len(pose) + 1, dtype=pose.dtype, device=pose.device)
    variance = (back**2).cumsum(0).sum(1) / count - ((back.cumsum(0) / count[:, None]) ** 2).sum(1)
    extents = (variance.clamp(min=0) * 3 / pose.shape[1]).sqrt()
    extents[extents < MOVING * _size(pose)] = 0
    extents = extents[lags.round().long().clamp(min=window) - 1]
    return torch.where(extents > 0, difference / extents, torch.inf), lags


def _matches(tails: Tensor, pose: Tensor) -> tuple[Tensor, Tensor]:
    """Each tail (tails, window, dim) held against all of a motion (frames, dim).

    Returns for each whole frame the least difference when the tail is laid between it and the next
    one, and where that is: both (tails, frames - window). With b and c the motion from one frame
    and from the next on, |a - (1 - f) b - f c|² is a parabola in f; what it needs are products of
    the tail with the motion (a correlation) and of the motion with itself (sliding sums).
    """
    window = tails.shape[1]
    slide = lambda values: avg_pool1d(values[None], window, 1)[0] * window
    own = slide((pose**2).sum(1))
    next_ = slide((pose[:-1] * pose[1:]).sum(1))
    product = conv1d(pose.mT[None], tails.mT.contiguous())[0]
    square = (tails**2).sum((1, 2))[:, None] - 2 * product + own
    step = (own[1:] - 2 * next_ + own[:-1]).clamp(min=1e-30)
    along = product[:, 1:] - product[:, :-1] - next_ + own[:-1]
    part = (along / step).clamp(0, 1)
    least = square[:, :-1] - 2 * part * along + part**2 * step
    start = torch.arange(len(pose) - window, dtype=pose.dtype, device=pose.device)
    points = pose.shape[1] / 3
    return (least.clamp(min=0) / (window * points)).sqrt(), start + part


def _lagged(pose: Tensor, lag: float) -> Tensor:
    """Difference of a motion from itself one lag (frames, not whole) before, where it has a past."""
    whole = int(lag)
    part = lag - whole
    past = pose[1:] * (1 - part) + pose[:-1] * part  # row t is t + 1 - part
    return pose[whole + 1 :] - past[: len(pose) - whole - 1]


def _extent(pose: Tensor) -> Tensor:
    """Root mean square of the points' distances from their mean places; 0 if it stands still."""
    extent = ((pose - pose.mean(0)).square().mean() * 3).sqrt()
    return extent * (extent >= MOVING * _size(pose))


def _size(pose: Tensor) -> Tensor:
    """Root mean square distance of the points from the root."""
    return (pose.square().mean() * 3).sqrt()
