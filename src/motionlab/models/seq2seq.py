"""The residual sequence-to-sequence network: it says by how much the next frame differs.

Martinez, Black and Romero (2017), *On human motion prediction using recurrent neural networks*; a
rival of acLSTM in its table 1. Like acLSTM it is trained on frames of its own making, but all of
them come at the end of a window, and none is followed by a recorded one.
"""

from __future__ import annotations

from numbers import Integral

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import checked_features
from .fed_back import feed_back
from .next_frame import NextFrame
from .state import State


class Seq2Seq(NextFrame):
    """One GRU layer and a linear one: the step from this frame to the next.

    The encoder, which sees recorded frames, and the decoder, which goes on from them, share their
    weights, so that there is one network, which is fed its own output from some frame on. What it
    says is added to the frame that it saw: a network that says nothing repeats that frame, which
    for some 100 ms is hard to beat.

    Features go in and come out in raw units; inside they are normalised.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    width : of the GRU layer, 1024 in the paper.
    seen : recorded frames at the beginning of a training window, 50 in the paper (2 s, at its 25
        frames a second). The loss is about those after them (10 or 25 there).
    """

    layers, settings = 1, ("width", "seen")

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, width: int = 1024, seen: int = 50
    ) -> None:
        super().__init__(encoding, normalizer, width)
        for what, value in (("width", width), ("seen", seen)):
            if not isinstance(value, Integral) or value < 1:
                raise ModelError(f"Seq2Seq: {what} is {value!r}; it must be a whole number from 1.")
        self.seen = seen
        self.gru = nn.GRU(self.kept, width, batch_first=True)
        self.leave = nn.Linear(width, self.kept)

    def loss(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """Mean squared error of a channel in the frames from `seen` on, in normalised units.

        real : as in `forward`, but None means the paper's sampling-based loss: the first `seen`
            frames are recorded, all others fed back. With all of them recorded it is the loss that
            the paper calls supervised.
        """
        features = checked_features(self, features)
        if real is None:
            real = torch.arange(features.shape[1]) < self.seen
        return self._error(features, noise, real, given=self.seen)

    def _run(
        self, inputs: Tensor, real: Tensor | None, state: State
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        """Outputs (batch, frames, kept) of inputs like them, and hidden and cell after the last."""
        outputs, hidden = feed_back(self._frames, inputs, real, state.hidden.transpose(0, 1))
        hidden = hidden.to(inputs).transpose(0, 1)
        return outputs, (hidden, hidden[:, :0])

    def _frames(self, inputs: Tensor, hidden: Tensor) -> tuple[Tensor, Tensor]:
        outputs, hidden = self.gru(inputs, hidden.contiguous())
        return inputs + self.leave(outputs), hidden

    def zero_state(self, batch: int = 1) -> State:
        """As of every network here; but a GRU has no C: `cell` has no layers."""
        state = super().zero_state(batch)
        return state._replace(cell=state.cell[:, :0])

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        seen = self.normalizer(state.frame)
        return self.normalizer.inverse(seen + self.leave(state.hidden[:, -1]))
