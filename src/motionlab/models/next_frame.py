"""What the networks of acLSTM's comparison have in common: they answer with the next frame itself."""

from __future__ import annotations

import torch
from torch import Tensor

from ..errors import ModelError
from .checks import check_noise, checked_features, checked_start
from .fed_back import checked_real
from .noise import normal
from .recurrent import Recurrent
from .state import State


class NextFrame(Recurrent):
    """A network that names one frame, no distribution, and may be fed its own answers.

    Features go in and come out in raw units; inside they are normalised. An heir says in
    ``_run(inputs, real, state)`` what follows normalised inputs (batch, frames, kept), and its memory
    after the last; and in ``predict(state)`` what follows a state.
    """

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
        return self.normalizer.inverse(self._outputs(features, noise, real))

    def loss(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """Mean squared error of a channel (acLSTM, eq. 1 and 2), in normalised units; as `forward`."""
        return self._error(features, noise, real, given=1)

    def _error(
        self, features: Tensor, noise: Tensor | None, real: Tensor | None, given: int
    ) -> Tensor:
        """The loss of all frames but the first `given`."""
        features = checked_features(self, features)
        if features.shape[1] <= given:
            wanted = "at least 2" if given == 1 else f"more than the {given}"
            raise ModelError(
                f"loss needs {wanted} frames, since {given} of them are given to the network; these "
                f"windows have {features.shape[1]}."
            )
        real = checked_real(real, features)
        said = self._outputs(
            features[:, :-1], None if noise is None else noise[:, :-1],
            None if real is None else real[:, :-1],
        )  # fmt: skip
        return (said[:, given - 1 :] - self.normalizer(features[:, given:])).square().mean()

    def _outputs(self, features: Tensor, noise: Tensor | None, real: Tensor | None) -> Tensor:
        if noise is not None:
            features = features + noise * self.normalizer.std
        return self._run(self.normalizer(features), real, self.zero_state(len(features)))[0]

    def _seen(self, features: Tensor) -> State:
        inputs, state = self.normalizer(features), self.zero_state(len(features))
        return State(features[:, -1], *self._run(inputs, None, state)[1])

    # -- one frame after the other ----------------------------------------------------------------

    def step(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """See one frame more, x (batch, dim): the frame after it, and the state."""
        outputs, memory = self._run(self.normalizer(x)[:, None], None, state)
        return self.normalizer.inverse(outputs[:, 0]), State(x, *memory)

    def generate(
        self,
        n: int,
        start: State,
        *,
        generator: torch.Generator | None = None,
        noise: float = 0.0,
    ) -> Tensor:
        """Motion that goes on from a state: n frames (batch, n, dim), each fed back to get the next.

        Without noise there is no chance in it: one start has one future.

        Parameters
        ----------
        n : frames.
        start : from `observe`; the batch is as large as it.
        generator : source of chance, for the noise.
        noise : standard deviation of what is added to frames that are fed back, in normalised units.

        Raises
        ------
        ModelError : n is not a whole number above zero, the noise is negative, or the state is
            another model's or holds a NaN.
        """
        state = self._checked_start(n, start, noise)
        frame = self.predict(state)
        frames = [frame]
        for _ in range(n - 1):
            if noise:
                frame = frame + noise * normal(frame, generator) * self.normalizer.std
            frame, state = self.step(frame, state)
            frames.append(frame)
        return torch.stack(frames, dim=1)

    def _checked_start(self, n: int, start: State, noise: float) -> State:
        check_noise(noise)
        return checked_start(self, n, start)
