"""Where a walker goes, and when and where its feet come down.

A `Course` is the way over the ground: speed and turn rate in, position, heading and gait phase out.
`plan` puts a foothold on the way for every stance. All of it is a function of continuous time on a grid of its own, so that the frame rate of the
motion does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import gaussian_filter1d

from ..errors import DataError
from . import gait_curves
from .gait_curves import GRAVITY, number

GRID = 240.0  # per second
PAD = 4.0  # seconds before and after, so that first and last frame lie within a stride
MAX_SPEED, MAX_TURN = 6.0, 4.0  # metres and radians a second
ACCELERATION = 2.0  # metres a second squared, at most
SMOOTHING = 0.2  # seconds, of speed and turn rate
RUN_FROUDE = 0.72  # walk changes to run here: 2.0 m/s for the canonical skeleton
MOVING = 0.08  # metres a second; slower is standing
TURN_EFFORT = 0.3  # metres: who turns on the spot steps as often as at this times the turn rate
SLOWEST_RATE = 0.7  # strides a second while moving
READY, SETTLED = 0.30, 0.12  # share of a cycle before a first toe-off and after a last strike
ANKLE_HEIGHT = 0.1  # metres over the floor when the foot is flat, as in the canonical T-pose
NARROWEST = 0.03  # leg lengths from the way to a foothold
LEAD, LAG = 0.40, 0.15  # seconds by which stepping starts before the body and ends after it


@dataclass(frozen=True)
class Course:
    """The way over the ground on the time grid, arrays (n,)."""

    time: np.ndarray  # seconds, from -PAD
    way: np.ndarray  # (n, 2): x and z, metres
    heading: np.ndarray  # radians about y; 0 faces +z, positive turns left
    speed: np.ndarray  # metres a second
    turn_rate: np.ndarray
    froude: np.ndarray  # Froude speed of the stepping, which turning on the spot needs too
    running: np.ndarray  # 0 walk, 1 run
    effort: np.ndarray  # 0 standing still .. 1 in full swing
    phase: np.ndarray  # gait cycles
    walks: tuple[tuple[int, int, bool, bool], ...]  # spans of stepping: start, stop, open at either

    def at(self, time: np.ndarray, name: str) -> np.ndarray:
        """One of the arrays, interpolated at `time`."""
        values = getattr(self, name)
        if values.ndim == 1:
            return np.interp(time, self.time, values)
        return np.stack([np.interp(time, self.time, column) for column in values.T], -1)


Signal = float | np.ndarray | Callable[[np.ndarray], np.ndarray]


def sample(signal: Signal, name: str, seconds: float, low: float, high: float) -> np.ndarray:
    """A number, an array over the motion or a function of time, on the grid, checked."""
    time = np.arange(-round(PAD * GRID), round((seconds + PAD) * GRID) + 1) / GRID
    inside = np.clip(time, 0, seconds)
    try:
        if callable(signal):
            values = np.broadcast_to(np.asarray(signal(inside), dtype=float), time.shape)
        else:
            values = np.asarray(signal, dtype=float)
            if values.ndim > 1 or values.size == 0:
                raise DataError(f"gaits: {name} has shape {values.shape}; give (values,).")
            spread = np.linspace(0, seconds, values.size)
            values = np.interp(inside, spread, np.atleast_1d(values))
    except (TypeError, ValueError) as error:
        raise DataError(
            f"gaits: {name} must be a number, an array over the motion, or a function of an array "
            f"of seconds ({error})."
        ) from error
    if not np.isfinite(values).all() or values.min() < low or values.max() > high:
        raise DataError(
            f"gaits: {name} goes from {values.min():g} to {values.max():g}; it must stay between "
            f"{low:g} and {high:g}."
        )
    return values


def lay_course(
    seconds: float,
    speed: Signal,
    turn_rate: Signal,
    leg: float,
    *,
    step_length: float | None = None,
    phase: float = 0.0,
    wobble: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Course:
    """The way for a speed and a turn rate. `wobble(time)` varies the stride rate by a share."""
    fast = sample(speed, "speed", seconds, 0.0, MAX_SPEED)
    turn = sample(turn_rate, "turn_rate", seconds, -MAX_TURN, MAX_TURN)
    time = np.arange(len(fast)) / GRID - round(PAD * GRID) / GRID
    # The fastest speed below the one asked for that nowhere changes faster than ACCELERATION.
    ramp = ACCELERATION * time
    fast = np.minimum.accumulate(fast - ramp) + ramp
    fast = (np.minimum.accumulate((fast + ramp)[::-1])[::-1]) - ramp
    fast = gaussian_filter1d(fast, SMOOTHING * GRID, mode="nearest")
    turn = gaussian_filter1d(turn, SMOOTHING * GRID, mode="nearest")

    zero = round(PAD * GRID)
    integral = lambda rate: cumulative_trapezoid(rate, dx=1 / GRID, initial=0)
    heading = integral(turn)
    heading -= heading[zero]
    way = np.stack([integral(fast * np.sin(heading)), integral(fast * np.cos(heading))], -1)
    way -= way[zero]

    stepping = np.hypot(fast, TURN_EFFORT * turn)
    froude = stepping / np.sqrt(GRAVITY * leg)
    running = 1 / (1 + np.exp(-(froude - RUN_FROUDE) / 0.02))
    running = gaussian_filter1d(running, 0.15 * GRID, mode="nearest")
    # Stands at MOVING, in full swing at a slow walk.
    effort = np.clip((stepping - MOVING) / 0.6, 0, 1)
    effort = gaussian_filter1d(effort**2 * (3 - 2 * effort), 0.1 * GRID, mode="nearest")
    if step_length is None:
        rate = gait_curves.stride_rate(froude, running) / np.sqrt(leg / GRAVITY)
    else:
        rate = stepping / (2 * step_length)
    if wobble is not None:
        rate = rate * (1 + wobble(time))
    rate = np.maximum(rate, SLOWEST_RATE)
    walks = _spans(stepping > MOVING)
    first_off = number("toe_off", froude[:1] * 0, running[:1] * 0)[0] - 0.5
    return Course(
        time, way, heading, fast, turn, froude, running, effort,
        _phase(rate, walks, zero, phase, first_off), walks,
    )  # fmt: skip


def _spans(moving: np.ndarray) -> tuple[tuple[int, int, bool, bool], ...]:
    """Spans of stepping as (start, stop, open at start, open at end) on the grid."""
    padded = np.concatenate([[False], moving, [False]])
    edges = np.flatnonzero(np.diff(padded.astype(int))).reshape(-1, 2)
    last = len(moving) - 1
    spans: list[list[int]] = []
    for start, stop in edges:
        start, stop = max(0, start - round(LEAD * GRID)), min(last, stop + round(LAG * GRID))
        if spans and start - spans[-1][1] < 0.3 * GRID:
            spans[-1][1] = stop  # too short a halt to set the feet side by side
        else:
            spans.append([start, stop])
    return tuple((start, stop, start == 0, stop == last) for start, stop in spans)


def _phase(rate: np.ndarray, walks: tuple, zero: int, phase: float, first_off: float) -> np.ndarray:
    """Gait phase on the grid: the integral of the stride rate, fitted to starts and stops.

    A walk that starts within the motion starts READY before a toe-off; one that ends within it ends
    SETTLED after a strike, so that its last step brings the feet side by side.
    """
    result = np.full(len(rate), float(phase))
    half = lambda value: np.round(value * 2) / 2
    for start, stop, open_start, open_end in walks:
        gain = cumulative_trapezoid(rate[start : stop + 1], dx=1 / GRID, initial=0)
        before = result[start]
        if open_start:
            result[start : stop + 1] = phase + gain - gain[np.clip(zero, start, stop) - start]
            if not open_end:
                excess = result[stop] - SETTLED
                result[start : stop + 1] -= excess - half(excess)
        else:
            begin = first_off - READY
            begin += half(before - begin)
            if not open_end:
                steps = max(2, round(2 * (begin + gain[-1] - SETTLED - half(begin))))
                gain *= (half(begin) + steps / 2 + SETTLED - begin) / gain[-1]
            result[start : stop + 1] = begin + gain
        result[stop + 1 :] = result[stop]
    return result


@dataclass(frozen=True)
class Steps:
    """All swings of one foot, arrays (steps,); foothold i is left by swing i and i + 1 follows."""

    side: int  # 1 left, -1 right
    heel_off: np.ndarray  # seconds
    toe_off: np.ndarray
    strike: np.ndarray
    flat: np.ndarray
    ankle: np.ndarray  # (steps + 1, 2): x and z of the ankle on each foothold
    yaw: np.ndarray  # (steps + 1,)


def plan(
    course: Course,
    side: int,
    leg: float,
    stand_width: float,
    stand_ahead: float,
    jitter: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Steps:
    """Footholds of one foot: side +1 is left, -1 right.

    The foot is put down where the way will be at the middle of its stance.
    """
    lag = 0.0 if side > 0 else 0.5
    times: list[tuple[float, float, float, float]] = []
    fractions = {
        name: number(name, course.froude, course.running)
        for name in ("flat", "heel_off", "toe_off")
    }
    for start, stop, *_ in course.walks:
        span = slice(start, stop + 1)
        time, phase = course.time[span], course.phase[span] - lag
        when = {
            name: np.maximum.accumulate(phase - fraction[span])
            for name, fraction in fractions.items()
        }
        for cycle in range(int(np.floor(phase[0])) - 1, int(np.ceil(phase[-1])) + 2):
            if not when["heel_off"][0] < cycle or not when["flat"][-1] > cycle + 1:
                continue  # this swing would begin before the walk or end after it
            times.append(
                (
                    np.interp(cycle, when["heel_off"], time),
                    np.interp(cycle, when["toe_off"], time),
                    np.interp(cycle + 1, phase, time),
                    np.interp(cycle + 1, when["flat"], time),
                )
            )
    heel_off, toe_off, strike, flat = np.array(times).reshape(-1, 4).T
    # Stances lie between swings; the first and the last reach to the ends of the grid.
    begin = np.concatenate([course.time[:1], strike])
    end = np.concatenate([toe_off, course.time[-1:]])
    middle = (begin + end) / 2
    heading, froude = course.at(middle, "heading"), course.at(middle, "froude")
    running, effort = course.at(middle, "running"), course.at(middle, "effort")
    aside = np.maximum(number("aside", froude, running), NARROWEST) * leg
    aside = stand_width + effort * (aside - stand_width)
    ahead = stand_ahead + effort * (number("ahead", froude, running) * leg - stand_ahead)
    if jitter is not None:
        aside = aside + 0.008 * jitter(middle)
        ahead = ahead + 0.012 * jitter(middle + 100)
    forward = np.stack([np.sin(heading), np.cos(heading)], -1)
    left = np.stack([np.cos(heading), -np.sin(heading)], -1)
    ankle = course.at(middle, "way") + ahead[:, None] * forward + side * aside[:, None] * left
    toe_out = 0.13 - 0.07 * effort * (1 + running) / 2
    return Steps(side, heel_off, toe_off, strike, flat, ankle, heading + side * toe_out)
