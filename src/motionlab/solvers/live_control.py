"""Steering live (RNN-GAN, section 5.3): characters who do what they are asked while they are asked it.

Five frames at a time::

    live = LiveControl("lstm-gmm-contacts", "walk", refiner=motionlab.load("refiner-contacts"), lock=True)
    live.steer(speed=1.2, direction=0.0)
    for _ in range(12):
        (motion,) = live.go_on()     # the next 5 frames
    live.steer(direction=math.pi / 2)

Windows of 5 frames, the paper's: what is asked counts from the next window on. One of three ways
(`live_ways`) answers a window. What nobody in the data can do is done as nearly as can be, and said.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Mapping, Sequence
from numbers import Integral, Real

import torch
from torch import Tensor, nn

from ..errors import SolverError
from ..models import Refiner
from ..models.sampler import Chance
from ..motion import Motion, concatenate
from ..paths import Curves, Path
from ..weights import load
from .design import checked, fastest_of
from .energy import Before
from .guided import Going
from .live_aim import STILL, Aim
from .live_feet import Behind
from .live_frame import Gliding
from .live_going import wrapped
from .live_ways import WAYS, How, Window, answer
from .run_up import begin_with
from .windows import STRANGE

WINDOW, FUTURES, STEPS = 5, 16, 8
MOST = 64  # futures
CALMER = 0.6  # of the temperature at which a model ships: who is steered needs less chance
KEPT = 600.0  # seconds that `motion` remembers
DUE = 2.0  # seconds after a wish; what is not met by then is said
SLOWER, ASTRAY = 0.15, 20.0  # share of the speed, and degrees: what is said


class LiveControl:
    """Characters on the ground who are steered.

    Parameters
    ----------
    model : name of shipped weights, or an LstmGmm on `JointAngles`.
    start : what they do at first, and with it their style: number or beginning of the name of one of
        the model's starts, or a motion; or a list, one of these for each character. None: a walk.
    characters : how many; they cost less together.
    way : "futures", "push" or "gradient", see `live_ways`.
    futures : K, from 1 to 64, samples of which the best is kept; with "gradient" those that the first
        guess is chosen from.
    window : frames that are decided at a time.
    steps : of a gradient in each.
    budget : evaluations in a window at most, of futures and gradients together.
    seconds : time for a window; the best that there is then is given. The first few futures always are.
    refiner : corrects the frames behind that.
    lock : holds feet still, a few frames later.
    places : (characters, 3), x, z in metres and yaw in radians where they begin; None: at 0.
    temperature : of the samples; None: 0.6 of the model's own.
    weights : of the terms of a gradient, by name: "prior", "noise", "speed", "direction", "contact",
        "resting", "poses".
    seed : of all chance.

    Raises
    ------
    SolverError : settings that make no sense, no such start, or a model that can't be steered.
    """

    def __init__(
        self,
        model: str | nn.Module = "lstm-gmm-contacts",
        start: str | int | Motion | Sequence | None = None,
        characters: int = 1,
        *,
        way: str = "futures",
        futures: int = FUTURES,
        window: int = WINDOW,
        steps: int = STEPS,
        budget: int | None = None,
        seconds: float | None = None,
        refiner: Refiner | None = None,
        lock: bool = False,
        places: Tensor | Sequence | None = None,
        temperature: float | None = None,
        weights: Mapping[str, float] | None = None,
        seed: int = 0,
    ) -> None:
        self.model = model = checked(load(model) if isinstance(model, str) else model, refiner)
        self.count = characters = _whole("characters", characters, 1, 100_000)
        sampling = dict(getattr(model, "sampling", {}))
        usual = CALMER * sampling.get("temperature", 1.0)
        sampling["temperature"] = usual if temperature is None else temperature
        chance = Chance(torch.Generator().manual_seed(seed), **sampling)
        self.how = _how(way, futures, window, steps, budget, seconds, chance, weights)
        self.fastest, self.fps = fastest_of(model), model.fps
        state = _begun(model, start, characters)
        place = _places(places, characters)
        self.home = state
        self.before = Before(state, state.frame, place)
        self.going = Going.of(model.fps, place, state.frame[:, None, :3])
        self.aim = Aim.none(self.going)
        self.gliding = Gliding(model, characters)
        self.behind = Behind(model.encoding, state.frame, place, refiner, lock)
        keep = max(1, round(KEPT * model.fps / window))
        self.kept: list[deque[Motion]] = [deque(maxlen=keep) for _ in range(characters)]
        self.times: deque[float] = deque(maxlen=1000)
        self.evaluations, self.frames = 0, 0
        self.asked_at = torch.zeros(characters, dtype=torch.long)  # frames
        self.fast = torch.zeros(characters, dtype=torch.double)  # m/s that were asked for in vain
        self.lost = [0] * characters

    # -- what is asked ------------------------------------------------------------------------------

    def steer(
        self,
        speed: float | Tensor | None = None,
        direction: float | Tensor | None = None,
        *,
        target: Tensor | Sequence | None = None,
        path: Path | None = None,
        who: int | Sequence[int] | None = None,
    ) -> None:
        """What is asked from the next window on, until something else is asked.

        Parameters
        ----------
        speed : m/s over the ground, 0 or more; 0: stand. One, or one for each. None: as before.
        direction : radians, which way to go, 0 along z and π/2 along x. None: as before.
        target : (2,) or (characters, 2) metres, x and z: go there and stand.
        path : go along it from its beginning, and stand at its end; without times.
        who : number or numbers of the characters that are meant; None: all.

        Raises
        ------
        SolverError : a NaN, a negative speed, a direction and a target at once, no such character.
            Nothing is changed then.
        """
        if sum(each is not None for each in (direction, target, path)) > 1:
            raise SolverError("steer: one of direction, target and path; they exclude each other.")
        if path is not None and (not isinstance(path, Path) or path.times is not None):
            raise SolverError("steer: path must be a motionlab.paths.Path without times.")
        rows = self._rows(who)
        speed, direction = (_numbers(name, value, len(rows)) for name, value in
                            (("speed", speed), ("direction", direction)))  # fmt: skip
        target = None if target is None else _numbers("target", target, len(rows), 2)
        if speed is not None and (speed < 0).any():
            raise SolverError(f"steer: speed is {float(speed.min()):g} m/s; it must be 0 or more.")
        aim = self.aim[torch.arange(self.count)]
        changed = torch.zeros(self.count, dtype=torch.bool)
        if speed is not None:
            self.fast[rows] = torch.where(speed > self.fastest, speed, 0.0)
            changed[rows] |= (aim.speed[rows] - speed.clamp(max=self.fastest)).abs() > 0.05
            aim.speed[rows] = speed.clamp(max=self.fastest)
        elif target is not None or path is not None:
            aim.speed[rows] = aim.speed[rows].clamp(min=2 * STILL)
        if direction is not None:
            direction = wrapped(direction)
            changed[rows] |= wrapped(aim.direction[rows] - direction).abs() > 0.05
            aim.direction[rows] = direction
        if direction is not None or target is not None or path is not None:
            aim.which[rows], aim.target[rows] = -1, torch.nan
        if target is not None:
            aim.target[rows], changed[rows] = target, True
        if path is not None:
            self._lead(aim, rows, path)
            changed[rows] = True
        self.asked_at[changed] = self.frames
        self.aim = aim

    def _lead(self, aim: Aim, rows: Tensor, path: Path) -> None:
        """Those go along a path from now on; who goes along another one goes on."""
        paths = getattr(self, "paths", [])
        used = sorted(set(aim.which[aim.which >= 0].tolist()))  # others are forgotten
        paths = [paths[i] for i in used] + [path]
        for new, old in enumerate(used):
            aim.which[aim.which == old] = new
        aim.which[rows], aim.arcs[rows] = len(used), 0.0
        self.paths, aim.curves = paths, Curves(paths)
        aim.lengths = torch.tensor([each.length for each in paths], dtype=torch.double)

    def _rows(self, who: int | Sequence[int] | None) -> Tensor:
        if who is None:
            return torch.arange(self.count)
        who = [who] if isinstance(who, Integral) else list(who)
        if not all(isinstance(i, Integral) and 0 <= i < self.count for i in who) or not who:
            raise SolverError(f"steer: who is {who!r}; there are characters 0 to {self.count - 1}.")
        return torch.tensor(who)

    # -- what is done -------------------------------------------------------------------------------

    @torch.no_grad()
    def go_on(self) -> list[Motion | None]:
        """The next frames of each character, where they stand in the world.

        As many as a window has; with a lock, those of some frames ago, and None while there are none.
        """
        begin = time.perf_counter()
        found = answer(self.model, self.before, self.going, self.aim, self.how)
        self._begin_again(found)
        self.gliding.remind(found.slowest, found.after, found.going)
        self.before, self.going = found.after, found.going
        self.aim.onward(self.going)
        self.evaluations += found.evaluations
        self.frames += self.how.window
        made = self.behind.go_on(found.frames)
        for kept, motion in zip(self.kept, made, strict=True):
            if motion is not None:
                kept.append(motion)
        self.times.append(time.perf_counter() - begin)
        return made

    def show(self, refined: bool, lock: bool) -> list[Motion | None]:
        """From the next frames on they are refined or not, as far as there is a refiner, and feet are held
        or not. The frames of each character that a lock kept back, if it ends; else None."""
        self.behind.refines = refined
        left = self.behind.hold(lock)
        for kept, motion in zip(self.kept, left, strict=True):
            if motion is not None:
                kept.append(motion)
        return left

    def _begin_again(self, found: Window) -> None:
        """Who came apart goes on from where he was, as he began: a jump, but no end."""
        far = self.model.normalizer(found.frames).abs().flatten(1).amax(1)
        lost = ~((far < STRANGE) & found.going.place.isfinite().all(1))  # NaN, too
        if not lost.any():
            return
        rows = lost.nonzero()[:, 0]
        frame, place = self.home.frame[rows], self.going.place[rows]
        found.frames[rows], found.slowest[rows] = frame[:, None], 0.0
        known = self.home._replace(seen=self.model.normalizer(self.home.frame))
        for part, own in zip(found.after.state, known, strict=True):
            part[rows] = own[rows] if part.shape == own.shape else 0.0
        found.after.frame[rows], found.after.place[rows] = frame, place
        again = Going.of(self.fps, place, frame[:, None, :3])
        for name in ("place", "velocity", "turn"):
            getattr(found.going, name)[rows] = getattr(again, name)
        for row in rows.tolist():
            self.lost[row] += 1

    def motion(self, who: int = 0) -> Motion:
        """What a character did, of the last ten minutes at most."""
        (row,) = self._rows(who).tolist()
        if not self.kept[row]:
            raise SolverError("Nothing has been done yet; call go_on.")
        return concatenate(list(self.kept[row]))

    # -- what is told -------------------------------------------------------------------------------

    @property
    def latency(self) -> dict[str, float]:
        """Seconds from a wish until it is seen: at most a window until it is heard, then the lock's."""
        return {"window": self.how.window / self.fps, "lock": self.behind.late / self.fps,
                "at most": (self.how.window + self.behind.late) / self.fps}  # fmt: skip

    def record(self, who: int = 0) -> dict:
        """What is asked of a character, what he does, and what he does not: fit for JSON.

        "asked" and "done" : m/s, and degrees; done is a slow average. "notes" : sentences on what is
        not met two seconds after it was asked, or can't be. "seconds a window" : p50 and p95.
        """
        (row,) = self._rows(who).tolist()
        pace = float(self.going.velocity[row].norm())
        speed, way, off = float(self.aim.speed[row]), float(self.aim.direction[row]), 0.0
        only = self.aim[torch.tensor([row])]
        off = math.degrees(only.wanted(self.going[torch.tensor([row])])[2].item())
        going = math.degrees(wrapped(float(self.going.bearing()[row])))
        led = int(self.aim.which[row]) >= 0 or bool(self.aim.target[row].isfinite().all())
        since = (self.frames - int(self.asked_at[row])) / self.fps
        times = torch.tensor(list(self.times) or [math.nan], dtype=torch.double)
        record = {
            "asked": {"speed (m/s)": speed, "direction (°)": None if led else math.degrees(way)},
            "done": {"speed (m/s)": pace, "direction (°)": going, "off (°)": off},
            "seconds since asked": since,
            "latency (s)": self.latency,
            "evaluations": self.evaluations,
            "seconds a window": {
                "p50": float(times.quantile(0.5)),
                "p95": float(times.quantile(0.95)),
            },
            "begun again": self.lost[row],
            "reminded of steps": self.gliding.reminded[row],
        }
        return record | {"notes": self._notes(row, record, led)}

    def _notes(self, row: int, record: dict, led: bool) -> list[str]:
        said, asked, done = [], record["asked"]["speed (m/s)"], record["done"]
        if self.fast[row]:
            said.append(
                f"{float(self.fast[row]):g} m/s is faster than anybody in the data; "
                f"{self.fastest:.1f} m/s was asked for"
            )
        if record["seconds since asked"] >= DUE:
            off, pace = done["off (°)"], done["speed (m/s)"]
            if abs(off) > ASTRAY and asked >= STILL:
                said.append(f"{abs(off):.0f}° off the way that was asked")
            if not led and asked < STILL and pace > 0.1:
                said.append(f"does not stand yet: {pace:.2f} m/s")
            elif not led and asked >= STILL and abs(pace / asked - 1) > SLOWER:
                said.append(f"{pace:.2f} m/s where {asked:.2f} was asked")
        if self.lost[row]:
            said.append(f"came apart and began again, {self.lost[row]} times")
        return said


