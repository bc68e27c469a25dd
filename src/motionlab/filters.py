"""Noise taken off a motion by filters over time: what is done where nobody knows of bodies.

Each smooths every channel by itself: the root's place, its heading (which may turn round and round),
its tilt, and the other joints' rotation vectors about their mean pose, unwrapped, so that no filter
sees a jump of a whole turn. What smooths a channel is SciPy's, run forwards and backwards where it has
a direction, so that nothing lags.

Frames that were not seen are filled first, along the shortest arc from the last that was to the next
(`filled`). They are one mask: bool (frames,) for whole frames, or (frames, joints); where the root is
missing, so is its place.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import roma
import torch
from scipy.interpolate import make_smoothing_spline
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.signal import butter, savgol_filter, sosfiltfilt
from torch import Tensor

from .errors import MotionError
from .kinematics import heading, yaw_matrix
from .motion import Motion, slerp

__all__ = ["butterworth", "filled", "gaussian", "kalman", "median", "savitzky_golay"]

_FEWEST = 5  # frames seen that a spline can be laid through
_TWICE = (
    2**0.5 - 1
) ** 0.25  # 0.802: of second order, run forwards and back, the cut-off falls to this


def gaussian(motion: Motion, width: float, missing: Tensor | None = None) -> Motion:
    """Weighted means over time; `width` is the weights' standard deviation in frames.

    Raises MotionError, as all filters here, for a setting that makes no sense, a mask of another shape,
    or nothing seen.
    """
    _positive(motion, "gaussian", width=width)
    return _over(motion, missing, lambda x: gaussian_filter1d(x, width, axis=0, mode="nearest"))


def savitzky_golay(
    motion: Motion, frames: int, order: int = 3, missing: Tensor | None = None
) -> Motion:
    """The middle of a polynomial that is fitted to `frames`, an odd number (Savitzky, Golay 1964)."""
    if not (frames % 2 == 1 and 0 <= order < frames <= len(motion)):
        raise MotionError(
            f"savitzky_golay: {frames} frames and order {order} for a motion of {len(motion)}; frames must "
            "be odd, more than the order, and no more than the motion has."
        )
    return _over(motion, missing, lambda x: savgol_filter(x, frames, order, axis=0))


def butterworth(motion: Motion, cutoff: float, missing: Tensor | None = None) -> Motion:
    """Of second order, forwards and back, as biomechanics does; `cutoff` in hertz.

    Two passes have half their power at `cutoff`, for each is designed for a higher one (Winter,
    *Biomechanics and Motor Control of Human Movement*).
    """
    _positive(motion, "butterworth", cutoff=cutoff)
    single = cutoff / _TWICE
    if not single < motion.fps / 2:
        raise MotionError(
            f"butterworth: a cut-off of {cutoff:g} Hz at {motion.fps:g} frames a second; it must be below "
            f"{_TWICE * motion.fps / 2:.3g} Hz."
        )
    sections = butter(2, single, fs=motion.fps, output="sos")
    edge = min(len(motion) - 1, round(3 * motion.fps / single))  # three times as long as it rings
    return _over(motion, missing, lambda x: sosfiltfilt(sections, x, axis=0, padlen=edge))


def kalman(motion: Motion, cutoff: float, missing: Tensor | None = None) -> Motion:
    """Kalman filter and Rauch-Tung-Striebel smoother of a body that coasts, but for white accelerations.

    That smoother, begun knowing nothing, gives the cubic smoothing spline through what was seen
    (Wecker and Ansley 1983), and so SciPy's spline is what computes it. Frames that were not seen are
    not filled but left out, as a Kalman filter does.

    cutoff : hertz at which half of an oscillation's size is left. It stands for the ratio λ of the
        variance of a measurement to the spectral density of the accelerations: λ (2π cutoff)⁴ = fps.
    """
    _positive(motion, "kalman", cutoff=cutoff)
    return _splines(motion, missing, motion.fps / (2 * np.pi * cutoff) ** 4)


def median(motion: Motion, frames: int, missing: Tensor | None = None) -> Motion:
    """Medians of `frames`, an odd number: what lasts for less than half of them is gone."""
    if not (frames % 2 == 1 and frames >= 1):
        raise MotionError(f"median: {frames!r} frames; it must be an odd number.")
    return _over(motion, missing, lambda x: median_filter(x, (frames, 1), mode="nearest"))


def filled(motion: Motion, missing: Tensor | None) -> Motion:
    """Where nothing was seen, the shortest way from what was to what comes; beyond, what is nearest.

    Rotations along arcs (slerp), the root's place along lines.

    Raises
    ------
    MotionError : a mask of another shape, or a joint that is never seen.
    """
    mask = seen_mask(motion, missing)
    if mask.all():
        return motion
    root, rotations = motion.root_positions.clone(), motion.rotations.clone()
    patterns, which = mask.unique(dim=1, return_inverse=True)
    for number, seen in enumerate(patterns.T):
        joints = (which == number).nonzero()[:, 0]
        before, after, part = _neighbours(seen)
        turned = rotations[:, joints]
        arcs = slerp(turned[before], turned[after], part[:, None])
        rotations[:, joints] = torch.where(seen[:, None, None, None], turned, arcs)
        if 0 in joints:
            line = torch.lerp(root[before], root[after], part[:, None])
            root = torch.where(seen[:, None], root, line)
    return replace(motion, root_positions=root, rotations=rotations)


def seen_mask(motion: Motion, missing: Tensor | None) -> Tensor:
    """What was seen, bool (frames, joints), of what is missing; raises MotionError as `filled`."""
    frames, joints = len(motion), motion.skeleton.joints
    if missing is None:
        return torch.ones(frames, joints, dtype=torch.bool)
    missing = torch.as_tensor(missing)
    if missing.dtype != torch.bool or missing.shape not in ((frames,), (frames, joints)):
        raise MotionError(
            f"missing is of {missing.dtype} and shape {tuple(missing.shape)}; it must be bool, "
            f"({frames},) or ({frames}, {joints})."
        )
    seen = ~(missing if missing.ndim == 2 else missing[:, None].expand(-1, joints))
    if never := (~seen.any(0)).nonzero()[:, 0].tolist():
        names = ", ".join(motion.skeleton.names[joint] for joint in never)
        raise MotionError(f"missing: {names} is seen in no frame, so nothing can fill it.")
    return seen


def _neighbours(seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The last seen frame, the next one, and how far between they a frame lies, (frames,) each."""
    index = torch.arange(len(seen))
    first, last = seen.nonzero()[[0, -1], 0]
    before = torch.where(seen, index, -1).cummax(0).values.clamp(min=int(first))
    after = (
        torch.where(seen, index, len(seen)).flip(0).cummin(0).values.flip(0).clamp(max=int(last))
    )
    part = (index - before).clamp(min=0) / (after - before).clamp(min=1)
    return before, after, part.float()


