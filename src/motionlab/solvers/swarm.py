"""Particle swarm optimisation: many look, and each is drawn to where it and the best of all were best.

Kennedy, *Particle swarm optimization* (1995), which RNN-GAN (section 5.2) begins its search with;
the weights are Clerc and Kennedy's (2002), with which a swarm comes to rest. It needs no slopes, and
in many dimensions it needs many looks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from ..errors import SolverError

INERTIA, DRAWN = 0.7298, 1.49618


class Found(NamedTuple):
    """The best place (batch, dim) that a swarm saw, its value (batch,), and how often it looked."""

    place: Tensor
    value: Tensor
    evaluations: int


@torch.no_grad()
def swarm(
    function: Callable[[Tensor], Tensor],
    centre: Tensor,
    spread: Tensor | float,
    *,
    particles: int = 30,
    iterations: int = 100,
    generator: torch.Generator | None = None,
) -> Found:
    """Look for the least value of a function, with a swarm for each problem of a batch.

    Parameters
    ----------
    function : of places (batch, particles, dim) to values (batch, particles). What is no number
        counts as infinite.
    centre : (batch, dim); the first particle begins here, so nothing worse is found.
    spread : standard deviation of where the others begin, and twice that the longest move; a number
        or a tensor like centre.
    particles : of each swarm, at least 2.
    iterations : moves; 0 looks only.
    generator : source of chance.

    Raises
    ------
    SolverError : too few particles or moves, or no value at the centre.
    """
    if particles < 2 or iterations < 0:
        raise SolverError(
            f"swarm: {particles} particles, {iterations} iterations; at least 2 and 0 are needed."
        )
    spread = torch.as_tensor(spread).to(centre).expand_as(centre)[:, None]
    shape = (len(centre), particles, centre.shape[1])
    draw = lambda of: of(shape, generator=generator, dtype=centre.dtype, device=centre.device)
    places = centre[:, None] + spread * draw(torch.randn)
    places[:, 0] = centre
    moves = 0.1 * spread * draw(torch.randn)
    rows = torch.arange(len(centre), device=centre.device)
    best = _numbers(function(places))
    if not best[:, 0].isfinite().all():
        raise SolverError("swarm: the function has no finite value at the centre.")
    best_places = places.clone()
    for _ in range(iterations):
        leader = best_places[rows, best.argmin(1)][:, None]
        own, all_of_them = draw(torch.rand), draw(torch.rand)
        moves = INERTIA * moves + DRAWN * (
            own * (best_places - places) + all_of_them * (leader - places)
        )
        moves = torch.minimum(torch.maximum(moves, -2 * spread), 2 * spread)
        places = places + moves
        values = _numbers(function(places))
        better = values < best
        best = torch.where(better, values, best)
        best_places = torch.where(better[..., None], places, best_places)
    which = best.argmin(1)
    return Found(best_places[rows, which], best[rows, which], particles * (iterations + 1))


def _numbers(values: Tensor) -> Tensor:
    return values.nan_to_num(nan=math.inf)
