"""The memory that a first frame lacks (RNN-GAN, section 5.4, "Initial State Estimation")."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from ..errors import ModelError
from ..models import State


def initial_state(
    model: nn.Module, features: Tensor, *, iterations: int = 100, rate: float = 0.05
) -> State:
    """The state after a first frame from which the frames after it are likely to follow (eq. 27).

    A network that has seen one frame knows neither how fast the body moves nor where in the stride
    it is: started from zeros, its motion hops between the first frame and the second. So look for
    the memory h₁ it should have had before the first frame s₁: minimise E = -log P(s₂ | s₁, h₁).
    That is the paper's, with two frames. Give three or more: two fit so many memories that the hop
    only comes one frame later. E is then the sum over all frames but the first.

    The paper descends the gradient of E; here Adam does. Searched are both layers' h, as tanh of
    free numbers, since an LSTM's h never leaves (-1, 1), and C; all begin at zero. For each
    character the best of all iterations is kept: it is never less likely than from zeros.

    Parameters
    ----------
    model : with ``step`` and ``zero_state``, such as `LstmGmm`; not changed.
    features : (batch, frames, dim), or (frames, dim) for a batch of one; raw units.
    iterations : steps downhill.
    rate : of learning.

    Returns
    -------
    State : after the first frame, detached: what ``model.generate`` makes of it takes the place of
        the second frame and of those that follow.

    Raises
    ------
    ModelError : fewer than two frames, another encoding's features, NaN, or a setting that makes no
        sense.
    """
    if not iterations >= 1 or not 0 < rate < math.inf:
        raise ModelError(
            f"initial_state: {iterations} iterations at rate {rate}; both must be above 0."
        )
    features = torch.as_tensor(features)
    features = features[None] if features.ndim == 2 else features
    model.log_prob(features.detach())  # refuses what are no two frames of its own
    frames = features.detach().to(model.normalizer.mean)
    first, targets = frames[:, 0], model.normalizer(frames)
    zero = model.zero_state(len(first))
    free = [part.clone().requires_grad_() for part in (zero.hidden, zero.cell)]
    adam = torch.optim.Adam(free, lr=rate)
    least, best = first.new_full((len(first),), math.inf), zero
    # cuDNN's LSTM has no gradient in eval mode
    with torch.enable_grad(), torch.backends.cudnn.flags(enabled=False):
        for _ in range(iterations + 1):
            hidden, cell = free
            mixture, after = model.step(first, State(first, hidden.tanh(), cell))
            energy, state = -mixture.log_prob(targets[:, 1]), after  # (batch,)
            for t in range(1, frames.shape[1] - 1):
                mixture, state = model.step(frames[:, t], state)
                energy = energy - mixture.log_prob(targets[:, t + 1])
            better = energy.detach() < least
            least = torch.where(better, energy.detach(), least)
            best = _where(better, after, best)
            adam.zero_grad()
            energy.sum().backward(inputs=free)  # characters don't touch each other's gradients
            adam.step()
    return best


def _where(chosen: Tensor, state: State, other: State) -> State:
    """Rows (batch,) of one state or of the other, detached."""
    return State(*(
        torch.where(chosen.view(-1, *[1] * (a.ndim - 1)), a.detach(), b)
        for a, b in zip(state, other, strict=True)
    ))  # fmt: skip
