"""N-gram: what followed the most similar frames of the training clips follows again.

The 6-gram of Fragkiadaki, Levine, Felsen and Malik (2015), *Recurrent Network Models for Human
Dynamics*, which Wang and others (2021) take over: a nearest neighbour of six frames, and no model.
Nothing that it says is unnatural, and nothing is new.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_counts, check_normalizer, checked_features, checked_going_on

AT_ONCE = 1 << 24  # distances in memory


class Ngram(nn.Module):
    """The frames after the `encode` frames of some clips that are nearest; see `fit`.

    Features go in and come out in raw units; they are compared normalised.
    """

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, encode: int = 6, predict: int = 20
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        check_counts("Ngram", encode=encode, predict=predict)
        self.encoding, self.normalizer = encoding, normalizer
        self.encode, self.predict = encode, predict
        self.kept = kept = len(normalizer.kept)
        self.register_buffer("rows", torch.zeros(0, kept))
        self.register_buffer("starts", torch.zeros(0, dtype=torch.long))

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    @classmethod
    @torch.no_grad()
    def fit(
        cls, encoding: Encoding, normalizer: Normalizer, clips: Sequence[Tensor], encode: int = 6,
        predict: int = 20,
    ) -> Self:  # fmt: skip
        """One that remembers clips (frames, dim).

        predict : frames that follow at once; then it looks again. Raises ModelError if no clip is that
        much longer than `encode`, or for NaN.
        """
        model = cls(encoding, normalizer, encode, predict)
        long = [clip for clip in clips if len(clip) >= encode + predict]
        if not long:
            raise ModelError(
                f"Ngram.fit: none of {len(clips)} clips has {encode + predict} frames; give longer "
                "ones, or fit shorter windows."
            )
        rows = [normalizer(checked_features(model, clip[None])[0]) for clip in long]
        ends = torch.tensor([len(clip) for clip in long]).cumsum(0).tolist()
        model.rows = torch.cat(rows)
        model.starts = torch.cat([
            torch.arange(end - len(clip), end - encode - predict + 1)
            for end, clip in zip(ends, long, strict=True)
        ])  # fmt: skip
        return model

    def extrapolate(self, features: Tensor, n: int) -> Tensor:
        """n frames (batch, n, dim) that go on from features (batch, frames, dim).

        Of features (frames, dim) it is (n, dim).

        Raises
        ------
        ModelError : nothing is remembered, fewer frames than `encode`, another number of channels, NaN,
            or n below 1.
        """
        if not len(self.starts):
            raise ModelError("extrapolate: this n-gram remembers nothing; `Ngram.fit` makes one.")
        features, one = checked_going_on(self, features, n, self.encode, "this n-gram")
        seen, made = self.normalizer(features)[:, -self.encode :], []
        for _ in range(-(-n // self.predict)):
            after = self._nearest(seen) + self.encode
            made.append(self.rows[after[:, None] + torch.arange(self.predict)])
            seen = torch.cat([seen, made[-1]], 1)[:, -self.encode :]
        found = self.normalizer.inverse(torch.cat(made, 1)[:, :n])
        return found[0] if one else found

    def _nearest(self, seen: Tensor) -> Tensor:
        """First rows (batch,) of the windows of least squared distance to seen (batch, encode, kept)."""
        best = seen.new_full((len(seen),), torch.inf)
        found = self.starts.new_zeros(len(seen))
        squares = self.rows.square().sum(1)
        for starts in self.starts.split(max(1, AT_ONCE // len(seen))):
            far = seen.new_zeros(len(seen), len(starts))
            for t in range(self.encode):
                far += squares[starts + t]
                far.addmm_(seen[:, t], self.rows[starts + t].T, alpha=-2)
            least, which = far.min(1)
            nearer = least < best
            best = torch.where(nearer, least, best)
            found = torch.where(nearer, starts[which], found)
        return found
