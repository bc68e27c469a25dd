"""What a noisy clip tells before any network is asked: numbers, noise, outliers, and a smooth line.

A clip is rows of numbers here: where the root is, which way it faces, how it tilts, and the joints'
rotation vectors, all of which a camera sees with noise that has no memory (RNN-GAN, eq. 26). Steps from
frame to frame, which a network reads, have not: an error in one place is in two steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from scipy.linalg import solveh_banded
from torch import Tensor

from ..encodings import JointAngles
from ..encodings.path import steps_between
from ..kinematics import heading
from ..motion import Motion

ROOT, YAW, TURNS = slice(0, 3), 3, slice(3, None)  # channels of rows: metres, radians, all radians
ORDER = 4  # of the differences that show noise: a body's are small there, and noise adds up
# What is left of clean motion there, for which no one needs a cleaner: m, rad.
LEAST_ROOT, LEAST_ANGLE = 0.001, 0.004
FPS = 30.0  # of what is said a frame
# Accelerations, m and rad a frame², that a body is free to have; chosen on validation clips.
PUSH_ROOT, PUSH_ANGLE = 0.0035, 0.016
# Times these, that a clip may ask for, and how near to the least error is enough; see `cross_validated`.
FREEDOMS, FOLDS, NEARLY = (0.5, 1.0, 2.0, 4.0, 8.0), 4, 0.03
# A frame is an outlier if it is so many spreads farther than usual from its neighbours' median, and more
# than so many times the noise, or m and rad where there is less noise: no body jumps like that.
OUTLIER, FAR, FAR_ROOT, FAR_ANGLE = 6.0, 2.5, 0.015, 0.05
NEIGHBOURS = 7  # frames whose median a frame is held against


class NoiseLevels(NamedTuple):
    """Standard deviations of white noise: of the root's place in metres, of angles in radians."""

    root_m: float
    angle_rad: float


@dataclass
class Seen:
    """A clip as it was seen.

    rows : (frames, channels) float64, see above; what was not seen may be anything, but a number.
    mask : bool, like rows, what was seen. outliers : bool (frames,), seen, and not believed.
    """

    rows: Tensor
    mask: Tensor
    outliers: Tensor

    @property
    def believed(self) -> Tensor:
        return self.mask & ~self.outliers[:, None]


def rows_of(encoding: JointAngles, motion: Motion, mask: Tensor | None = None) -> Tensor:
    """Rows (frames, channels) of a motion on the encoding's body, float64.

    mask : bool, like rows, what was seen; the yaw turns on from one frame that was to the next.
    """
    features = encoding.encode(motion).double()
    yaw = heading(motion.rotations[:, 0].double())
    there = torch.ones(len(yaw), dtype=torch.bool) if mask is None else mask[:, YAW]
    yaw[there] = torch.from_numpy(np.unwrap(yaw[there].numpy()))
    pose = features[:, encoding.slices["pose"]]
    return torch.cat([motion.root_positions.double(), yaw[:, None], features[:, 4:6], pose], dim=1)


def features_of(encoding: JointAngles, rows: Tensor, contacts: Tensor | None) -> Tensor:
    """Features (frames, dim) of rows; contacts : (frames, 2), left and right toe, if it has them."""
    parts = [steps_between(rows[:, ROOT], rows[:, YAW]), rows[:, 1:2], rows[:, 4:6], rows[:, 6:]]
    if "contacts" in encoding.slices:
        parts.append(contacts.to(rows))
    return torch.cat(parts, dim=1).float()


def motion_of(encoding: JointAngles, rows: Tensor, like: Motion | None = None) -> Motion:
    """The motion of rows (frames, channels), without contacts, called like another."""
    features = features_of(encoding, rows, torch.zeros(len(rows), 2))
    names = ("", "") if like is None else (like.name, like.source)
    found = encoding.to_motion(features, rows[0, [0, 2, YAW]], *names)
    return replace(found, contacts=None)


def joints_of(mask: Tensor) -> Tensor:
    """A mask (frames, joints) for channels (frames, channels): the root's six, three of each other."""
    root, others = mask[:, :1].expand(-1, 6), mask[:, 1:].repeat_interleave(3, dim=1)
    return torch.cat([root, others], dim=1)


def levels_of(seen: Seen) -> NoiseLevels:
    """Noise, from what is left of rows when their fourth difference is taken.

    The median over frames, as a few outliers must not count, and over channels, as some joint is calm
    in any motion. Noise with a memory has less of it there, and is taken for less than it is.
    """
    size = math.sqrt(math.comb(2 * ORDER, ORDER))
    found = []
    for channels in (ROOT, TURNS):
        rows, seen_there = seen.rows[:, channels], seen.mask[:, channels]
        whole = seen_there.unfold(0, ORDER + 1, 1).all(-1)
        each = torch.where(whole, rows.diff(n=ORDER, dim=0).abs() / size, torch.nan)
        each = 1.4826 * each.nanmedian(dim=0).values
        found.append(float(each.nanmedian()))
    root, angle = (0.0 if math.isnan(value) else value for value in found)
    return NoiseLevels(root, angle)


