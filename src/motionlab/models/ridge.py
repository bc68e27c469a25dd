"""Ridge regression: the next frames as a linear function of the last ones, found in one go.

A floor for networks that foretell many frames at once: who does not beat it has learnt nothing that
lines do not say. The penalty of Hoerl and Kennard (1970) keeps weights small where channels say the
same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Self

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_counts, check_normalizer, checked_going_on
from .overlap import rows_of_windows


class Ridge(nn.Module):
    """`predict` frames as a linear function of the `encode` frames before them; see `fit`.

    Features go in and come out in raw units; inside they are normalised.
    """

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, encode: int = 20, predict: int = 20
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        check_counts("Ridge", encode=encode, predict=predict)
        self.encoding, self.normalizer = encoding, normalizer
        self.encode, self.predict = encode, predict
        self.kept = kept = len(normalizer.kept)
        self.register_buffer("weight", torch.zeros(predict * kept, encode * kept))
        self.register_buffer("bias", torch.zeros(predict * kept))

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    @classmethod
    @torch.no_grad()
    def fit(
        cls,
        encoding: Encoding,
        normalizer: Normalizer,
        clips: Sequence[Tensor],
        encode: int = 20,
        predict: int = 20,
        *,
        penalty: float = 1e-3,
        step: int = 1,
    ) -> Self:
        """The weights of least squared error on clips (frames, dim), in normalised units.

        Parameters
        ----------
        clips : those shorter than `encode` + `predict` frames are left out.
        penalty : of squared weights, as a share of the mean variance of the inputs.
        step : every so many frames of a clip a window begins.

        Raises
        ------
        ModelError : no clip is long enough, NaN, or numbers that make no sense.
        """
        if not isinstance(penalty, Real) or not 0 < penalty < math.inf:
            raise ModelError(f"Ridge.fit: penalty is {penalty!r}; it must be a positive number.")
        if not isinstance(step, Integral) or step < 1:
            raise ModelError(f"Ridge.fit: step is {step!r}; it must be a whole number from 1.")
        if max(map(len, clips), default=0) < encode + predict:
            raise ModelError(
                f"Ridge.fit: none of {len(clips)} clips has {encode + predict} frames; give longer "
                "ones, or fit shorter windows."
            )
        model = cls(encoding, normalizer, encode, predict)
        inputs, frames = encode * model.kept, encode + predict
        size = inputs + predict * model.kept
        total, products, count = torch.zeros(size), torch.zeros(inputs, size), 0
        for windows in rows_of_windows(model, clips, frames, step):
            total += windows.sum(0)
            products += windows[:, :inputs].T @ windows
            count += len(windows)
        mean = (total / count).double()
        both = products.double() / count - torch.outer(mean[:inputs], mean)
        own = both[:, :inputs]
        own.diagonal().add_(penalty * float(own.diagonal().mean()))
        weight = torch.linalg.solve(own, both[:, inputs:]).T
        model.weight.copy_(weight)
        model.bias.copy_(mean[inputs:] - weight @ mean[:inputs])
        return model

    def forward(self, features: Tensor) -> Tensor:
        """The frames (batch, predict, dim) after features (batch, encode, dim)."""
        return self.extrapolate(features[:, -self.encode :], self.predict)

    def extrapolate(self, features: Tensor, n: int) -> Tensor:
        """n frames (batch, n, dim) that go on from features (batch, frames, dim), in open loop.

        Of features (frames, dim) it is (n, dim).

        Raises
        ------
        ModelError : fewer frames than `encode`, another number of channels, NaN, or n below 1.
        """
        features, one = checked_going_on(self, features, n, self.encode, "this regression")
        seen, made = self.normalizer(features)[:, -self.encode :], []
        for _ in range(-(-n // self.predict)):
            said = torch.nn.functional.linear(seen.flatten(1), self.weight, self.bias)
            made.append(said.unflatten(1, (self.predict, -1)))
            seen = torch.cat([seen, made[-1]], 1)[:, -self.encode :]
        found = self.normalizer.inverse(torch.cat(made, 1)[:, :n])
        return found[0] if one else found
