"""Three ways to answer a wish with the next few frames; the inside of `live_control`.

* A push: one sample, whose means of root step and turn are pushed to what is asked (`guided`).
* Futures: a handful of such samples, of which the one of least energy is kept.
* The paper's (RNN-GAN, section 5.3): from the best of a few samples a gradient descends, through the
  recurrence, in an energy of speed, direction, contact and prior.

Whoever is asked to stand is held by a stronger push, against whatever way he still goes, and brings
his feet together. What is drawn is kept to what bodies do (`live_frame`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from ..encodings import JointAngles
from ..feet.contacts import foot_points
from ..metrics import broken
from ..models import LstmGmm, State
from ..models.sampler import Chance, stepper
from ..models.sampler_few import Few
from . import terms
from .energy import Before, Energy
from .guided import Going
from .live_aim import STILL, Aim
from .live_frame import READY, Steps, bounded, slowest_foot, stand_of, stood
from .live_going import Rows, wrapped
from .live_points import feet_of
from .window import solve

WAYS = ("push", "futures", "gradient")
SHARE, TURN, PACE = 1.0, 1.2, 0.5  # as `guided`'s; who steers waits for less
HOLD, AGAINST = 4.0, 1.2  # of the speed that is left to who should stand, and m/s at most
QUIET = 0.3  # of the temperature that is left to them
SPEED, WAY, TURNING = 0.15, 0.25, 0.5  # m/s, rad, rad/s: how far futures may be off
FEET, CALM = 0.2, 0.1  # weights of the terms of feet and poses, and of a body that should be still
SLOPE = {"feet": 0.3}  # weights of the terms of a gradient, by name
ROUND = 8  # futures that are sampled at a time where time is short
FASTER = 3.0  # m/s² that a window is asked for at most, for its gradient


@dataclass(frozen=True)
class How:
    """Settings of a window; see `LiveControl`."""

    way: str
    futures: int
    window: int
    steps: int
    chance: Chance
    seconds: float | None
    weights: Mapping[str, float] = field(default_factory=dict)


@dataclass
class Window:
    """What characters do next: frames (batch, window, dim) in raw units, the state after them, where
    they are then, energies (batch,), NaN where there is none, samples and slopes that were asked for, and
    the speed of the slowest part of their feet (batch, window), m/s."""

    frames: Tensor
    after: Before
    going: Going
    energy: Tensor
    evaluations: int
    slowest: Tensor


@torch.no_grad()
def answer(model: LstmGmm, before: Before, going: Going, aim: Aim, how: How) -> Window:
    """The next frames of characters (batch) who are at `before`, and go as `going`."""
    begin = time.perf_counter()
    late = lambda: how.seconds is not None and time.perf_counter() - begin >= how.seconds
    if how.way == "push":
        return _futures(model, before, going, aim, how, 1)
    many = how.futures if how.seconds is None else min(ROUND, how.futures)
    best, asked = _futures(model, before, going, aim, how, many), many
    while asked < how.futures and not late():
        many = min(ROUND, how.futures - asked)
        best, asked = _better(best, _futures(model, before, going, aim, how, many)), asked + many
    if how.way == "gradient" and not late():
        best = _descended(model, before, going, aim, how, best, late)
    return best


def _futures(
    model: LstmGmm, before: Before, going: Going, aim: Aim, how: How, count: int
) -> Window:
    """Of some pushed samples each, the one of least energy."""
    rows = torch.arange(len(before.frame)).repeat_interleave(count)
    first, now, wish = before[rows], Rows.of(going, count), aim[rows]
    with np.errstate(all="ignore"):  # as torch: who leaves all bounds is told by the numbers
        wanted = wish.wanted(now)
        z, few, places = _pushed(model, first, now, wish, how)
        frames = model.normalizer.inverse(z)
        decoded = _decoded(model, first, frames, places)
    slowest = slowest_foot(decoded[1], model.encoding.skeleton, model.fps)
    energy = 0 * frames.sum((1, 2))  # NaN where there is one
    if count > 1:
        energy = energy + _energy(model, Rows.of(going, count), now, wanted, z)
        energy = energy + FEET * sum(term(*decoded) for term in _wishes(model.encoding))
    each = energy.nan_to_num(torch.inf).view(-1, count)
    best = each.argmin(1) + count * torch.arange(len(each))
    few.keep(best.numpy())  # what the network makes of the last frame matters to these only
    few.see()
    state = State(frames[best, -1], *few.after())
    after, then = Before(state, frames[best, -1], first.place[best]), now.going(best)
    after = after._replace(place=then.place)
    return Window(frames[best], after, then, energy[best], count, slowest[best])


def _pushed(
    model: LstmGmm, before: Before, going: Rows, aim: Aim, how: How
) -> tuple[Tensor, Few, np.ndarray]:  # fmt: skip
    """Frames (batch, window, kept), normalised, the network that has not seen the last of them, and where
    they stood before and in each (batch, 1 + window, 3); `going` is moved along."""
    few, steps = stepper(model, before.state, how.chance), Steps.of(model.normalizer)
    frames, stand, places = [], stand_of(model), [going.place]
    for t in range(how.window):
        speed, bend, off = aim.wanted(going, t / model.fps)
        if not t:
            still = speed < STILL
            few.calm(np.where(still, QUIET, 1.0).astype(np.float32)[:, None])
        last, push = few.seen, np.zeros_like(few.seen)
        push[:, steps.columns] = np.stack(_push(going, speed, bend), 1) / steps.std
        seen = bounded(few.draw(push), steps, going, speed, bend)
        stops = still & (going.pace < READY) & (off == 0)  # else he turns
        if stops.any():
            seen = np.where(stops[:, None], stood(seen, last, steps.body, stand), seen)
        few.seen = seen
        if t < how.window - 1:
            few.see()
        frames.append(seen)
        going.move(steps.raw(seen))
        places.append(going.place)
    return torch.from_numpy(np.stack(frames, 1)), few, np.stack(places, 1)


def _decoded(
    model: LstmGmm, before: Before, frames: Tensor, places: np.ndarray | None = None
) -> tuple[Tensor, Tensor, Tensor | None]:
    """What a term gets of frames (batch, window, dim), raw units: features, where feet are, contacts."""
    frames, points = frames.nan_to_num(0, 0, 0), feet_of(model.encoding)
    if points is None or places is None:
        feet = frozenset(foot_points(model.encoding.skeleton))
        return Energy(model, before).decoded(frames, feet)
    features = torch.cat([before.frame[:, None], frames], 1)
    contacts = model.encoding.slices.get("contacts")
    places = places - places[:, :1] * [1, 1, 0]  # far away, float32 would blur them
    return features, points(features, places), None if contacts is None else features[..., contacts]


def _push(
    going: Rows, speed: np.ndarray, bend: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Metres to the left and ahead, and radians (batch,), that the next frame should have more of."""
    yaw, still = going.place[:, 2], speed < STILL
    sine, cosine = np.sin(yaw), np.cos(yaw)
    x, z = going.velocity.T
    held = lambda moved: (-HOLD * moved).clip(-AGAINST, AGAINST)
    pace = (SHARE * (speed - going.pace)).clip(-PACE, PACE)
    left, ahead = x * cosine - z * sine, x * sine + z * cosine  # as they go
    aside = (1 - going.walks()) * (SHARE * -left).clip(
        -PACE, PACE
    )  # who is slow goes where he faces
    left, ahead = np.where(still, held(left), aside), np.where(still, held(ahead), pace)
    turn = (SHARE * (bend - going.turn)).clip(-TURN, TURN)
    return left / going.fps, ahead / going.fps, turn / going.fps


