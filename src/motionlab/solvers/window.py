"""One window solved: the motion and the disturbances of least energy near a first guess.

What is searched is whitened: each feature's change in units of its deviation in the component that
the first guess came from, the disturbances in units of theirs. A root's step may change by millimetres
and an elbow by degrees; in these units a step downhill is as long for the one as for the other. And a
change lasts: the frames behind it keep a share of it, as they do when the network itself is pushed
(its means hold on to the frame before). A root's lean into a bend is one number then, not thirty that
must agree.

Adam is what is used, with steps of about half a deviation and a short memory: it comes as low as with
its usual settings, frame by frame, in a fifth of the steps (``benchmarks/bench_design.py``). L-BFGS, the paper's, is
there to compare: windows of a batch must share its step lengths. So are the swarm, the paper's
beginning, which sees little in four thousand dimensions, and "paper": a few of its moves, then L-BFGS.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from ..models import Mixture
from .energy import NOISE, Energy
from .swarm import swarm

METHODS = ("adam", "lbfgs", "swarm", "paper", "none")
DESCENTS = ("adam", "lbfgs", "paper")
FEW = 10  # moves of the swarm before L-BFGS, as the paper does it
RATE = 0.6  # of Adam, in deviations: with longer steps the body trembles more
HOLD, LOW = 0.3, 0.1  # share of the steps with this rate, and of the rate that is left in the end
PUSH, SQUARE = 0.5, 0.8  # what Adam keeps of its averages of slopes and of their squares, a step
LASTS = 0.85  # of a change in a frame, in the next
FARTHEST = 8.0  # deviations from the first guess: what goes farther has diverged


class Solved(NamedTuple):
    """Motion s (batch, frames, kept), disturbances d (batch, frames, dim), energy (batch,)."""

    s: Tensor
    d: Tensor
    energy: Tensor
    evaluations: int


def solve(
    energy: Energy,
    s: Tensor,
    d: Tensor,
    method: str = "adam",
    steps: int = 60,
    generator: torch.Generator | None = None,
    enough: Callable[[], bool] = lambda: False,
) -> Solved:
    """Descend from a first guess s, d; for each window, the best that was seen.

    So it is never worse than the guess. method : one of `METHODS`; steps : of it. enough : asked before
    each step of Adam; it may say that time is up.
    """
    search = Search(energy, s, d)
    descend(search, method, steps, generator, enough)
    return Solved(*search.at(search.best), search.least, search.evaluations)


def descend(
    search: Search,
    method: str,
    steps: int,
    generator: torch.Generator | None = None,
    enough: Callable[[], bool] = lambda: False,
) -> None:
    """Let a search look about until it has its best; arguments as of `solve`."""
    free = search.zero()
    if method == "adam":
        _adam(search, free, steps, enough)
    elif method == "lbfgs":
        _lbfgs(search, free, steps)
    elif method in ("swarm", "paper"):
        _swarm(search, free, steps if method == "swarm" else FEW, generator)
        if method == "paper":
            _lbfgs(search, search.best, steps)
    else:
        search.look(free)


class Search:
    """An energy over free numbers (batch, n), zero at the first guess; remembers the best."""

    def __init__(self, energy: Energy, s: Tensor, d: Tensor) -> None:
        self.energy, self.s, self.d = energy, s, d
        with torch.no_grad():
            features = energy.model.normalizer.inverse(s)
            self.scale = spread(energy.mixture(features, d), s)
        frames = torch.arange(s.shape[1], device=s.device)
        later = (frames[:, None] - frames).to(s)
        self.lasting = math.sqrt(1 - LASTS**2) * LASTS ** later.clamp(min=0) * (later >= 0)
        self.best = self.zero()
        self.least = s.new_full((len(s),), torch.inf)
        self.evaluations = 0

    def zero(self) -> Tensor:
        return self.s.new_zeros(len(self.s), self.s[0].numel() + self.d[0].numel())

    def at(self, free: Tensor) -> tuple[Tensor, Tensor]:
        """s and d that free numbers stand for."""
        free = free.clamp(-FARTHEST, FARTHEST)
        u, v = free.split([self.s[0].numel(), self.d[0].numel()], 1)
        s = self.s + self.lasting @ (self.scale * u.view_as(self.s))
        return s, self.d + NOISE * v.view_as(self.d)

    def look(self, free: Tensor) -> Tensor:
        """Energies (batch,) there."""
        value = self.energy(*self.at(free))
        self.evaluations += 1
        with torch.no_grad():
            better = value < self.least  # never so for a NaN
            self.least = torch.where(better, value, self.least)
            self.best = torch.where(better[:, None], free, self.best)
        return value

    def slope(self, free: Tensor) -> tuple[Tensor, Tensor]:
        """Energies (batch,), and their slopes (batch, n): none where there is no number."""
        free = free.detach().requires_grad_()
        with torch.enable_grad():
            value = self.look(free)
            (slope,) = torch.autograd.grad(value.sum(), free)
        return value.detach(), slope.nan_to_num(0.0, 0.0, 0.0)


def spread(mixture: Mixture, s: Tensor) -> Tensor:
    """Deviations (batch, frames, kept) of the component that each frame of s fits best."""
    far = (s[..., None, :] - mixture.means) / mixture.stds
    fits = mixture.log_weights - (far.square() / 2 + mixture.stds.log()).sum(-1)
    which = fits.argmax(-1)[..., None, None].expand(*s.shape[:-1], 1, s.shape[-1])
    return mixture.stds.gather(-2, which)[..., 0, :]


def _adam(search: Search, free: Tensor, steps: int, enough: Callable[[], bool]) -> None:
    """Written out, since a window's own best must be seen at each step."""
    first, second = torch.zeros_like(free), torch.zeros_like(free)
    for t in range(1, steps + 1):
        if enough():
            break
        _, slope = search.slope(free)
        first = torch.lerp(slope, first, PUSH)
        second = torch.lerp(slope.square(), second, SQUARE)
        rate = RATE * (1 - (1 - LOW) * max(0.0, (t / steps - HOLD) / (1 - HOLD)))
        step = first / (1 - PUSH**t) / ((second / (1 - SQUARE**t)).sqrt() + 1e-8)
        free = (free - rate * step).clamp(-FARTHEST, FARTHEST)
    with torch.no_grad():
        search.look(free)


def _lbfgs(search: Search, free: Tensor, steps: int) -> None:
    free = free.clone().requires_grad_()
    optimizer = torch.optim.LBFGS(
        [free], max_iter=steps, max_eval=2 * steps, history_size=20, line_search_fn="strong_wolfe"
    )

    def closure() -> Tensor:
        value, free.grad = search.slope(free)
        # a sum without a number would stop all windows, with an IndexError of the line search at that:
        # a window that breaks counts as its best, without a slope, and the others go on
        known = search.least.nan_to_num(posinf=0.0)
        return torch.where(value.isfinite(), value, known).sum()

    optimizer.step(closure)


def _swarm(search: Search, free: Tensor, steps: int, generator: torch.Generator | None) -> None:
    """Each window its own swarm; energies are asked for particle after particle, in one batch of
    windows each."""

    def values(places: Tensor) -> Tensor:
        return torch.stack([search.look(some) for some in places.unbind(1)], 1)

    swarm(values, free, 0.3, particles=10, iterations=steps, generator=generator)
