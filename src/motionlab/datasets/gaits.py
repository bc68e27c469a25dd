"""Procedural walking and running: motion with exact contacts, made from a few numbers.

The default data set of the book, and the oracle of its tests: speed, turn rate and contacts of a
made motion are known. Feet are planned on the ground and held there by inverse kinematics; pelvis,
trunk, arms and the feet's way through the air follow Fourier series fitted to motion capture of one
actor by ACCAD Motion Lab, The Ohio State University (CC BY 3.0), see `gait_curves`.

    motion = gaits.make(seconds=5, speed=1.4, turn_rate=0.3)
    motion = gaits.make(seconds=8, speed=[0, 0, 1.4, 1.4, 3.5, 3.5])   # stand, walk, run

Contacts are labels of `Motion.contacts`: left heel (ankle joint), left toe (toe joint), right heel,
right toe. A label is true in a frame if and only if the joint rests in place at that instant: it
came to rest at or before it and leaves at or after it. Between two successive frames that carry the
label within one stance the joint therefore does not move (float rounding aside, far below 1 mm). A foot that strikes
with the heel rests on the ankle while the toes come down; one that strikes with the fore-foot rests
on the toes; before toe-off the ankle turns about the resting toes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from ..errors import DataError
from ..motion import Motion
from .footsteps import Signal, lay_course, plan
from .gait_body import SIDES, STAND_AHEAD, STAND_ASIDE, TICKS, Body, Pose, Style, assemble, sink
from .swings import Foot, travel


def make(
    *,
    seconds: float = 6.0,
    speed: Signal = 1.3,
    turn_rate: Signal = 0.0,
    step_length: float | None = None,
    bounce: float = 1.0,
    arm_swing: float = 1.0,
    lean: float = 0.0,
    noise: float = 1.0,
    phase: float | None = None,
    fps: float = 30.0,
    seed: int | torch.Generator = 0,
    name: str = "",
) -> Motion:
    """A person standing, walking and running on `Skeleton.canonical`.

    Parameters
    ----------
    seconds : duration.
    speed : metres a second, 0 to 6; a number, an array of values at equal distances of time over
        the whole motion, or a function of an array of seconds. It is smoothed to what a person can
        do (at most 2 m/s²). From 0 the body starts with feet side by side, to 0 it stops so.
        Walks change to runs near 2 m/s.
    turn_rate : radians a second, positive to the left; like `speed`.
    step_length : metres from one foot to the other; the default follows from the speed.
    bounce, arm_swing : factors on the fitted up-and-down and on the swing of the arms.
    lean : radians by which the trunk leans forward, besides what the gait asks for.
    noise : factor on the small irregularities of cadence, footholds and swing; 0 is a machine.
    phase : gait phase at time 0 in cycles (0: left foot strikes, 0.5: right); None draws it.
    fps : frames per second. The motion itself does not depend on it.
    seed : an integer or a `torch.Generator`; the same gives the same motion.

    Returns
    -------
    Motion : with `contacts`, starting at the origin towards +z.

    Raises
    ------
    DataError : an argument is out of range or not a number.
    """
    _check(seconds, fps, step_length, bounce, arm_swing, lean, noise, phase)
    style = Style.draw(seed, noise, phase)
    body = Body.canonical()
    course = lay_course(
        seconds,
        speed,
        turn_rate,
        body.leg,
        step_length=step_length,
        phase=style.phase,
        wobble=lambda time: 0.015 * style.wave(time, 0),
    )
    steps = {
        side: plan(
            course,
            sign,
            body.leg,
            body.hip_width + STAND_ASIDE,
            STAND_AHEAD,
            lambda when, sign=sign: style.wave(6 * when, 3 + sign),
        )
        for side, sign in SIDES.items()
    }

    def moment(time: np.ndarray) -> tuple[Pose, dict[str, Foot]]:
        pose = Pose.at(course, time, style, bounce=bounce, arm_swing=arm_swing, lean=lean)
        feet = {
            side: travel(course, steps[side], time, body.sole, body.toe_length, body.leg)
            for side in SIDES
        }
        return pose, feet

    # How far the legs pull the body down is smoothed over time, at a rate of its own.
    ticks = np.arange(-0.25, seconds + 0.25, 1 / TICKS)
    down = sink(body, *moment(ticks), course.at(ticks, "running"))
    time = np.arange(max(1, round(seconds * fps))) / fps
    pose, feet = moment(time)
    pose.root[:, 1] -= CubicSpline(ticks, down)(time)
    return assemble(body, pose, feet, fps, name)


def load(split: str | None = None) -> list[Motion]:
    """The data set "gaits": walks, runs, turns, starts, stops and changes of gait, at 30 fps."""
    return [
        motion for motion, its in zip(_catalogue(), splits(), strict=True) if split in (None, its)
    ]


def splits() -> list[str]:
    """Split of each clip: of every ten, one validates, one tests and eight train."""
    kinds = {4: "val", 9: "test"}
    return [kinds.get(i % 10, "train") for i in range(len(CATALOGUE))]


def _clip(name: str, **options) -> tuple[str, dict]:
    return name, options


def _ramp(*knots: tuple[float, float]) -> Callable[[np.ndarray], np.ndarray]:
    times, values = zip(*knots, strict=True)
    return lambda time: np.interp(time, times, values)


# The clips of the data set; the seed of each is its place in the list.
CATALOGUE = (
    *(_clip(f"walk_{v:.1f}", speed=v) for v in (0.6, 0.8, 1.0, 1.2, 1.3, 1.4, 1.6, 1.8)),
    *(_clip(f"run_{v:.1f}", speed=v) for v in (2.2, 2.6, 3.0, 3.5, 4.0, 5.0)),
    *(
        _clip(f"walk_{v:.1f}_turn_{side}_{abs(w):.1f}", speed=v, turn_rate=w)
        for v, w0 in ((0.8, 0.5), (1.1, 0.8), (1.3, 0.3), (1.5, 0.5))
        for side, w in (("left", w0), ("right", -w0))
    ),
    *(
        _clip(f"run_{v:.1f}_turn_{side}_{abs(w):.1f}", speed=v, turn_rate=w)
        for v, w0 in ((2.6, 0.6), (3.5, 0.4))
        for side, w in (("left", w0), ("right", -w0))
    ),
    _clip("walk_weave", speed=1.2, turn_rate=lambda t: 0.8 * np.sin(2 * np.pi * t / 5), seconds=8),
    _clip("stand", speed=0.0),
    _clip("start_1.3", speed=_ramp((1.5, 0), (2.5, 1.3))),
    _clip("stop_1.3", speed=_ramp((3.0, 1.3), (4.0, 0))),
    _clip("start_run_3.0", speed=_ramp((1.0, 0), (3.0, 3.0)), seconds=5),
    _clip("run_3.0_stop", speed=_ramp((1.5, 3.0), (3.5, 0)), seconds=5),
    _clip("walk_to_run", speed=_ramp((2.5, 1.4), (4.0, 3.2))),
    _clip("run_to_walk", speed=_ramp((2.0, 3.2), (3.5, 1.4))),
    _clip(
        "go_and_halt", speed=_ramp((1, 0), (2, 1.2), (4, 1.2), (5, 0), (6, 0), (7, 1)), seconds=8
    ),
    _clip("walk_leaning", speed=1.3, lean=0.15),
    _clip("walk_bouncy", speed=1.2, bounce=1.6, arm_swing=1.4),
    _clip("walk_stiff_arms", speed=1.1, arm_swing=0.25),
    _clip("walk_short_steps", speed=0.9, step_length=0.42),
    _clip("walk_long_steps", speed=1.4, step_length=0.75),
)


@cache
def _catalogue() -> tuple[Motion, ...]:
    clips = enumerate(CATALOGUE)
    return tuple(make(name=name, seed=seed, **options) for seed, (name, options) in clips)


def _check(seconds, fps, step_length, bounce, arm_swing, lean, noise, phase) -> None:
    allowed = {
        "seconds": (seconds, 0.0, 3600.0, False),
        "fps": (fps, 0.0, 10000.0, False),
        "step_length": (0.5 if step_length is None else step_length, 0.1, 2.5, True),
        "bounce": (bounce, 0.0, 3.0, True),
        "arm_swing": (arm_swing, 0.0, 3.0, True),
        "lean": (lean, -0.5, 0.8, True),
        "noise": (noise, 0.0, 3.0, True),
        "phase": (0.0 if phase is None else phase, -1e6, 1e6, True),
    }
    for name, (value, low, high, closed) in allowed.items():
        number = isinstance(value, int | float | np.number) and math.isfinite(value)
        if not number or not (low <= value <= high) or (value == low and not closed):
            least = "at least" if closed else "more than"
            raise DataError(
                f"gaits: {name} is {value!r}; it must be a number {least} {low:g} and at most "
                f"{high:g}."
            )