# -- what is given --------------------------------------------------------------------------------


def _how(
    way: str, futures: int, window: int, steps: int, budget: int | None, seconds: float | None,
    chance: Chance, weights: Mapping[str, float] | None,
) -> How:  # fmt: skip
    if way not in WAYS:
        raise SolverError(f"way is {way!r}; it must be one of {', '.join(WAYS)}.")
    futures = _whole("futures", futures, 1, MOST)
    window, steps = _whole("window", window, 1, 300), _whole("steps", steps, 1, 10_000)
    if not isinstance(chance.temperature, Real) or not 0 < chance.temperature < math.inf:
        raise SolverError(f"temperature is {chance.temperature!r}; it must be a number above 0.")
    if seconds is not None and not (isinstance(seconds, Real) and 0 < seconds < math.inf):
        raise SolverError(f"seconds is {seconds!r}; it must be a number above 0, or None.")
    if budget is not None:
        budget = _whole("budget", budget, 1, 1_000_000)
        futures = min(futures, budget)
        left = budget - futures  # one look more than steps is taken
        if way == "gradient" and left < 2:
            way = "futures"
        steps = min(steps, max(left - 1, 1))
    return How(way, futures, window, steps, chance, seconds, weights or {})


def _whole(name: str, value: int, least: int, most: int) -> int:
    if not isinstance(value, Integral) or isinstance(value, bool) or not least <= value <= most:
        raise SolverError(f"{name} is {value!r}; it must be a whole number from {least} to {most}.")
    return int(value)


