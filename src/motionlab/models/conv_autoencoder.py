"""A convolutional autoencoder over time: STRNN's rival in denoising, which its paper calls SC.

Holden, Saito, Komura and Joyce (2015), *Learning Motion Manifolds with Convolutional Autoencoders*. Each
layer looks for patterns of half a second in those below it and keeps the stronger of two frames; the
way back spreads each over two frames again. What can't be said in few patterns is left out, noise above
all. It learns from frames of which some numbers are missing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral
from typing import Self

import torch
from torch import Tensor, nn
from torch.nn.functional import max_pool1d

from .. import encodings
from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import as_features, check_normalizer, checked_features


class ConvAutoencoder(nn.Module):
    """Frames in, the same frames out, by way of fewer and wider ones.

    Features go in and come out in raw units; inside they are normalised. Clips may have any length:
    what is missing to a multiple of 2 to the number of layers is filled up with the last frame.

    Parameters
    ----------
    encoding : such as `BodyFrame`.
    normalizer : fitted on the training split.
    widths : patterns of each layer.
    span : frames of a pattern, an odd number.
    missing : share of the numbers of a frame that are zero in training.
    sparse : what the mean size of the innermost numbers costs in training.

    Raises
    ------
    ModelError : a normaliser of other features, sizes that make no sense.
    """

    settings = ("widths", "span", "missing", "sparse")

    def __init__(
        self,
        encoding: Encoding,
        normalizer: Normalizer,
        widths: Sequence[int] = (64, 128, 256),
        span: int = 15,
        *,
        missing: float = 0.1,
        sparse: float = 0.01,
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        _check(widths, span, missing, sparse)
        self.encoding, self.normalizer = encoding, normalizer
        self.widths, self.span, self.missing, self.sparse = tuple(widths), span, missing, sparse
        sizes = [len(normalizer.kept), *widths]
        layer = lambda i, o: nn.Conv1d(i, o, span, padding=span // 2)
        self.down = nn.ModuleList(map(layer, sizes[:-1], sizes[1:]))
        self.up = nn.ModuleList(map(layer, sizes[:0:-1], sizes[-2::-1]))

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    def loss(self, features: Tensor, noise: Tensor | None = None, lots: Tensor | None = None) -> Tensor:  # fmt: skip
        """Mean squared error of features (batch, frames, dim) said again, normalised.

        noise : like features; added to what is read, in normalised units.
        lots : (batch,) whole numbers; the first is the seed of what is missing. None: nothing is.
        """
        true = self.normalizer(checked_features(self, features))
        seen = true if noise is None else true + noise[..., self.normalizer.kept]
        if lots is not None and self.missing:
            chance = torch.Generator(true.device).manual_seed(int(lots[0]))
            seen = seen * torch.empty_like(seen).bernoulli_(1 - self.missing, generator=chance)
        said, code = self._said(seen)
        error = (said - true).square().mean()
        return error + self.sparse * code.abs().mean() if self.training else error

    def _said(self, seen: Tensor) -> tuple[Tensor, Tensor]:
        """What is said of normalised seen (batch, frames, kept), and the innermost numbers."""
        frames, step = seen.shape[1], 2 ** len(self.widths)
        more = seen[:, -1:].expand(-1, -frames % step, -1)
        x = torch.cat([seen, more], 1).mT
        for layer in self.down:
            x = max_pool1d(layer(x), 2).tanh()
        code = x
        for i, layer in enumerate(self.up):
            x = layer((x.tanh() if i else x).repeat_interleave(2, -1))
        return x.mT[:, :frames], code

    @torch.no_grad()
    def reconstruct(self, features: Tensor) -> Tensor:
        """Features (batch, frames, dim), or (frames, dim), said again; like features.

        Raises ModelError for another number of channels, no frame at all, or NaN.
        """
        features = as_features(self, features)
        one = features.ndim == 2
        features = checked_features(self, features[None] if one else features)
        found = self.normalizer.inverse(self._said(self.normalizer(features))[0])
        return found[0] if one else found

    def project(self, features: Tensor, step: int | None = None) -> Tensor:
        """`reconstruct`, under the name that STRNN has for it; there are no windows to step by."""
        return self.reconstruct(features)

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        kept = {name: getattr(self, name) for name in self.settings}
        return {
            "encoding": self.encoding.config(), "kept": self.normalizer.kept.tolist(),
            **kept, "widths": list(self.widths),
        }  # fmt: skip

    @classmethod
    def from_config(cls, config: dict) -> Self:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, len(config["kept"]))
        normalizer.kept.copy_(torch.tensor(config["kept"]))
        return cls(encoding, normalizer, **{name: config[name] for name in cls.settings})


def _check(widths: Sequence[int], span: int, missing: float, sparse: float) -> None:
    whole = lambda value: isinstance(value, Integral) and value >= 1
    if not widths or not all(map(whole, widths)):
        raise ModelError(
            f"ConvAutoencoder: widths are {widths!r}; give one whole number from 1 a layer."
        )
    if not whole(span) or span % 2 == 0:
        raise ModelError(f"ConvAutoencoder: span is {span!r}; it must be an odd number of frames.")
    if not 0 <= missing < 1:
        raise ModelError(f"ConvAutoencoder: missing is {missing!r}; it must be a share below 1.")
    if not 0 <= sparse < math.inf:
        raise ModelError(f"ConvAutoencoder: sparse is {sparse!r}; it must be a number from 0.")
