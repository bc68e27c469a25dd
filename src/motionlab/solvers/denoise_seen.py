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
from torch import Tensor
from torch.nn.functional import max_pool1d

from ..encodings import JointAngles
from ..encodings.path import steps_between
from ..filters import channel_mask, filled, smooth_lines, unwrapped
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
# A frame is an outlier if it is so many spreads off the way between those about it, root mean square over
# channels. A spread is not under that of the noise, nor under m and rad that bodies do within a frame.
FAR, FAR_ROOT, FAR_ANGLE = 3.5, 0.015, 0.05
ALONE = 3  # frames; of outliers that are as near to each other the farthest is judged first
FEWEST = 8  # frames; fewer do not tell noise from motion
SAME = 1e-5  # metres and entries of rotations; what differs by less is one pose, written twice


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

    mask : bool, (frames, joints), what was seen; what was not is as `known_everywhere` has it. Turns go
    on from frame to frame, beyond half a turn if need be.
    """
    motion = motion if mask is None else known_everywhere(motion, mask)
    features = encoding.encode(motion).double()
    yaw = torch.from_numpy(np.unwrap(heading(motion.rotations[:, 0].double()).numpy()))
    pose = features[:, encoding.slices["pose"]].unflatten(1, (-1, 3))
    tilt = features[:, 4:6]
    return torch.cat(
        [motion.root_positions.double(), yaw[:, None], tilt, unwrapped(pose).flatten(1)], dim=1
    )


def known_everywhere(motion: Motion, mask: Tensor) -> Motion:
    """A motion with what was not seen filled; a joint that never was, (frames, joints), is at rest."""
    never = ~mask.any(0)
    rotations = torch.where(never[:, None, None], torch.eye(3), motion.rotations)
    return filled(replace(motion, rotations=rotations), ~(mask | never))


def held_frames(motion: Motion) -> Tensor:
    """Frames, bool (frames,), in which all is as in the frame before, and later moves again.

    So programs write what cameras lost. Whoever stands still where cameras tremble is never twice the same;
    in a calm clip it may be a person, so ask of those that tremble only. A pose that is held to the clip's
    end, or from its beginning, is none: nobody lost it between two others.
    """
    moved = (motion.root_positions.diff(dim=0).abs().amax(1) > SAME) | (
        motion.rotations.diff(dim=0).abs().flatten(1).amax(1) > SAME
    )
    found = torch.zeros(len(motion), dtype=torch.bool)
    if moved.any():
        first, last = moved.nonzero()[[0, -1], 0].tolist()
        found[first + 1 : last + 1] = ~moved[first:last]
    return found


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


def look(
    rows: Tensor, joints: Tensor, noise: NoiseLevels | None = None
) -> tuple[Seen, NoiseLevels]:
    """Rows (frames, channels) as they were seen, and their noise, estimated if it is not given.

    joints : bool (frames, joints), what was seen. Outliers are no noise, so both are found twice.
    """
    seen = Seen(rows, channel_mask(joints), torch.zeros(len(rows), dtype=torch.bool))
    for _ in range(2):
        levels = levels_of(seen) if noise is None else noise
        seen.outliers = outliers_of(seen, levels)
    return seen, levels_of(seen) if noise is None else noise


def levels_of(seen: Seen) -> NoiseLevels:
    """Noise, from what is left of rows when their fourth difference is taken.

    The median over frames, as a few outliers must not count, and over channels, as some joint is calm
    in any motion. Noise with a memory has less of it there, and is taken for less than it is.
    """
    size = math.sqrt(math.comb(2 * ORDER, ORDER))
    found = []
    for channels in (ROOT, TURNS):
        rows, seen_there = seen.rows[:, channels], seen.believed[:, channels]
        whole = seen_there.unfold(0, ORDER + 1, 1).all(-1)
        each = torch.where(whole, rows.diff(n=ORDER, dim=0).abs() / size, torch.nan)
        each = 1.4826 * each.nanmedian(dim=0).values
        found.append(float(each.nanmedian()))
    root, angle = (0.0 if math.isnan(value) else value for value in found)
    return NoiseLevels(root, angle)


def outliers_of(seen: Seen, noise: NoiseLevels) -> Tensor:
    """Frames (frames,) that jump: far off the straight way between those about them.

    Each channel's distance is measured by its own median over frames, so that whoever moves fast jumps
    nowhere. A frame that is wrong makes its neighbours look so; the farthest of some is taken first,
    and then they are held against those beyond it.
    """
    spread = torch.full((seen.rows.shape[1],), max(noise.angle_rad, FAR_ANGLE / 1.2)).double()
    spread[ROOT] = max(noise.root_m, FAR_ROOT / 1.2)
    spread *= math.sqrt(1.5)  # two neighbours' noise is on the way, too
    found = torch.zeros(len(seen.rows), dtype=torch.bool)
    for _ in found:
        there = seen.mask & ~found[:, None]
        off = torch.where(there, seen.rows - _way_between(seen.rows, there), torch.nan).abs()
        usual = 1.4826 * off.nanmedian(0).values.nan_to_num()
        far = (off / torch.maximum(spread, usual)).square().nanmean(1).sqrt().nan_to_num()
        farthest = max_pool1d(far[None, None], 2 * ALONE + 1, 1, ALONE)[0, 0]
        more = (far > FAR) & (far == farthest)
        if not more.any():
            break
        found |= more
    return found


def _way_between(rows: Tensor, there: Tensor) -> Tensor:
    """Of each channel the point on the line from the last frame that is there to the next one.

    Beyond the first and the last, what is nearest.
    """
    frames = len(rows)
    index = torch.arange(frames)[:, None].expand_as(rows)
    none = torch.full_like(index[:1], -1)
    last = torch.cat([none, torch.where(there, index, -1).cummax(0).values[:-1]])
    following = torch.where(there, index, frames).flip(0).cummin(0).values.flip(0)
    following = torch.cat([following[1:], none + 1 + frames])
    before = torch.where(last < 0, following, last).clamp(max=frames - 1)
    after = torch.where(following >= frames, before, following)
    part = (index - before).double() / (after - before).clamp(min=1)
    return torch.lerp(rows.gather(0, before), rows.gather(0, after), part.clamp(0, 1))


def smooth(
    seen: Seen,
    noise: NoiseLevels,
    fps: float = FPS,
    times: tuple[float, float] = (1.0, 1.0),
    counts: Tensor | None = None,
) -> Tensor:
    """Rows (frames, channels) on a line with as little acceleration as what was seen allows.

    For each channel that is ``min Σ (seen - x)² / σ² + ∫ x''² / a²``, what a Kalman smoother finds for
    a body that is pushed at random; see `filters.kalman`. Where nothing was seen it goes on as its ends
    ask; where nothing of a channel was seen at all it is 0, the mean pose.

    times : factors on a, of the root and of angles. counts : bool (frames,), false where a frame is
    left out.
    """
    believed = seen.believed if counts is None else seen.believed & counts[:, None]
    pushes = torch.full((seen.rows.shape[1],), PUSH_ANGLE * times[1]).double()
    levels = torch.full_like(pushes, max(noise.angle_rad, LEAST_ANGLE))
    pushes[ROOT], levels[ROOT] = PUSH_ROOT * times[0], max(noise.root_m, LEAST_ROOT)
    pushes *= (FPS / fps) ** 1.5  # pushes without a memory add up so
    return smooth_lines(seen.rows, believed, (levels / pushes).square())


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
            line = smooth(seen, noise, fps, (times, times), held != fold)
            gaps = ((seen.rows - line).square() * seen.believed)[held == fold]
            off[i] += torch.stack([gaps[:, ROOT].sum(), gaps[:, TURNS].sum()])
    enough = off <= (1 + NEARLY) * off.min(0).values
    root, angles = (FREEDOMS[i] for i in enough.int().argmax(0).tolist())  # the first that is
    return smooth(seen, noise, fps, (root, angles))
