"""How a foot goes from one foothold to the next: off the toes, through the air, onto the heel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .footsteps import ANKLE_HEIGHT, Course, Steps
from .gait_curves import clamped_basis, clamped_slope, coefficients

CLEARANCE = 0.012  # metres, of the toes in mid-swing


@dataclass(frozen=True)
class Foot:
    """One foot over time, arrays (n,): all an IK solver has to know."""

    ankle: np.ndarray  # (n, 3) metres
    yaw: np.ndarray
    pitch: np.ndarray  # radians, positive with the toes up
    toe_pitch: np.ndarray  # of the toes, in the world
    contacts: np.ndarray  # (n, 2) bool: heel, toe


def travel(
    course: Course, steps: Steps, time: np.ndarray, sole: np.ndarray, tip: float, leg: float
) -> Foot:
    """Move one foot along its steps.

    A swing has three stages: 0..1 the heel leaves the floor while the toes stay, 1..2 through the
    air, 2..3 from strike to flat. After a strike with the heel the ankle stays where it is and the
    toes come down; after one with the fore-foot the toes stay and the heel comes down.

    sole : (3,) metres, from ankle to toe joint of a flat foot that faces +z.
    tip : metres, from toe joint to the tip of the toes.
    """
    count = len(steps.heel_off)
    index = np.searchsorted(steps.heel_off, time, side="right") - 1  # swing begun last, -1: none
    hold = np.clip(index + 1, 0, count)
    ankle = np.stack(
        [steps.ankle[hold, 0], np.full(len(time), ANKLE_HEIGHT), steps.ankle[hold, 1]], -1
    )
    yaw = steps.yaw[hold].copy()
    pitch, toe_pitch = np.zeros(len(time)), np.zeros(len(time))
    contacts = np.ones((len(time), 2), dtype=bool)
    down = np.concatenate([[-np.inf], steps.flat])[index + 1]
    busy = np.flatnonzero(time < down)
    if len(busy) == 0:
        return Foot(ankle, yaw, pitch, toe_pitch, contacts)

    which, now = index[busy], time[busy]
    marks = np.stack([steps.heel_off, steps.toe_off, steps.strike, steps.flat], -1)
    stage = stages(marks[which], now)
    air = np.clip(stage - 1, 0, 1)
    shape = _Swing.of(course, steps, leg)
    tilt = shape.pitch(which, stage)
    turn = steps.yaw[which] + (steps.yaw[which + 1] - steps.yaw[which]) * ease(air)

    level = lambda points, height: np.insert(points, 1, height, axis=-1)
    before = level(steps.ankle[which], ANKLE_HEIGHT)
    after = level(steps.ankle[which + 1], ANKLE_HEIGHT)
    old_toe = before + turned(sole, steps.yaw[which], 0 * tilt)
    new_toe = after + turned(sole, steps.yaw[which + 1], 0 * tilt)
    heel_first = shape.strike_pitch[which] > 0
    landing = np.where(
        heel_first[:, None],
        after + turned(sole, steps.yaw[which + 1], shape.strike_pitch[which]),
        new_toe,
    )
    # Speed of the toes at the strike, per stage: they turn about the resting ankle.
    small = 1e-4
    later = turned(
        sole, steps.yaw[which + 1], shape.strike_pitch[which] + small * shape.strike_rate[which]
    )
    still = turned(sole, steps.yaw[which + 1], shape.strike_pitch[which])
    falling = np.where(heel_first[:, None], (later - still) / small, 0.0)
    toes = shape.toes(which, air, old_toe, landing, falling, leg)
    toes = np.where((stage <= 1)[:, None], old_toe, toes)
    toes = np.where((stage >= 2)[:, None] & ~heel_first[:, None], new_toe, toes)
    ankle[busy] = toes - turned(sole, turn, tilt)
    rolling = (stage >= 2) & heel_first
    ankle[busy[rolling]] = after[rolling]
    toes[rolling] = after[rolling] + turned(sole, turn[rolling], tilt[rolling])

    # Toes lie on the floor until toe-off, then straighten as far as the floor lets them.
    lowest = -np.arcsin(np.clip((toes[:, 1] - 0.008) / tip, 0, 1))
    straight = tilt * ease(air / 0.5)
    bent = (straight + lowest + np.sqrt((straight - lowest) ** 2 + 1e-3)) / 2
    bent = np.where(stage >= 1, bent * ease(air / 0.2), 0.0)
    bent = np.where((stage >= 2) & ~heel_first, tilt * (1 - ease(stage - 2)), bent)
    yaw[busy], pitch[busy], toe_pitch[busy] = turn, tilt, bent
    contacts[busy, 0] = rolling
    contacts[busy, 1] = (stage <= 1) | ((stage >= 2) & ~heel_first)
    return Foot(ankle, yaw, pitch, toe_pitch, contacts)


@dataclass(frozen=True)
class _Swing:
    """Fitted shape of each swing."""

    slope: np.ndarray  # (steps, CLAMPED) coefficients of the pitch over the three stages
    path: np.ndarray  # (steps, CLAMPED, 3) of the toes' way through the air
    strike_pitch: np.ndarray  # (steps,) radians
    strike_rate: np.ndarray  # radians a stage
    yaw: np.ndarray  # (steps,) direction of the swing

    @staticmethod
    def of(course: Course, steps: Steps, leg: float) -> _Swing:
        froude, running = course.at(steps.toe_off, "froude"), course.at(steps.toe_off, "running")
        froude = np.maximum(froude, course.at(steps.strike, "froude"))
        stride = np.linalg.norm(np.diff(steps.ankle, axis=0), axis=-1)
        # Steps shorter than those of a slow walk lift the foot less.
        size = np.clip(stride / (0.9 * leg), 0.25, 1)
        slope = coefficients("curves", "foot_pitch", froude, running)[..., 0] * size[:, None]
        path = coefficients("curves", "toes_path", froude, running) * size[:, None, None]
        path[..., 0] *= steps.side  # fitted to left feet
        pitch = (clamped_basis(2 / 3) * slope).sum(-1)
        pitch = np.clip(pitch, -0.15, 0.35)
        yaw = (steps.yaw[1:] + steps.yaw[:-1]) / 2
        return _Swing(slope, path, pitch, -1.5 * pitch, yaw)

    def pitch(self, which: np.ndarray, stage: np.ndarray) -> np.ndarray:
        slope = self.slope[which]
        value = (clamped_basis(stage / 3) * slope).sum(-1)
        end = (clamped_basis(2 / 3) * slope).sum(-1)
        rate = (clamped_slope(2 / 3) * slope).sum(-1) / 3
        # Over the last half of the air, bend the fit to what the strike asks for.
        s = np.clip((stage - 1.5) / 0.5, 0, 1)
        value += (self.strike_pitch[which] - end) * s**2 * (3 - 2 * s)
        value += (self.strike_rate[which] - rate) * 0.5 * s**2 * (s - 1)
        s = np.clip(stage - 2, 0, 1)
        landing = self.strike_pitch[which] * (2 * s**3 - 3 * s**2 + 1)
        landing += self.strike_rate[which] * s * (1 - s) ** 2
        value = np.where(stage < 2, value, landing)
        return np.where(stage < 1, np.minimum(value, 0), value)

    def toes(self, which, air, start, end, end_rate, leg) -> np.ndarray:
        """Way of the toe joint: from rest to its speed at the strike, with the fitted bend."""
        s = air[:, None]
        ramp = s**2 * (3 - 2 * s)
        way = start + ramp * (end - start) + end_rate * s**2 * (s - 1)
        bend = np.einsum("nk,nkc->nc", clamped_basis(air), self.path[which]) * leg
        way += turned(bend, self.yaw[which], 0 * air)
        # Smoothly no lower than the clearance; nothing at the ends, where the toes rest or roll.
        window = (4 * air * (1 - air)) ** 2
        least = np.minimum(start[:, 1], end[:, 1]) + CLEARANCE * window
        over = way[:, 1] - least
        way[:, 1] = least + (over + np.sqrt(over**2 + (0.01 * window) ** 2)) / 2
        return way


def stages(marks: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Monotone C1 map of time to 0..3 that takes each row of marks (n, 4) to 0, 1, 2, 3."""
    width = np.diff(marks, axis=-1)
    rate = 1 / width
    inner = 2 * rate[:, :-1] * rate[:, 1:] / (rate[:, :-1] + rate[:, 1:])
    slope = np.concatenate([rate[:, :1], inner, rate[:, -1:]], -1)
    piece = np.clip((now[:, None] >= marks[:, 1:3]).sum(-1), 0, 2)
    row = np.arange(len(now))
    h = width[row, piece]
    s = np.clip((now - marks[row, piece]) / h, 0, 1)
    bump = slope[row, piece] * h * s * (1 - s) ** 2 + slope[row, piece + 1] * h * s**2 * (s - 1)
    return piece + s**2 * (3 - 2 * s) + bump


def ease(x: np.ndarray) -> np.ndarray:
    """From 0 to 1 with x, level at both ends."""
    x = np.clip(x, 0, 1)
    return x**2 * (3 - 2 * x)


def turned(vector: np.ndarray, yaw: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """A vector (3,) or (n, 3) pitched (toes up), then turned about y: (n, 3)."""
    x, y, z = np.moveaxis(np.broadcast_to(vector, (len(yaw), 3)), -1, 0)
    y, z = y * np.cos(pitch) + z * np.sin(pitch), z * np.cos(pitch) - y * np.sin(pitch)
    return np.stack([z * np.sin(yaw) + x * np.cos(yaw), y, z * np.cos(yaw) - x * np.sin(yaw)], -1)