def outliers_of(seen: Seen, noise: NoiseLevels) -> Tensor:
    """Frames (frames,) that lie far from the median of those about them."""
    frames = len(seen.rows)
    if frames < NEIGHBOURS:
        return torch.zeros(frames, dtype=torch.bool)
    half = NEIGHBOURS // 2
    rows = torch.where(seen.mask, seen.rows, torch.nan)
    padded = torch.cat([rows[:1].expand(half, -1), rows, rows[-1:].expand(half, -1)])
    off = rows - padded.unfold(0, NEIGHBOURS, 1).nanmedian(-1).values
    scale = torch.full((rows.shape[1],), max(noise.angle_rad, FAR_ANGLE)).double()
    scale[ROOT] = max(noise.root_m, FAR_ROOT)
    far = (off / scale).square().nanmean(1).sqrt()
    usual = far.nanmedian()
    spread = 1.4826 * (far - usual).abs().nanmedian()
    return (far > usual + OUTLIER * torch.maximum(spread, 0.25 * usual)) & (far > FAR)


def smooth(
    seen: Seen,
    noise: NoiseLevels,
    fps: float = FPS,
    times: tuple[float, float] = (1.0, 1.0),
    counts: Tensor | None = None,
) -> Tensor:
    """Rows (frames, channels) on a line with as little acceleration as what was seen allows.

    For each channel that is ``min Σ (seen - x)² / σ² + Σ (x'')² / a²``, what a Kalman smoother finds
    for a body that is pushed at random (Whittaker 1923 found it before). Where nothing was seen it
    goes on as its ends ask; where nothing of a channel was seen at all it is 0, the mean pose.

    times : factors on a, of the root and of angles. counts : (frames,), 0 where a frame is left out.
    """
    believed = seen.believed.double()
    if counts is not None:
        believed = believed * counts[:, None]
    pushes = torch.full((seen.rows.shape[1],), PUSH_ANGLE * times[1]).double()
    levels = torch.full_like(pushes, max(noise.angle_rad, LEAST_ANGLE))
    pushes[ROOT], levels[ROOT] = PUSH_ROOT * times[0], max(noise.root_m, LEAST_ROOT)
    pushes *= (FPS / fps) ** 1.5  # pushes without a memory add up so
    return whittaker(seen.rows, believed, (levels / pushes).square())


def cross_validated(seen: Seen, noise: NoiseLevels, fps: float = FPS) -> Tensor:
    """Rows like those of `smooth`, as free to accelerate as this clip asks for: who runs or dances is more.

    Every fourth frame is left out in turn, and the lines through the others are held against what was
    seen there. Root and angles get the least freedom whose error is nearly the smallest, as who has
    fewer frames to go by asks for too much. It needs no network, and no clip but this one.
    """
    held = torch.arange(len(seen.rows)) % FOLDS
    off = torch.zeros(len(FREEDOMS), 2).double()
    for i, times in enumerate(FREEDOMS):
        for fold in range(FOLDS):
            line = smooth(seen, noise, fps, (times, times), (held != fold).double())
            gaps = ((seen.rows - line).square() * seen.believed)[held == fold]
            off[i] += torch.stack([gaps[:, ROOT].sum(), gaps[:, TURNS].sum()])
    enough = off <= (1 + NEARLY) * off.min(0).values
    root, angles = (FREEDOMS[i] for i in enough.int().argmax(0).tolist())  # the first that is
    return smooth(seen, noise, fps, (root, angles))


def whittaker(rows: Tensor, weights: Tensor, stiffness: Tensor) -> Tensor:
    """The smooth line through each channel of rows (frames, channels).

    weights : like rows, 0 for what does not count. stiffness : (channels,), of its second difference.
    """
    frames = len(rows)
    if frames < 3:
        return rows.clone()
    bands = np.zeros((3, frames))  # of DᵀD, as solveh_banded reads them: the diagonal last
    for at, one in enumerate((1.0, -2.0, 1.0)):
        for other, two in enumerate((1.0, -2.0, 1.0)[: at + 1]):
            bands[2 - (at - other), at : at + frames - 2] += one * two
    found = np.zeros(rows.shape)
    values, weights, stiffness = (x.double().numpy() for x in (rows, weights, stiffness))
    groups: dict[bytes, list[int]] = {}
    for channel in range(rows.shape[1]):
        key = weights[:, channel].tobytes() + stiffness[channel].tobytes()
        groups.setdefault(key, []).append(channel)
    for channels in groups.values():
        weight = weights[:, channels[0]]
        if np.count_nonzero(weight) < 2:
            continue
        matrix = stiffness[channels[0]] * bands
        matrix[2] += weight + 1e-9
        found[:, channels] = solveh_banded(matrix, weight[:, None] * values[:, channels])
    return torch.from_numpy(found)
