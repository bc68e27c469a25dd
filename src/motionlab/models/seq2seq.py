"""The residual sequence-to-sequence network: it says by how much the next frame differs.

Martinez, Black and Romero (2017), *On human motion prediction using recurrent neural networks*; a
rival of acLSTM in its table 1. Like acLSTM it is trained on frames of its own making, but all of
them come at the end of a window, and none is followed by a recorded one.
"""

from __future__ import annotations

from numbers import Integral

import torch
from torch import Tensor, nn

from .. import encodings
from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_normalizer, checked_features, checked_start
from .fed_back import checked_real, feed_back
from .state import State


class Seq2Seq(nn.Module):
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

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, width: int = 1024, seen: int = 50
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        for what, value in (("width", width), ("seen", seen)):
            if not isinstance(value, Integral) or value < 1:
                raise ModelError(f"Seq2Seq: {what} is {value!r}; it must be a whole number from 1.")
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.seen, self.kept = width, seen, len(normalizer.kept)
        self.gru = nn.GRU(self.kept, width, batch_first=True)
        self.leave = nn.Linear(width, self.kept)

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    # -- windows ----------------------------------------------------------------------------------

    def forward(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """The frame after each of features (batch, frames, dim), from no memory; like features.

        Parameters
        ----------
        noise : like features; added to recorded frames where they are input, in normalised units.
        real : (frames,) or (batch, frames) bool; where it is False, the network sees its own output
            instead of the recorded frame. The first must be True. None: all recorded.
        """
        features = checked_features(self, features)
        real = checked_real(real, features)
        return self.normalizer.inverse(self._run(self._inputs(features, noise), real)[0])

    def loss(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """Mean squared error of a channel in the frames from `seen` on, in normalised units.

        real : as in `forward`, but None means the paper's sampling-based loss: the first `seen`
            frames are recorded, all others fed back. With all of them recorded it is the loss that
            the paper calls supervised.
        """
        features = checked_features(self, features)
        frames = features.shape[1]
        if frames <= self.seen:
            raise ModelError(
                f"loss needs more than the {self.seen} frames that are given to the network; these "
                f"windows have {frames}. Take longer ones, or a network with a smaller `seen`."
            )
        real = checked_real(torch.arange(frames) < self.seen if real is None else real, features)
        outputs, _ = self._run(self._inputs(features, noise)[:, :-1], real[:, :-1])
        aims = self.normalizer(features[:, self.seen :])
        return (outputs[:, self.seen - 1 :] - aims).square().mean()

    def _inputs(self, features: Tensor, noise: Tensor | None) -> Tensor:
        if noise is not None:
            features = features + noise * self.normalizer.std
        return self.normalizer(features)

    def _run(
        self, inputs: Tensor, real: Tensor, state: State | None = None
    ) -> tuple[Tensor, Tensor]:
        """Outputs (batch, frames, kept) of inputs like them, and hidden after the last."""
        state = state or self.zero_state(len(inputs))
        outputs, hidden = feed_back(self._frames, inputs, real, state.hidden.transpose(0, 1))
        return outputs, hidden.to(inputs).transpose(0, 1)

    def _frames(self, inputs: Tensor, hidden: Tensor) -> tuple[Tensor, Tensor]:
        outputs, hidden = self.gru(inputs, hidden.contiguous())
        return inputs + self.leave(outputs), hidden

    # -- one frame after the other ----------------------------------------------------------------

    def zero_state(self, batch: int = 1) -> State:
        """The state of a network that has seen nothing; its frame is the mean frame.

        A GRU has no C: `cell` has no layers.
        """
        mean = self.normalizer.mean
        hidden = mean.new_zeros(batch, 1, self.width)
        return State(mean.expand(batch, -1), hidden, hidden[:, :0])

    def observe(self, features: Tensor) -> State:
        """The state after features (batch, frames, dim), or (frames, dim) for a batch of one."""
        features = torch.as_tensor(features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        _, hidden = self._run(self.normalizer(features), checked_real(None, features))
        return State(features[:, -1], hidden, hidden[:, :0])

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        seen = self.normalizer(state.frame)
        return self.normalizer.inverse(seen + self.leave(state.hidden[:, -1]))

    def step(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """See one frame more, x (batch, dim): the frame after it, and the state."""
        inputs = self.normalizer(x)[:, None]
        outputs, hidden = self._run(inputs, checked_real(None, inputs), state)
        return self.normalizer.inverse(outputs[:, 0]), State(x, hidden, hidden[:, :0])

    def generate(self, n: int, start: State, *, generator: torch.Generator | None = None) -> Tensor:
        """Motion that goes on from a state: n frames (batch, n, dim), each fed back to get the next.

        There is no chance in it: one start has one future.

        Parameters
        ----------
        n : frames.
        start : from `observe`; the batch is as large as it.
        generator : not used; other models draw from it.

        Raises
        ------
        ModelError : n is not a whole number above zero, the state is another model's or holds a NaN.
        """
        state = checked_start(self, n, start, (1, self.width), cell=(0, self.width))
        frame = self.predict(state)
        frames = [frame]
        for _ in range(n - 1):
            frame, state = self.step(frame, state)
            frames.append(frame)
        return torch.stack(frames, dim=1)

    # -- what is stored with the weights ----------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        return {
            "encoding": self.encoding.config(),
            "kept": self.kept,
            "width": self.width,
            "seen": self.seen,
        }

    @classmethod
    def from_config(cls, config: dict) -> Seq2Seq:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, config["kept"])
        return cls(encoding, normalizer, config["width"], config["seen"])
