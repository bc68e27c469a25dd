"""Two temporal networks that STRNN's authors tried and let go: of GRU cells, and with attention.

Wang, Ho, Shum and Zhu (2021), *Spatio-temporal Manifold Learning for Human Motions via Long-horizon
Modeling*, section 8.1. Each is the Temporal row of the ablations but for one choice: an encoder, a
backward decoder and a forward predictor, which hear their own last frame. An LSTM that hears itself is
an LSTM with other weights for h (`models.going_on`). These are not, and so they loop over frames.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from motionlab.encodings import BodyFrame, Normalizer
from motionlab.models import Strnn


class _Looped(Strnn):
    """What both share; `width` and the rest are as of `Strnn`, without spatial and residual network."""

    settings = ("width", "encode", "predict", "smooth", "penalty")

    def __init__(
        self, encoding: BodyFrame, normalizer: Normalizer, width: int = 512, encode: int = 20,
        predict: int = 20, *, smooth: float = 0.0, penalty: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(
            encoding, normalizer, width, encode, predict, spatial=False, residual=False, drop=0.0,
            smooth=smooth, penalty=penalty,
        )  # fmt: skip

    def _told(
        self, state: tuple[Tensor, ...], true: Tensor | None = None,
        chance: torch.Generator | None = None, decoded: bool = True,
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """As `Strnn._told`; it always hears itself, and drops nothing."""
        codes = self.predictor(state, self.predict, self.leave)
        if decoded:
            back = self.decoder(state, self.encode, self.leave)
            codes = torch.cat([back.flip(1), codes], 1)
        return self.leave(codes), codes


class GruStrnn(_Looped):
    """GRU cells (Cho et al. 2014) instead of LSTM cells: three gates instead of four, and no C."""

    codes = 1

    def __init__(
        self, encoding: BodyFrame, normalizer: Normalizer, *sizes: int, **costs: float
    ) -> None:
        super().__init__(encoding, normalizer, *sizes, **costs)
        self.encoder = nn.GRU(self.kept, self.width, batch_first=True)
        self.decoder, self.predictor = (_Gru(self.kept, self.width) for _ in range(2))

    def _state(self, seen: Tensor, chance: torch.Generator | None = None) -> tuple[Tensor, ...]:
        return (self.encoder(seen)[1],)


class AttentiveStrnn(_Looped):
    """Decoder and predictor look back at every frame that was read, and hear a mean of them, too.

    Attention is that of Bahdanau, Cho and Bengio (2015), *Neural machine translation by jointly
    learning to align and translate*, section 3.1: it came with the encoders and decoders that the
    paper builds on, and puts the whole prefix before a step, which the paper calls a context. What the
    paper cites for attention is about poses in pictures, and settles nothing.
    """

    def __init__(
        self, encoding: BodyFrame, normalizer: Normalizer, *sizes: int, **costs: float
    ) -> None:
        super().__init__(encoding, normalizer, *sizes, **costs)
        self.codes = 2 + self.encode  # h, C, and the encoder's h after every frame
        self.decoder, self.predictor = (_Attentive(self.kept, self.width) for _ in range(2))

    def _state(self, seen: Tensor, chance: torch.Generator | None = None) -> tuple[Tensor, ...]:
        each, (h, cell) = self.encoder(seen)
        return h, cell, *(after[None] for after in each.unbind(1))


class _Gru(nn.Module):
    """A GRU cell that goes on from a state and hears what it says.

    What it hears does not pass the gate that its own h passes: there are no weights for h that do both.
    """

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.cell = nn.GRUCell(inputs, width)

    def forward(self, state: tuple[Tensor, ...], n: int, says: nn.Linear) -> Tensor:
        """Its h (batch, n, width) in the n frames after a state, h (1, batch, width)."""
        (h,), made = state[0], []
        for _ in range(n):
            h = self.cell(says(h), h)
            made.append(h)
        return torch.stack(made, 1)


class _Attentive(nn.Module):
    """An LSTM cell that goes on from a state, and hears what it says and what it looks back at."""

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.cell = nn.LSTMCell(inputs + width, width)
        self.asked, self.wanted = nn.Linear(width, width), nn.Linear(width, width, bias=False)
        self.score = nn.Linear(width, 1, bias=False)

    def forward(self, state: tuple[Tensor, ...], n: int, says: nn.Linear) -> Tensor:
        """Its h (batch, n, width) in the n frames after a state: h, C and the encoder's h after each
        frame, (1, batch, width) each."""
        h, cell, *read = (part[0] for part in state)
        read, made = torch.stack(read, 1), []
        asked = self.asked(read)
        for _ in range(n):
            context = (self.weights(asked, h) * read).sum(1)
            h, cell = self.cell(torch.cat([says(h), context], -1), (h, cell))
            made.append(h)
        return torch.stack(made, 1)

    def weights(self, asked: Tensor, h: Tensor) -> Tensor:
        """How much each frame that was read counts, (batch, encode, 1): shares of one."""
        return self.score((asked + self.wanted(h)[:, None]).tanh()).softmax(1)
