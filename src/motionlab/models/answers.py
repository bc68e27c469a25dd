"""The density of a mixture of Gaussians, straight from the numbers that a network answers with.

It is `lstm_gmm.Mixture.log_prob` of `LstmGmm.forward`, which says what is meant, in less time
(`benchmarks/bench_training_parts.py`). Training asks for little else, and what it asks for is a loss
over some ten thousand Gaussians of 64 channels each: arithmetic is little, and memory much. So means
and deviations are not made first: what is needed of them is found in as few walks through memory as
will do, and their slope is written out, into one piece.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

NO_SHARE = 1e-12  # a component's part in a density, below which it has none in its slope


def split(numbers: Tensor, components: int) -> tuple[Tensor, Tensor, Tensor]:
    """Logarithms of weights (..., M), up to a constant, and means and logarithms of deviations
    (..., M, channels) of numbers (..., M (1 + 2 channels)). All are views."""
    weights, gaussians = numbers.tensor_split([components], -1)
    means, log_stds = gaussians.unflatten(-1, (2, components, -1)).unbind(-3)
    return weights, means, log_stds


def log_density(
    numbers: Tensor, values: Tensor, components: int, reach: float, floor: Tensor
) -> Tensor:
    """Logarithm of the density (...) at values (..., channels).

    numbers : (..., M (1 + 2 channels)), see `split`. Means count in units of `reach`, deviations,
        too, and these have `floor` (channels) added.
    """
    return _LogDensity.apply(numbers, values, components, reach, floor)


class _LogDensity(torch.autograd.Function):
    @staticmethod
    def forward(ctx, numbers, values, components, reach, floor):
        weights, means, log_stds = split(numbers, components)
        learned = log_stds.exp().mul_(reach)  # deviations without the floor
        stds = learned + floor
        far = torch.sub(values[..., None, :], means, alpha=reach).div_(stds)  # (..., M, channels)
        each = stds.log().addcmul_(far, far, value=0.5).sum(-1)  # (..., M)
        weights = weights.log_softmax(-1)
        joint = weights - each - math.log(2 * math.pi) / 2 * len(floor)
        total = joint.logsumexp(-1)
        shares = (joint - total[..., None]).exp_()
        ctx.save_for_backward(shares, weights, far, stds, learned)
        ctx.reach = reach
        return total

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, slope):
        shares, weights, far, stds, learned = ctx.saved_tensors
        components, channels = far.shape[-2:]
        # those far away have none: so small a number is slow to multiply (see lstm_gmm.py)
        shares = slope[..., None] * shares.masked_fill(shares < NO_SHARE, 0)
        to_numbers = far.new_empty(*slope.shape, components * (1 + 2 * channels))
        to_weights, to_means, to_log_stds = split(to_numbers, components)
        torch.addcmul(shares, slope[..., None], weights.exp(), value=-1, out=to_weights)
        pull = shares[..., None] / stds
        torch.mul(pull, far, out=to_means)  # for now, of values
        to_values = -to_means.sum(-2) if ctx.needs_input_grad[1] else None
        # (far² - 1) pull learned
        torch.addcmul(-pull, to_means, far, out=to_log_stds).mul_(learned)
        to_means.mul_(ctx.reach)
        return to_numbers, to_values, None, None, None