def _begun(model: nn.Module, start, characters: int):
    """States (characters,) that they begin with."""
    some = list(start) if isinstance(start, list | tuple) else [start] * characters
    if len(some) != characters:
        raise SolverError(
            f"{len(some)} starts for {characters} characters; one each, or one for all."
        )
    states: dict = {}
    for each in some:
        if id(each) not in states:
            states[id(each)] = begin_with(model, each, [1.2])[0]
    parts = zip(*(states[id(each)] for each in some), strict=True)
    return type(states[id(some[0])])(*(torch.cat(part) for part in parts))


def _places(places: Tensor | Sequence | None, characters: int) -> Tensor:
    if places is None:
        return torch.zeros(characters, 3, dtype=torch.double)
    found = _numbers("places", places, characters, 3)
    return found


def _numbers(name: str, value, count: int, columns: int = 0) -> Tensor | None:
    """Finite numbers (count,) or (count, columns)."""
    if value is None:
        return None
    shape = (count, columns) if columns else (count,)
    try:
        found = torch.as_tensor(value, dtype=torch.double).expand(shape).clone()
    except (TypeError, ValueError, RuntimeError) as error:
        each = f"{columns} numbers" if columns else "a number"
        raise SolverError(
            f"{name} must be {each}, or that for each of {count} characters."
        ) from error
    if not found.isfinite().all():
        raise SolverError(f"{name} is {value!r}; NaN and infinity lead nowhere.")
    return found
