"""The best linear guess of what lies under white noise: the floor of denoising.

Wiener (1949): if frames have a covariance C and noise has σ² in each channel, the guess of least squared
error that is linear in what is seen is the mean plus C (C + σ²)⁻¹ times what is seen beyond it. Here it is
that of whole windows, so that a frame hears those before and after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral, Real
from typing import Self

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import as_features, check_normalizer, checked_features
from .overlap import mean_of_windows, rows_of_windows


class Wiener(nn.Module):
    """Windows of `frames` frames, without the noise that it was made for; see `fit`.

    Features go in and come out in raw units; inside they are normalised.
    """

    def __init__(self, encoding: Encoding, normalizer: Normalizer, frames: int = 20) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        if not isinstance(frames, Integral) or frames < 1:
            raise ModelError(f"Wiener: frames is {frames!r}; it must be a whole number from 1.")
        self.encoding, self.normalizer, self.frames = encoding, normalizer, frames
        size = frames * len(normalizer.kept)
        self.register_buffer("weight", torch.eye(size))
        self.register_buffer("mean", torch.zeros(size))

    @classmethod
    @torch.no_grad()
    def fit(
        cls,
        encoding: Encoding,
        normalizer: Normalizer,
        clips: Sequence[Tensor],
        noise: float | Tensor,
        frames: int = 20,
        *,
        step: int = 1,
    ) -> Self:
        """The guess for noise of a standard deviation, in normalised units.

        Parameters
        ----------
        clips : clean ones, (frames, dim); those shorter than a window are left out.
        noise : of all channels, or (dim,) of each.
        frames : of a window.
        step : every so many frames of a clip a window begins.

        Raises
        ------
        ModelError : no clip is long enough, NaN, or numbers that make no sense.
        """
        if not isinstance(step, Integral) or step < 1:
            raise ModelError(f"Wiener.fit: step is {step!r}; it must be a whole number from 1.")
        model = cls(encoding, normalizer, frames)
        spread = _spread(model, noise)
        size, count = len(model.mean), 0
        total, products = torch.zeros(size), torch.zeros(size, size)
        for windows in rows_of_windows(model, clips, frames, step):
            total += windows.sum(0)
            products += windows.T @ windows
            count += len(windows)
        if not count:
            raise ModelError(
                f"Wiener.fit: none of {len(clips)} clips has {frames} frames; give longer ones."
            )
        mean = (total / count).double()
        clean = products.double() / count - torch.outer(mean, mean)
        seen = clean + torch.diag(spread.square().repeat(frames))
        model.weight.copy_(torch.linalg.solve(seen, clean).T)
        model.mean.copy_(mean)
        return model

    def project(self, features: Tensor, step: int | None = None) -> Tensor:
        """Features (batch, frames, dim) without noise; like features.

        Each frame is the mean of what is guessed in windows of `frames` frames, one every `step`
        frames, by default a quarter of them. Raises ModelError for fewer frames than a window, NaN,
        another number of channels, a step below 1 or beyond a window.
        """
        step = max(1, self.frames // 4) if step is None else step
        if not isinstance(step, Integral) or not 1 <= step <= self.frames:
            raise ModelError(f"project: step is {step!r}; it must lie between 1 and {self.frames}.")
        features = as_features(self, features)
        one = features.ndim == 2
        features = checked_features(self, features[None] if one else features)
        if features.shape[1] < self.frames:
            raise ModelError(
                f"project: {features.shape[1]} frames; windows have {self.frames}, so give as many or "
                "more."
            )
        seen = self.normalizer(features)
        found = self.normalizer.inverse(mean_of_windows(seen, self.frames, step, self._guess))
        return found[0] if one else found

    def _guess(self, seen: Tensor) -> Tensor:
        beyond = seen.flatten(1) - self.mean
        return (self.mean + beyond @ self.weight.T).unflatten(1, seen.shape[1:])


def _spread(model: Wiener, noise: float | Tensor) -> Tensor:
    """Standard deviation of the noise in each channel that is kept, (kept,) in float64."""
    dim, kept = model.encoding.dim, model.normalizer.kept
    if isinstance(noise, Real):
        noise = torch.full((dim,), float(noise))
    fits = torch.is_tensor(noise) and noise.shape == (dim,) and bool(noise.isfinite().all())
    if not fits or noise.min() <= 0:
        raise ModelError(
            f"Wiener.fit: noise must be a positive number, or {dim} of them, one a channel."
        )
    return noise[kept].double()
