"""ERD, the encoder-recurrent-decoder: what the body looks like, and how that changes, kept apart.

Fragkiadaki, Levine, Felsen and Malik (2015), *Recurrent Network Models for Human Dynamics*; a rival
of acLSTM in its table 1. Against its own mistakes it has another remedy than acLSTM: noise on the
recorded frames, more and more of it, so that a frame that is a little wrong is nothing new.
"""

from __future__ import annotations

from bisect import bisect_right
from numbers import Integral

import torch
from torch import Tensor, nn

from .. import encodings
from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_normalizer, checked_features, checked_start
from .fed_back import checked_real, feed_back
from .state import State

# Share of the training done, and the noise from there on; see `noise_schedule`.
_FROM = (0.05, 0.1, 0.2, 0.26, 0.4, 0.5, 0.66)
_NOISE = (0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7)


def noise_schedule(progress: float) -> float:
    """Standard deviation of the noise on ERD's inputs, in normalised units.

    Fragkiadaki et al. add more and more of it as training goes on. The steps are those of Jain et
    al. (2016, *Structural-RNN*), whose code trains an ERD to compare with: 0.01, 0.05, 0.1, 0.2,
    0.3, 0.5, 0.7 from update 250, 500, 1000, 1300, 2000, 2500, 3300. Here they are shares of 5000
    updates, after which that code takes the network for its forecasts. (It disturbs a random half
    of the frames.)

    progress : share of the training done, from 0 to 1. Raises ModelError.
    """
    if not 0 <= progress <= 1:
        raise ModelError(f"noise_schedule: progress is {progress!r}; it is a share, from 0 to 1.")
    return _NOISE[bisect_right(_FROM, progress)]


class Erd(nn.Module):
    """FC - FC - LSTM - LSTM - FC - FC - linear: the next frame itself.

    Two layers bring a frame into a space where motion is simple, two LSTM layers move it there, and
    two more layers bring it back. The last of them is narrow: all poses that it can say are mixtures
    of a hundred.

    Features go in and come out in raw units; inside they are normalised.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    width : of the LSTM layers, 1000 in the paper. The other layers keep their share of it: the
        encoder's are half as wide (500, 500), the decoder's a half and a tenth (500, 100).
    """

    def __init__(self, encoding: Encoding, normalizer: Normalizer, width: int = 1000) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        if not isinstance(width, Integral) or width < 10:
            raise ModelError(f"Erd: width is {width!r}; it must be a whole number from 10.")
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.kept = width, len(normalizer.kept)
        half, tenth = width // 2, width // 10
        self.enter = nn.Sequential(
            nn.Linear(self.kept, half), nn.ReLU(), nn.Linear(half, half), nn.ReLU()
        )
        self.lstm = nn.LSTM(half, width, num_layers=2, batch_first=True)
        self.leave = nn.Sequential(
            nn.Linear(width, half), nn.ReLU(), nn.Linear(half, tenth), nn.ReLU(),
            nn.Linear(tenth, self.kept),
        )  # fmt: skip

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
            instead of the recorded frame. The first must be True.
        """
        features = checked_features(self, features)
        real = checked_real(real, features)
        return self.normalizer.inverse(self._run(self._inputs(features, noise), real)[0])

    def loss(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """Mean squared error of a channel, in normalised units; as `forward`."""
        features = checked_features(self, features)
        if features.shape[1] < 2:
            raise ModelError("loss needs at least 2 frames: the first one is given.")
        real = checked_real(real, features)
        outputs, _ = self._run(self._inputs(features, noise)[:, :-1], real[:, :-1])
        return (outputs - self.normalizer(features[:, 1:])).square().mean()

    def _inputs(self, features: Tensor, noise: Tensor | None) -> Tensor:
        if noise is not None:
            features = features + noise * self.normalizer.std
        return self.normalizer(features)

    def _run(
        self, inputs: Tensor, real: Tensor, state: State | None = None
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        """Outputs (batch, frames, kept) of inputs like them, and hidden and cell after the last."""
        state = state or self.zero_state(len(inputs))
        memory = state.hidden.transpose(0, 1), state.cell.transpose(0, 1)
        outputs, memory = feed_back(self._frames, inputs, real, memory)
        return outputs, tuple(part.to(inputs).transpose(0, 1) for part in memory)

    def _frames(
        self, inputs: Tensor, memory: tuple[Tensor, Tensor]
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        moved, memory = self.lstm(self.enter(inputs), tuple(part.contiguous() for part in memory))
        return self.leave(moved).to(inputs), memory

    # -- one frame after the other ----------------------------------------------------------------

    def zero_state(self, batch: int = 1) -> State:
        """The state of a network that has seen nothing; its frame is the mean frame."""
        mean = self.normalizer.mean
        memory = mean.new_zeros(batch, 2, self.width)
        return State(mean.expand(batch, -1), memory, memory)

    def observe(self, features: Tensor) -> State:
        """The state after features (batch, frames, dim), or (frames, dim) for a batch of one."""
        features = torch.as_tensor(features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        inputs = self.normalizer(features)
        return State(features[:, -1], *self._run(inputs, checked_real(None, features))[1])

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        return self.normalizer.inverse(self.leave(state.hidden[:, -1]))

    def step(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """See one frame more, x (batch, dim): the frame after it, and the state."""
        inputs = self.normalizer(x)[:, None]
        outputs, memory = self._run(inputs, checked_real(None, inputs), state)
        return self.normalizer.inverse(outputs[:, 0]), State(x, *memory)

    def generate(self, n: int, start: State, *, generator: torch.Generator | None = None) -> Tensor:
        """Motion that goes on from a state: n frames (batch, n, dim), each fed back to get the next.

        There is no chance in it, and no noise: one start has one future.

        Parameters
        ----------
        n : frames.
        start : from `observe`; the batch is as large as it.
        generator : not used; other models draw from it.

        Raises
        ------
        ModelError : n is not a whole number above zero, the state is another model's or holds a NaN.
        """
        state = checked_start(self, n, start, (2, self.width))
        frame = self.predict(state)
        frames = [frame]
        for _ in range(n - 1):
            frame, state = self.step(frame, state)
            frames.append(frame)
        return torch.stack(frames, dim=1)

    # -- what is stored with the weights ----------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        return {"encoding": self.encoding.config(), "kept": self.kept, "width": self.width}

    @classmethod
    def from_config(cls, config: dict) -> Erd:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        return cls(encoding, Normalizer(encoding.dim, config["kept"]), config["width"])
