"""The chance in a draw from a Gaussian: white, or with a memory."""

from __future__ import annotations

import torch
from torch import Tensor

from ..errors import ModelError


def next_noise(noise: Tensor, memory: float, generator: torch.Generator | None = None) -> Tensor:
    """The noise of the next frame, ε_t = ρ ε_{t-1} + √(1 - ρ²) n_t with white n_t; like `noise`.

    At every moment it is standard normal, whatever ρ is. But white noise trembles, and this one
    changes slowly: a share of ρ^k is left after k frames, which at 0.9 and 30 frames a second is
    half after a fifth of a second. For ρ = 0 it is white.

    Parameters
    ----------
    noise : ε_{t-1}, (batch, kept), in deviations, such as `State.noise` after a draw.
    memory : ρ, from 0 to less than 1.
    generator : source of chance.

    Raises
    ------
    ModelError : there is no noise to go on from, as in a state of frames that were observed.
    """
    if not noise.shape[-1]:
        raise ModelError(
            "There is no noise to go on from: no frame of this state was drawn. Begin with "
            "torch.randn(batch, kept), or let `generate` or `go_on` draw: they begin by themselves."
        )
    fresh = normal(noise, generator)
    return memory * noise + (1 - memory**2) ** 0.5 * fresh if memory else fresh


def noise_to_draw(
    noise: Tensor, like: Tensor, memory: float, generator: torch.Generator | None
) -> Tensor:
    """`next_noise`; where there is none before, a first one, which is standard normal, too."""
    known = noise.shape[-1] > 0
    return next_noise(noise, memory, generator) if known else normal(like, generator)


def normal(like: Tensor, generator: torch.Generator | None) -> Tensor:
    """Standard normal numbers, as many as `like` has."""
    return torch.randn(like.shape, generator=generator, device=like.device, dtype=like.dtype)
