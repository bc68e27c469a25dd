"""The decoders of STRNN: LSTM layers that go on from a state and hear themselves."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class GoingOn(nn.Module):
    """An LSTM layer that goes on from a state and hears what it has said itself.

    What it says is a linear function of its own h. So to hear it is to have other weights for h: an
    LSTM without input, which is one call for all frames, and no loop in Python.
    """

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.heard = nn.Linear(inputs, 4 * width)
        self.own = nn.Linear(width, 4 * width, bias=False)
        for parameter in self.parameters():
            nn.init.uniform_(parameter, -(width**-0.5), width**-0.5)

    def alone(self, says: nn.Linear | None) -> tuple[Tensor, Tensor]:
        """Weights for h and bias with which it hears itself.

        says : makes what is heard of h; None: h is heard as it is.
        """
        weight, bias = self.heard.weight, self.heard.bias
        if says is not None:
            weight, bias = weight @ says.weight, bias + weight @ says.bias
        return self.own.weight + weight, bias

    def forward(
        self, state: tuple[Tensor, Tensor], n: int, alone: tuple[Tensor, Tensor],
        true: Tensor | None = None,
    ) -> Tensor:  # fmt: skip
        """Its h (batch, n, width) in the n frames after a state, h and C (1, batch, width) each.

        alone : what `alone` gives.
        true : (batch, n - 1, inputs), heard instead from the second frame on (unconditional decoding).
        """
        weight, bias = alone
        frames = n if true is None else 1
        nothing = state[0].new_zeros(state[0].shape[1], frames, 1)
        h, *state = _lstm(nothing, state, weight.new_zeros(len(weight), 1), weight, bias)
        if true is None or n == 1:
            return h
        more, *_ = _lstm(true, state, self.heard.weight, self.own.weight, self.heard.bias)
        return torch.cat([h, more], 1)


def _lstm(inputs: Tensor, state, heard: Tensor, own: Tensor, bias: Tensor):
    """One layer in torch's own loop: h of all frames, and the last h and C."""
    weights = [heard, own, bias, torch.zeros_like(bias)]
    return torch.lstm(inputs, tuple(state), weights, True, 1, 0.0, True, False, True)