# -- channels -------------------------------------------------------------------------------------


class Channels(NamedTuple):
    """A motion as numbers over time, (frames, 6 + 3 (joints - 1)), and about which mean pose."""

    numbers: np.ndarray
    mean: Tensor


def channels_of(motion: Motion) -> Channels:
    """Place, heading and tilt of the root, then rotation vectors about the mean pose, float64."""
    rotations = motion.rotations.double()
    yaw = heading(rotations[:, 0])
    tilt = roma.rotmat_to_rotvec(yaw_matrix(yaw).mT @ rotations[:, 0])[:, [0, 2]]
    mean = roma.special_procrustes(rotations[:, 1:].mean(0))
    turns = unwrapped(roma.rotmat_to_rotvec(mean.mT @ rotations[:, 1:]))
    yaw = torch.from_numpy(np.unwrap(yaw.numpy()))
    parts = [motion.root_positions.double(), yaw[:, None], tilt, turns.flatten(1)]
    return Channels(torch.cat(parts, 1).numpy(), mean)


def joined(motion: Motion, numbers: np.ndarray, mean: Tensor) -> Motion:
    """A motion with other numbers."""
    numbers = torch.from_numpy(np.ascontiguousarray(numbers))
    zero = torch.zeros_like(numbers[:, 4])
    tilt = roma.rotvec_to_rotmat(torch.stack([numbers[:, 4], zero, numbers[:, 5]], -1))
    root = yaw_matrix(numbers[:, 3]) @ tilt
    turns = mean @ roma.rotvec_to_rotmat(numbers[:, 6:].unflatten(1, (-1, 3)))
    rotations = torch.cat([root[:, None], turns], 1)
    return replace(motion, root_positions=numbers[:, :3].float(), rotations=rotations.float())


