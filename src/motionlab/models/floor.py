"""Forecasts that nobody trained. A network that does not beat them has learnt nothing.

For a tenth of a second they are hard to beat: Martinez, Black and Romero (2017, *On human motion
prediction using recurrent neural networks*) found zero velocity to be as good as the best networks
published before theirs.
"""

from __future__ import annotations

from numbers import Integral

import torch
from torch import Tensor, nn

from ..encodings import Normalizer, RootRelative
from ..errors import ModelError
from .checks import checked_features, checked_start
from .state import State


class _Floor(nn.Module):
    """Remembers the last `memory` frames and, by `_go_on`, draws a line from them."""

    def __init__(self, encoding: RootRelative, memory: int) -> None:
        super().__init__()
        if not isinstance(encoding, RootRelative):
            raise ModelError(f"{type(self).__name__} needs a RootRelative encoding.")
        self.encoding, self.memory = encoding, memory
        self.normalizer = Normalizer(encoding.dim)  # changes nothing; has the device and precision
        # what a row tells of the root is how far it goes; only its height may be a place
        self.steps = [0, 2] if encoding.height == "absolute" else [0, 1, 2]

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    def zero_state(self, batch: int = 1) -> State:
        """The state after frames of zeros."""
        frames = self.normalizer.mean.new_zeros(batch, self.memory, self.encoding.dim)
        return State(frames[:, -1], frames, frames[:, :0])

    def observe(self, features: Tensor) -> State:
        """The state after features (batch, frames, dim), or (frames, dim) for a batch of one.

        Its `hidden` are the last `memory` frames (batch, memory, dim); `cell` has no layers.
        """
        features = torch.as_tensor(features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        if features.shape[1] < self.memory:
            raise ModelError(
                f"{type(self).__name__} needs {self.memory} frames to go on from; these features "
                f"have {features.shape[1]}."
            )
        return State(features[:, -1], features[:, -self.memory :], features[:, :0])

    def generate(self, n: int, start: State, *, generator: torch.Generator | None = None) -> Tensor:
        """n frames (batch, n, dim) after those that a state has seen; raises ModelError."""
        start = checked_start(self, n, start)
        times = torch.arange(1, n + 1).to(start.frame)[:, None]  # in frames
        return self._go_on(start.hidden, times)


class RunningAverage(_Floor):
    """The mean pose of the last frames, for ever; the root stays where it is.

    frames : how many; Martinez et al. take 2 and 4.
    """

    def __init__(self, encoding: RootRelative, frames: int = 2) -> None:
        if not isinstance(frames, Integral) or frames < 1:
            raise ModelError(f"RunningAverage of {frames!r} frames; it must be 1 or more.")
        super().__init__(encoding, frames)

    def _go_on(self, frames: Tensor, times: Tensor) -> Tensor:
        pose = frames.mean(1)
        pose[:, self.steps] = 0
        return pose[:, None].repeat(1, len(times), 1)


class ZeroVelocity(RunningAverage):
    """The last frame, for ever; the root stays where it is."""

    def __init__(self, encoding: RootRelative) -> None:
        super().__init__(encoding, frames=1)


class ConstantVelocity(_Floor):
    """Every point goes on as it went from the last frame but one to the last, in a straight line."""

    def __init__(self, encoding: RootRelative) -> None:
        super().__init__(encoding, memory=2)

    def _go_on(self, frames: Tensor, times: Tensor) -> Tensor:
        velocity = frames[:, 1] - frames[:, 0]
        velocity[:, self.steps] = 0  # those of the root are velocities themselves
        return frames[:, 1, None] + times * velocity[:, None]
