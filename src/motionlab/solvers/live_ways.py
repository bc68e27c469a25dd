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

import torch
from torch import Tensor

from ..metrics import broken
from ..models import LstmGmm, State
from ..models.sampler import Chance, stepper
from . import terms
from .energy import Before, Energy
from .guided import Going
from .live_aim import STILL, Aim, wrapped
from .live_frame import READY, bounded, stand_of, stood
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
    they are then, energies (batch,), NaN where there is none, and samples and slopes that were asked for."""

    frames: Tensor
    after: Before
    going: Going
    energy: Tensor
    evaluations: int


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
    first, now, wish = before[rows], going[rows], aim[rows]
    wanted = wish.wanted(now)
    z, now, state = _pushed(model, first, now, wish, how)
    frames = model.normalizer.inverse(z)
    if count == 1:
        energy = frames.new_zeros(len(rows)) + 0 * frames.sum((1, 2))  # NaN where there is one
    else:
        energy = _energy(model, first, going[rows], now, wanted, z)
    each = energy.nan_to_num(torch.inf).view(-1, count)
    best = each.argmin(1) + count * torch.arange(len(each))
    after = Before(state[best], frames[best, -1], now.place[best])
    return Window(frames[best], after, now[best], energy[best], count)


def _pushed(
    model: LstmGmm, before: Before, going: Going, aim: Aim, how: How
) -> tuple[Tensor, Going, State]:
    """Frames (batch, window, kept), normalised, where they lead, and the state after them."""
    few = stepper(model, before.state, how.chance)
    std, kept, fps = model.normalizer.std[:3], model.normalizer.kept, model.fps
    mean, columns = model.normalizer.mean[:3], [int((kept == i).nonzero()) for i in range(3)]
    body, stand = kept > 2, stand_of(model)  # what is no step of the root, and no turn
    frames, still = [], aim.wanted(going)[0] < STILL
    few.calm(torch.where(still, QUIET, 1.0).float()[:, None].numpy())
    for t in range(how.window):
        speed, bend, off = aim.wanted(going, t / fps)
        last, push = torch.from_numpy(few.seen), few.seen * 0
        push[:, columns] = (torch.stack(_push(going, speed, bend), 1) / std).numpy()
        drawn = torch.from_numpy(few.draw(push))
        seen = bounded(drawn, columns, model.normalizer, going, speed, bend)
        stops = still & (going.velocity.norm(dim=1) < READY) & (off == 0)  # else he turns
        seen = torch.where(stops[:, None], stood(seen, last, body, stand), seen)
        few.seen = seen.numpy()
        few.see()
        frames.append(seen)
        going.move(seen[:, columns] * std + mean)
    z = torch.stack(frames, 1)
    return z, going, State(model.normalizer.inverse(z[:, -1]), *few.after())


def _push(going: Going, speed: Tensor, bend: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Metres to the left and ahead, and radians (batch,), that the next frame should have more of."""
    yaw, still = going.place[:, 2], speed < STILL
    sine, cosine = yaw.sin(), yaw.cos()
    x, z = going.velocity.unbind(1)
    held = lambda moved: (-HOLD * moved).clamp(-AGAINST, AGAINST)
    pace = (SHARE * (speed - going.velocity.norm(dim=1))).clamp(-PACE, PACE)
    left = torch.where(still, held(x * cosine - z * sine), torch.zeros_like(speed))
    ahead = torch.where(still, held(x * sine + z * cosine), pace)
    turn = (SHARE * (bend - going.turn)).clamp(-TURN, TURN)
    return left / going.fps, ahead / going.fps, turn / going.fps


def _energy(
    model: LstmGmm, before: Before, was: Going, now: Going, wanted: tuple, z: Tensor
) -> Tensor:
    """How far futures (batch,) are from what is asked, in nats; feet that slide count, and poses."""
    speed, bend, off = wanted
    still = speed < STILL
    pace = now.velocity.norm(dim=1) - speed
    left = off - wrapped(now.bearing() - was.bearing())
    value = (pace / SPEED).square() / 2 + ((now.turn - bend) / TURNING).square() / 2
    value = value + torch.where(still, 0.0, (left.abs() / WAY).square() / 2)
    moved = (model.fps * z.diff(dim=1)[..., 6:]).square().mean((1, 2))
    value = value + torch.where(still, CALM * moved.double(), 0.0)
    wishes = _feet(model) | {"planted": terms.planted(model.encoding.skeleton, model.fps)}
    energy = Energy(model, before, wishes, {"prior": 0.0, "noise": 0.0})
    whole = z.isfinite().flatten(1).all(1)
    parts = energy.parts(z.nan_to_num(0, 0, 0), z.new_zeros(*z.shape[:2], model.encoding.dim))
    return torch.where(whole, value + FEET * sum(parts.values()), torch.nan)


def _feet(model: LstmGmm) -> dict[str, terms.Term]:
    """Terms of feet that stay where they are, and of poses that bodies take."""
    encoding = model.encoding
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
    frames, energy = both(one.frames, other.frames), both(one.energy, other.energy)
    return Window(frames, after, going, energy, one.evaluations + other.evaluations)


def _descended(
    model: LstmGmm, before: Before, going: Going, aim: Aim, how: How, best: Window, late
) -> Window:
    """The paper's way: from the best sample down the slope of its energy."""
    speed, bend, _ = aim.wanted(going)
    going = going[torch.arange(len(speed))]
    seconds = how.window / model.fps
    pace = going.velocity.norm(dim=1)
    reach = FASTER * seconds
    wishes = {
        "speed": terms.speed((pace + (speed - pace).clamp(-reach, reach)).float(), model.fps),
        "direction": terms.turn((bend * seconds).float()),
    } | _feet(model)
    weights = dict.fromkeys(_feet(model), SLOPE["feet"]) | dict(how.weights)
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
    return Window(frames, after, going, solved.energy, best.evaluations + solved.evaluations)
