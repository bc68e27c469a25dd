"""ERD, the encoder-recurrent-decoder: what the body looks like, and how that changes, kept apart.

Fragkiadaki, Levine, Felsen and Malik (2015), *Recurrent Network Models for Human Dynamics*; a rival
of acLSTM in its table 1. Against its own mistakes it has another remedy than acLSTM: noise on the
recorded frames, more and more of it, so that a frame that is a little wrong is nothing new.
"""

from __future__ import annotations

from bisect import bisect_right
from numbers import Integral

from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .fed_back import feed_back
from .next_frame import NextFrame
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


class Erd(NextFrame):
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
        super().__init__(encoding, normalizer, width)
        if not isinstance(width, Integral) or width < 10:
            raise ModelError(f"Erd: width is {width!r}; it must be a whole number from 10.")
        half, tenth = width // 2, width // 10
        self.enter = nn.Sequential(
            nn.Linear(self.kept, half), nn.ReLU(), nn.Linear(half, half), nn.ReLU()
        )
        self.lstm = nn.LSTM(half, width, num_layers=2, batch_first=True)
        self.leave = nn.Sequential(
            nn.Linear(width, half), nn.ReLU(), nn.Linear(half, tenth), nn.ReLU(),
            nn.Linear(tenth, self.kept),
        )  # fmt: skip

    def _run(
        self, inputs: Tensor, real: Tensor | None, state: State
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        """Outputs (batch, frames, kept) of inputs like them, and hidden and cell after the last."""
        memory = state.hidden.transpose(0, 1), state.cell.transpose(0, 1)
        outputs, memory = feed_back(self._frames, inputs, real, memory)
        return outputs, tuple(part.to(inputs).transpose(0, 1) for part in memory)

    def _frames(
        self, inputs: Tensor, memory: tuple[Tensor, Tensor]
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        moved, memory = self.lstm(self.enter(inputs), tuple(part.contiguous() for part in memory))
        return self.leave(moved).to(inputs), memory

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        return self.normalizer.inverse(self.leave(state.hidden[:, -1]))
