"""What is measured of steered motion, and of people: the same of both, so that times compare.

Where somebody goes and how fast is told by the chord of a second about each frame, in which sway
cancels. So a turn, a start and a stop seem half a second longer than they are, ours and people's alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from motionlab import Motion, metrics
from motionlab.encodings import JointAngles
from motionlab.feet.contacts import foot_points
from motionlab.solvers.live_going import wrapped

SETTLED = 0.5  # seconds that must be kept
WITHIN, FACING, SPEED = 10.0, 15.0, 0.1  # degrees of travel, of facing, and share of the speed
STANDS = 1.5  # seconds after which a stop must stand
ASTRAY, GLIDES = 0.75, 0.6  # m/s above what is asked, and of a foot that does not rest
CHORD = 1.0  # seconds
SLOWEST = 4.0  # seconds; who takes longer does not turn, but walks a curve


class Travel(NamedTuple):
    """Of each frame (frames,): way in radians, speed in m/s by chord, and from frame to frame."""

    way: Tensor
    speed: Tensor
    instant: Tensor


def travel(root: Tensor, fps: float) -> Travel:
    """Of a root (frames, 3)."""
    ground = root[:, [0, 2]].double()
    half = round(CHORD * fps / 2)
    first = (torch.arange(len(ground)) - half).clamp(min=0)
    last = (torch.arange(len(ground)) + half).clamp(max=len(ground) - 1)
    chord = (ground[last] - ground[first]) * fps / (last - first)[:, None]
    steps = torch.cat([ground[1:2] - ground[:1], ground.diff(dim=0)])
    return Travel(torch.atan2(chord[:, 0], chord[:, 1]), chord.norm(dim=1), fps * steps.norm(dim=1))


def first_kept(held: Tensor, fps: float) -> float:
    """Seconds until something (frames,) has begun to hold for `SETTLED`; infinite if it never does."""
    frames = round(SETTLED * fps)
    if len(held) < frames:
        return math.inf
    kept = held.double().unfold(0, frames, 1).amin(1).nonzero()[:, 0]
    return float(kept[0]) / fps if len(kept) else math.inf


# -- a script's last command, and what came of it ---------------------------------------------------


def turned(motion: Motion, frame: int, direction: float, speed: float) -> dict[str, float]:
    """How a character turned who was asked for a direction, radians, in a frame."""
    root, fps = motion.root_positions, motion.fps
    its, points = travel(root, fps), motion.positions()
    off = wrapped(its.way - direction)[frame:].rad2deg()
    facing = metrics.facing(points, motion.skeleton).double()
    smooth = torch.stack([facing.sin(), facing.cos()])
    kernel = torch.ones(1, 1, round(fps) | 1, dtype=torch.double)
    smooth = torch.nn.functional.conv1d(smooth[:, None], kernel, padding=kernel.shape[-1] // 2)[
        :, 0
    ]
    faced = wrapped(torch.atan2(*smooth) - direction)[frame:].rad2deg().abs()
    settled = first_kept(off.abs() <= WITHIN, fps)
    after = off[round(settled * fps) :] if math.isfinite(settled) else off[-round(fps) :]
    began = off[0] if abs(off[0]) < 179 else off[1:3].mean()
    past = (-torch.sign(began) * after).amax().clamp(min=0)
    pace = its.speed[frame:][-len(after) :]
    return {
        "settled (s)": settled,
        "settled by facing (s)": first_kept(faced <= FACING, fps),
        "direction error (°)": float(after.abs().mean()),
        "facing error (°)": float(faced[-len(after) :].mean()),
        "speed error": float((pace.mean() / speed - 1).abs()),
        "overshoot (°)": float(past),
    }


def paced(motion: Motion, frame: int, speed: float, until: int | None = None) -> dict[str, float]:
    """How a character came to a speed, m/s, that he was asked for in a frame, before another one."""
    its = travel(motion.root_positions, motion.fps)
    pace = its.speed[frame:until]
    settled = first_kept((pace / speed - 1).abs() <= SPEED, motion.fps)
    after = pace[round(settled * motion.fps) :] if math.isfinite(settled) else pace[-15:]
    before = its.speed[max(frame - 30, 0) : frame].mean()
    past = torch.sign(speed - before) * (after - speed)
    return {
        "settled (s)": settled,
        "speed error": float((after.mean() / speed - 1).abs()),
        "overshoot (m/s)": float(past.amax().clamp(min=0)),
    }


def stopped(motion: Motion, frame: int) -> dict[str, float]:
    """How a character stands who was asked to in a frame."""
    instant = travel(motion.root_positions, motion.fps).instant[frame:]
    left = instant[round(STANDS * motion.fps) :]
    calm = first_kept(instant <= 0.1, motion.fps)
    return {"left (m/s)": float(left.mean()), "settled (s)": calm}


# -- random commands, and what became of who was given them ----------------------------------------


def ends(
    encoding: JointAngles, features: Tensor, bad: Tensor, asked: Tensor
) -> tuple[dict[str, Tensor], Tensor]:
    """Who (characters,) is no body any more, and in what way; and who glides when.

    Parameters
    ----------
    features : (characters, frames, dim), raw units; bad : bool (characters, frames), broken poses.
    asked : (characters, frames) m/s.

    Returns
    -------
    "fallen" holds broken poses for half a second; "frozen" moves by less than 0.1 m/s in seconds 3 and
    4 of four in which 0.5 or more is asked; "astray" goes faster than ever asked in those seconds by
    `ASTRAY`; "glided" went a second without that any part of its feet rested. And that, bool (characters,
    seconds).
    """
    fps = encoding.fps
    half, slow = round(fps / 2), round(2 * fps)
    fallen = bad.double().unfold(1, half, 1).amin(2).amax(1) > 0
    root = encoding.root_path(features)[..., [0, 2]].diff(dim=1).norm(dim=-1) * fps
    pace = root.unfold(1, slow, 1).mean(2)[:, slow:]
    wishes = asked[:, 1:].unfold(1, 2 * slow, 1)[:, : pace.shape[1]]
    pace = pace[:, : wishes.shape[1]]
    frozen = ((wishes.amin(2) >= 0.5) & (pace < 0.1)).any(1)
    astray = (pace > wishes.amax(2) + ASTRAY).any(1)
    glides = torch.stack([gliding(encoding, each) for each in features])
    return {"fallen": fallen, "frozen": frozen, "astray": astray, "glided": glides.any(1)}, glides


def gliding(encoding: JointAngles, features: Tensor) -> Tensor:
    """Whether in a second (seconds,) no part of the feet of features (frames, dim) was ever slower
    than `GLIDES`: no recorded clip of the validation split has one."""
    fps = encoding.fps
    feet = encoding.positions(features)[:, foot_points(encoding.skeleton)][..., [0, 2]]
    slowest = (feet.diff(dim=0).norm(dim=-1) * fps).amin(1)
    return slowest.unfold(0, round(fps), round(fps)).amin(1) > GLIDES


# -- people's own times -----------------------------------------------------------------------------


def own_turns(
    clips: Sequence[Tensor], fps: float, degrees: float, speeds: tuple[float, float]
) -> list[float]:
    """Seconds that people take to turn by so many degrees, give or take 15: from the last frame within
    10° of the way that they have kept to the first of those that keep within 10° of the new one.

    clips : roots (frames, 3). speeds : m/s, between which they go before.
    """
    found, keep, longest = [], round(SETTLED * fps), round(SLOWEST * fps)
    for root in clips:
        its = travel(root, fps)
        if len(root) < 3 * keep:
            continue
        way, pace = its.way, (its.speed > speeds[0]) & (its.speed < speeds[1])
        spans = wrapped(way.unfold(0, keep, 1) - way[keep - 1 :, None]).abs().rad2deg()
        steady = spans.amax(1) <= WITHIN  # of the half second that ends `keep` - 1 frames later
        held = steady & pace.unfold(0, keep, 1).all(1)
        leaves = held[:-1] & ~steady[1:]  # the last frame of a way that was kept
        next_free = 0
        for i in (leaves.nonzero()[:, 0] + keep - 1).tolist():
            again = steady[i + 1 : i + longest].nonzero()[:, 0]  # where a way is kept once more
            if i < next_free or not len(again):
                continue
            j = i + 1 + int(again[0])
            new = way[j + keep - 1]
            if (wrapped(new - way[i]).abs().rad2deg() - degrees).abs() <= 15:
                near = wrapped(way[i : j + keep] - new).abs().rad2deg() <= WITHIN
                left = (wrapped(way[i : j + keep] - way[i]).abs().rad2deg() > WITHIN).nonzero()[
                    0, 0
                ]
                there = int((~near).nonzero()[-1, 0]) + 1
                found.append((there - int(left)) / fps)
                next_free = j
    return found


def own_changes(clips: Sequence[Tensor], fps: float, before: float, after: float) -> list[float]:
    """Seconds that people take from one speed, m/s, to another, from 10 % of the way to 90 % of it."""
    low, high = before + 0.1 * (after - before), before + 0.9 * (after - before)
    rises, found = after > before, []
    for root in clips:
        speed = travel(root, fps).speed
        begun = (speed < low) if rises else (speed > low)
        done = (speed > high) if rises else (speed < high)
        leaving = (begun[:-1] & ~begun[1:]).nonzero()[:, 0]
        for i in leaving.tolist():
            there = done[i : i + round(SLOWEST * fps)].nonzero()[:, 0]
            if len(there) and not begun[i + 1 : i + int(there[0])].any():
                found.append(float(there[0]) / fps)
    return found
