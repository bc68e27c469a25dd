"""Motion of an STRNN under control: each window is fitted to what is asked for, and then said.

Wang, Ho, Shum and Zhu (2021), sections 4.2.3 and 5.4. The network says the next frames; some steps of
gradient descent on its own weights bring them to the root velocities that are wished, to bones of the
right length and to feet that stand. Then the weights are as they were, and the next window begins: so
no window is led away from motion by those before it. Instead of the weights, the state (h, C) that the
encoder leaves can be fitted: it is two rows of numbers a character, and many go side by side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import torch
from torch import Tensor
from torch.func import functional_call

from ..encodings.path import turned, walk
from ..errors import SolverError
from ..feet.contacts import foot_points
from ..models import Strnn
from ..models.at_rest import at_rest
from ..paths import BACK, ON, Curves, Path

RATES = {"weights": 3e-4, "state": 0.03}  # of learning
Fitted = Literal["weights", "state"]
# From places (batch, 3), x, z and yaw of the last frames there are, to what is wished of the next n:
# (batch, n, 3), velocity to the left and ahead in m/s, each in the heading frame of the frame before,
# and turn rate in rad/s.
Wish = Callable[[Tensor, int], Tensor]


class Costs(NamedTuple):
    """What is asked of a window, eq. 8 to 11, and what holds it near to what the network would say."""

    control: float = 1.0
    """Squared deviations from the velocities that are wished, in m/s and rad/s."""
    bones: float = 300.0
    """Squared errors of bones in m."""
    contacts: float = 1.0
    """Squared speeds over the ground, in m/s, of feet whose contact bit is set."""
    read: float = 1.0
    """Squared errors of the frames that are read and said again, in deviations."""


class Controlled(NamedTuple):
    """Motion under control.

    features : (batch, frames, dim), raw units. places : (batch, 3), x, z and yaw of their first frame,
    where the last frame that was read stands at the origin and looks ahead.
    """

    features: Tensor
    places: Tensor


def control(
    model: Strnn,
    features: Tensor,
    wish: Wish | Tensor,
    frames: int,
    *,
    fit: Fitted = "weights",
    steps: int = 20,
    rate: float | None = None,
    costs: Costs | None = None,
    start: Tensor | None = None,
) -> Controlled:
    """Motion that goes on from features as it is wished.

    Parameters
    ----------
    model : its weights are left as they are: what is fitted are copies, made anew for each window.
    features : (batch, read, dim), the last `model.encode` of which are read; raw units.
    wish : see `Wish`, and `along`; or a signal (frames, 3) or (batch, frames, 3) of velocities and turn
        rate.
    frames : how many are made.
    fit : "weights", the paper's, a character at a time; or "state".
    steps : of Adam, for each window.
    rate : its learning rate; None: `RATES`.
    start : (batch, 3), x, z and yaw of the last frame of features; None: the origin.

    Raises
    ------
    SolverError : no contacts in the features, settings that make no sense, a signal that is shorter than
        the motion or holds a NaN. ModelError : features that the model can't read.
    """
    costs = Costs() if costs is None else costs
    rate = RATES[fit] if rate is None and fit in RATES else rate
    _check(model, frames, fit, steps, rate, costs)
    model.extrapolate(features, 1)  # refuses what it can not read
    seen = torch.as_tensor(features).to(model.normalizer.mean)[:, -model.encode :]
    wish = _signal(wish, len(seen), frames) if isinstance(wish, Tensor) else wish
    place = seen.new_zeros(len(seen), 3) if start is None else start.to(seen)
    made, first = [], None
    with at_rest(model), torch.enable_grad():
        for begin in range(0, frames, model.predict):
            asked = wish(place, min(model.predict, frames - begin)).to(seen)
            said = _fitted(model, seen, asked, fit, steps, rate, costs)[:, : asked.shape[1]]
            path, yaw = _walked(model, said, place)
            first = torch.cat([path[:, 0], yaw[:, :1]], 1) if first is None else first
            place = torch.cat([path[:, -1], yaw[:, -1:]], 1)
            made.append(said)
            seen = torch.cat([seen, said], 1)[:, -model.encode :]
    return Controlled(torch.cat(made, 1), first)


def _fitted(
    model: Strnn, seen: Tensor, asked: Tensor, fit: Fitted, steps: int, rate: float, costs: Costs
) -> Tensor:  # fmt: skip
    """The next frames (batch, predict, dim), raw units, after some steps downhill."""
    if fit == "weights" and len(seen) > 1:
        each = zip(seen.split(1), asked.split(1), strict=True)
        return torch.cat([_fitted(model, *its, fit, steps, rate, costs) for its in each])
    if fit == "weights":
        free = {name: its.detach().clone() for name, its in model.named_parameters()}
        say = lambda: functional_call(model, free, (seen,))
    else:
        with torch.no_grad():
            free = dict(zip("hC", model._state(model.normalizer(seen)), strict=True))
            free = {name: its.clone() for name, its in free.items()}
        say = lambda: model.normalizer.inverse(
            model._filtered(model._told((free["h"], free["C"]))[0])
        )
    cost = _Cost(model, seen, asked, costs)
    if fit == "state":
        frozen = [its for its in model.parameters() if its.requires_grad]
        for its in frozen:
            its.requires_grad_(False)
    try:
        for its in free.values():
            its.requires_grad_()
        adam = torch.optim.Adam(free.values(), lr=rate)
        for _ in range(steps):
            adam.zero_grad()
            cost(say()).backward()
            adam.step()
        with torch.no_grad():
            return say()[:, model.encode :]
    finally:
        if fit == "state":
            for its in frozen:
                its.requires_grad_()


@dataclass
class _Cost:
    """What a window that was said costs; characters are added up, so that none hangs on another."""

    model: Strnn
    seen: Tensor
    asked: Tensor
    costs: Costs

    def __post_init__(self) -> None:
        encoding = self.model.encoding
        skeleton = encoding.skeleton
        self.parents = list(skeleton.parents[1:])
        self.lengths = skeleton.offsets[1:].norm(dim=-1).to(self.seen)
        self.feet = foot_points(skeleton)
        self.down: Tensor | None = None

    def __call__(self, said: Tensor) -> Tensor:
        model, costs = self.model, self.costs
        encoding, n = model.encoding, self.asked.shape[1]
        ahead = said[:, model.encode :][:, :n]
        frames = torch.cat([self.seen[:, -1:], ahead], 1)
        velocities = ahead[..., encoding.slices["root"]][..., 6:]
        off = (velocities - self.asked).square().sum(-1).mean(1)
        again = model.normalizer(said[:, : model.encode]) - model.normalizer(self.seen)
        total = costs.control * off + costs.read * again.square().mean((1, 2))
        points = encoding._points(frames)
        if costs.bones:
            bones = (points[:, 1:, 1:] - points[:, 1:, self.parents]).norm(dim=-1) - self.lengths
            total = total + costs.bones * bones.square().mean((1, 2))
        if costs.contacts:
            if self.down is None:  # as the network says it by itself
                bits = encoding.contacts(frames).detach() > 0.5
                self.down = (bits[:, 1:] & bits[:, :-1]).to(said)
            path, yaw = encoding._walk(frames, None)
            feet = path[..., None, :] + turned(points[..., self.feet, :], yaw[..., None])
            slide = encoding.fps * feet.diff(dim=1)[..., [0, 2]]
            total = total + costs.contacts * (self.down * slide.square().sum(-1)).mean((1, 2))
        return total.sum()


def _walked(model: Strnn, said: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
    """x and z (batch, n, 2) and yaw (batch, n) of frames that come after a place (batch, 3)."""
    steps = model.encoding._steps(said)
    steps = torch.cat([steps[:, :1], steps], 1)  # the first of all is not used
    path, yaw = walk(steps, tuple(place.double().unbind(-1)))
    return path[:, 1:][..., [0, 2]], yaw[:, 1:]


# -- along a path -----------------------------------------------------------------------------------


def along(paths: Sequence[Path], speeds: Tensor, fps: float) -> Wish:
    """What is wished of who walks along paths, facing where they lead; past their end, straight on.

    Each window is aimed anew from where it begins: who is beside the path comes back to it in the
    course of the window, whose end is on it.

    Parameters
    ----------
    speeds : (batch,) m/s.

    Raises
    ------
    SolverError : not one speed for each path, or none above 0.
    """
    speeds = torch.as_tensor(speeds, dtype=torch.float64)
    if speeds.shape != (len(paths),) or not bool((speeds > 0).all()):
        raise SolverError(
            f"{len(paths)} paths and speeds {speeds.tolist()}: one for each path, in m/s, above 0."
        )
    curves, which = Curves(paths), torch.arange(len(paths))
    arcs = torch.zeros(len(paths), dtype=torch.float64)
    gone = torch.zeros_like(arcs)  # metres that were asked of the last window

    def wish(place: Tensor, n: int) -> Tensor:
        place = place.double()
        near = curves.piece(arcs - BACK, arcs + gone + ON, which)
        arcs[:] = near.nearest(place[:, None, :2]).arcs[:, 0]
        gone[:] = speeds * n / fps
        ahead = arcs[:, None] + speeds[:, None] / fps * torch.arange(0, n + 1)
        aims = curves.at(ahead, which)
        ways = curves.ways(ahead, which)
        yaw = torch.atan2(ways[..., 0], ways[..., 1])
        left = 1 - torch.arange(0, n + 1) / n  # what is still wrong, less and less
        aims = aims + left[:, None] * (place[:, None, :2] - aims[:, :1])
        wrong = torch.remainder(place[:, 2:] - yaw[:, :1] + math.pi, 2 * math.pi) - math.pi
        yaw = yaw + left * wrong
        flat = aims.diff(dim=1)
        moves = torch.stack([flat[..., 0], torch.zeros_like(flat[..., 0]), flat[..., 1]], -1)
        moves = turned(moves, -yaw[:, :-1])
        turns = torch.remainder(yaw.diff(dim=1) + math.pi, 2 * math.pi) - math.pi
        return fps * torch.stack([moves[..., 0], moves[..., 2], turns], -1)

    return wish


# -- what is given ----------------------------------------------------------------------------------


def _signal(signal: Tensor, batch: int, frames: int) -> Wish:
    """A signal of velocities and turn rate as a wish that hangs on no place."""
    signal = signal[None] if signal.ndim == 2 else signal
    if signal.ndim != 3 or signal.shape[-1] != 3 or signal.shape[0] not in (1, batch):
        raise SolverError(
            f"The signal has shape {tuple(signal.shape)}; it must be (frames, 3) or ({batch}, frames, "
            "3): velocity to the left, ahead, and turn rate."
        )
    if signal.shape[1] < frames:
        raise SolverError(
            f"The signal has {signal.shape[1]} frames, the motion is to have {frames}; give a longer "
            "one, or make fewer frames."
        )
    if not bool(signal.isfinite().all()):
        raise SolverError("The signal holds a NaN or an infinite value.")
    rest = [signal.expand(batch, -1, -1)]

    def wish(place: Tensor, n: int) -> Tensor:
        now, rest[0] = rest[0][:, :n], rest[0][:, n:]
        return now

    return wish


def _check(model, frames, fit, steps, rate, costs) -> None:
    if not isinstance(model, Strnn) or "contacts" not in model.encoding.slices:
        raise SolverError(
            f"control: {type(model).__name__} can't be led so; it must be an Strnn whose features have "
            "contacts."
        )
    if fit not in RATES:
        raise SolverError(f'control: fit is {fit!r}; it is "weights" or "state".')
    if not isinstance(frames, int) or frames < 1 or not isinstance(steps, int) or steps < 0:
        raise SolverError(f"control: {frames!r} frames, {steps!r} steps: at least 1, and 0.")
    if not 0 < rate < math.inf or not all(0 <= cost < math.inf for cost in costs):
        raise SolverError(f"control: rate is {rate}, costs {costs}: above 0, and 0 or more.")