def _energy(model: LstmGmm, was: Rows, now: Rows, wanted: tuple, z: Tensor) -> Tensor:
    """How far futures (batch,) are from what is asked, in nats."""
    speed, bend, off = wanted
    still = speed < STILL
    left = off - wrapped(now.course() - was.course())
    value = ((now.pace - speed) / SPEED) ** 2 / 2 + ((now.turn - bend) / TURNING) ** 2 / 2
    value = value + np.where(still, 0.0, (np.abs(left) / WAY) ** 2 / 2)
    if still.any():
        moved = (model.fps * z.diff(dim=1)[..., 6:]).square().mean((1, 2))
        value = value + np.where(still, CALM * moved.double().numpy(), 0.0)
    return torch.from_numpy(value)


@lru_cache(maxsize=8)
def _wishes(encoding: JointAngles) -> list[terms.Term]:
    """Terms by which futures are judged: feet that slide count, and poses."""
    return [*_feet(encoding).values(), terms.planted(encoding.skeleton, encoding.fps)]


def _feet(encoding: JointAngles) -> dict[str, terms.Term]:
    """Terms of feet that stay where they are, and of poses that bodies take."""
    found = {"resting": terms.resting(encoding.skeleton, encoding.fps)}
    if "contacts" in encoding.slices:
        found["contact"] = terms.contact(encoding.skeleton)
    if broken.knows(encoding):
        found["poses"] = terms.poses(encoding)
    return found


def _better(one: Window, other: Window) -> Window:
    """Each character's window of less energy."""
    wins = ~(one.energy <= other.energy)  # so where the one is no number

    def both(a: Tensor, b: Tensor) -> Tensor:
        return torch.where(wins.view(-1, *[1] * (a.ndim - 1)), b, a)

    state = State(*map(both, one.after.state, other.after.state))
    after = Before(state, *map(both, one.after[1:], other.after[1:]))
    going = Going(one.going.fps, *(both(getattr(one.going, name), getattr(other.going, name))
                                   for name in ("place", "velocity", "turn")))  # fmt: skip
    frames, energy, slowest = (both(getattr(one, name), getattr(other, name))
                               for name in ("frames", "energy", "slowest"))  # fmt: skip
    return Window(frames, after, going, energy, one.evaluations + other.evaluations, slowest)


def _descended(
    model: LstmGmm, before: Before, going: Going, aim: Aim, how: How, best: Window, late
) -> Window:
    """The paper's way: from the best sample down the slope of its energy."""
    speed, bend, _ = map(torch.from_numpy, aim.wanted(going))
    going = going[torch.arange(len(speed))]
    seconds = how.window / model.fps
    pace = going.velocity.norm(dim=1)
    reach = FASTER * seconds
    wishes = {
        "speed": terms.speed((pace + (speed - pace).clamp(-reach, reach)).float(), model.fps),
        "direction": terms.turn((bend * seconds).float()),
    } | _feet(model.encoding)
    weights = dict.fromkeys(_feet(model.encoding), SLOPE["feet"]) | dict(how.weights)
    if not best.frames.isfinite().all():
        return best  # somebody came apart: who steers must know
    s = model.normalizer(best.frames)
    d = s.new_zeros(*s.shape[:2], model.encoding.dim)
    solved = solve(Energy(model, before, wishes, weights), s, d, "adam", how.steps, enough=late)
    frames = model.normalizer.inverse(solved.s)
    _, state = model.read(frames, before.state, solved.d)
    for t in range(how.window):
        going.move(frames[:, t, :3])
    after = Before(state, frames[:, -1], going.place)
    slowest = slowest_foot(_decoded(model, before, frames)[1], model.encoding.skeleton, model.fps)
    asked = best.evaluations + solved.evaluations
    return Window(frames, after, going, solved.energy, asked, slowest)
