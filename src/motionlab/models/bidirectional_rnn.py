"""A bidirectional RNN under STRNN's scheme: frames in, the same and the next frames out; STRNN's rival.

Du, Wang and Wang (2015), *Hierarchical recurrent neural network for skeleton based action
recognition*, read a motion forwards and backwards at once. Wang and others (2021), section 6.1, let
such a network say frames, and call it BidirSimpleRNN. Its units are plain: tanh, no gates.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ..encodings import BodyFrame, Normalizer
from .strnn import Strnn


class BidirectionalRnn(Strnn):
    """Two plain RNN layers read frames, one from each end; a backward decoder and a forward predictor,
    plain RNN layers as well, go on from what both know.

    What it says and is asked for, its loss and its methods are those of `Strnn`, without spatial and
    residual network.

    Parameters
    ----------
    encoding : `BodyFrame`.
    normalizer : fitted on the training split.
    width : of decoder and predictor; each direction of the encoder has half of it. A multiple of 8.
    encode, predict, smooth, penalty : as of `Strnn`.

    Raises
    ------
    ModelError : as `Strnn` does.
    """

    codes = 1
    settings = ("width", "encode", "predict", "smooth", "penalty")

    def __init__(
        self,
        encoding: BodyFrame,
        normalizer: Normalizer,
        width: int = 512,
        encode: int = 20,
        predict: int = 20,
        *,
        smooth: float = 0.0,
        penalty: float = 0.0,
    ) -> None:
        super().__init__(
            encoding, normalizer, width, encode, predict, spatial=False, residual=False, drop=0.0,
            smooth=smooth, penalty=penalty,
        )  # fmt: skip
        self.encoder = nn.RNN(self.kept, width // 2, batch_first=True, bidirectional=True)
        self.decoder, self.predictor = (_Alone(self.kept, width) for _ in range(2))

    def _state(self, seen: Tensor, chance: torch.Generator | None = None) -> tuple[Tensor, ...]:
        _, both = self.encoder(seen)
        return (torch.cat([both[0], both[1]], 1)[None],)

    def _told(
        self, state: tuple[Tensor, ...], true: Tensor | None = None,
        chance: torch.Generator | None = None, decoded: bool = True,
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """As `Strnn._told`; it always hears itself, and drops nothing."""
        ((state,),) = state
        codes = self.predictor(state, self.predict, self.leave)
        if decoded:
            back = self.decoder(state, self.encode, self.leave)
            codes = torch.cat([back.flip(1), codes], 1)
        return self.leave(codes), codes


class _Alone(nn.Module):
    """A plain RNN layer that goes on from a state and hears what it says, a linear function of its h."""

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.heard, self.own = nn.Linear(inputs, width), nn.Linear(width, width, bias=False)
        for parameter in self.parameters():
            nn.init.uniform_(parameter, -(width**-0.5), width**-0.5)

    def forward(self, state: Tensor, n: int, says: nn.Linear) -> Tensor:
        """Its h (batch, n, width) in the n frames after a state (batch, width)."""
        weight = self.own.weight + self.heard.weight @ says.weight
        bias = self.heard.bias + self.heard.weight @ says.bias
        made = []
        for _ in range(n):
            state = torch.addmm(bias, state, weight.T).tanh()
            made.append(state)
        return torch.stack(made, 1)