def unwrapped(turns: Tensor) -> Tensor:
    """Rotation vectors (frames, joints, 3), each of the whole turns that is nearest to the one before."""
    found = turns.clone()
    jumps = (turns.diff(dim=0).norm(dim=-1) > torch.pi).any(0)  # others are near all the time
    some = found[:, jumps]
    for frame in range(1, len(some) if jumps.any() else 0):
        size = some[frame].norm(dim=-1, keepdim=True)
        axis = some[frame] / size.clamp(min=1e-9)
        along = (some[frame - 1] * axis).sum(-1, keepdim=True)
        some[frame] += axis * (2 * torch.pi) * ((along - size) / (2 * torch.pi)).round()
    found[:, jumps] = some
    return found


def _over(motion: Motion, missing: Tensor | None, run) -> Motion:
    """A filter of arrays (frames, channels) run over the channels of what was filled."""
    numbers, mean = channels_of(filled(motion, missing))
    return joined(motion, run(numbers), mean)


def _splines(motion: Motion, missing: Tensor | None, strength: float) -> Motion:
    """Cubic smoothing splines through the frames in which a channel was seen."""
    seen = channel_mask(seen_mask(motion, missing))
    if (fewest := int(seen.sum(0).min())) < _FEWEST:
        raise MotionError(f"kalman: {fewest} of {len(motion)} frames are seen; it needs {_FEWEST}.")
    numbers, mean = channels_of(filled(motion, missing))
    lines = smooth_lines(torch.from_numpy(numbers), seen, strength * motion.fps**3)
    return joined(motion, lines.numpy(), mean)


def channel_mask(joints: Tensor) -> Tensor:
    """A mask (frames, joints) for channels (frames, channels): the root's six, three of each other."""
    root, others = joints[:, :1].expand(-1, 6), joints[:, 1:].repeat_interleave(3, dim=1)
    return torch.cat([root, others], dim=1)


def smooth_lines(numbers: Tensor, seen: Tensor, stiffness: Tensor | float) -> Tensor:
    """The smooth line through each channel: ``min Σ (numbers - x)² + stiffness ∫ x''²``, time in frames.

    Parameters
    ----------
    numbers : (frames, channels) float64.
    seen : bool like them, what counts.
    stiffness : of all, or (channels,).

    Returns
    -------
    (frames, channels), straight on before the first and after the last frame that was seen; the mean
    of what was seen of a channel in fewer frames than a spline needs, 0 if that is none.
    """
    each = torch.as_tensor(stiffness).double().expand(numbers.shape[1])
    found = np.zeros(numbers.shape)
    time, values = np.arange(len(numbers), dtype=float), numbers.double().numpy()
    groups: dict[tuple[bytes, float], list[int]] = {}
    for channel, its in enumerate(each.tolist()):
        groups.setdefault((seen[:, channel].numpy().tobytes(), its), []).append(channel)
    for (_, its), channels in groups.items():
        there = seen[:, channels[0]].numpy()
        if there.sum() < _FEWEST:
            some = values[there][:, channels]
            found[:, channels] = some.mean(0) if len(some) else 0.0
            continue
        spline = make_smoothing_spline(time[there], values[there][:, channels], lam=its)
        inner = time.clip(*time[there][[0, -1]])
        beyond = (time - inner)[:, None] * spline(inner, 1)
        found[:, channels] = spline(inner) + beyond
    return torch.from_numpy(found)


def _positive(motion: Motion, name: str, **settings: float) -> None:
    if not isinstance(motion, Motion) or not len(motion):
        raise MotionError(f"{name} takes a Motion with frames, not {motion!r}.")
    for setting, value in settings.items():
        if not 0 < value < float("inf"):
            raise MotionError(f"{name}: {setting} is {value!r}; it must be a positive number.")
