"""Features to zero mean and unit variance, and back."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor, nn

from ..errors import EncodingError

# What moves by less (10 micrometres, 0.0006 degrees) does not move: it is rounding.
_CONSTANT = 1e-5


class Normalizer(nn.Module):
    """Standardises features channel by channel; constant channels are dropped and put back.

    Fitted on the training split and kept as buffers of the model, so that it travels with the
    weights:

        normalizer = Normalizer.fit([encoding.encode(motion) for motion in training])
        inputs = normalizer(features)            # (..., dim) -> (..., kept)
        features = normalizer.inverse(outputs)   # (..., kept) -> (..., dim)

    ``Normalizer(dim, kept)`` is one with the right shapes for `load_state_dict`; until then it
    leaves the first `kept` channels as they are.

    Buffers
    -------
    mean, std : (dim,), of the training features; kept : (kept,), indices of channels that vary.
    """

    def __init__(self, dim: int, kept: int | None = None) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(dim))
        self.register_buffer("std", torch.ones(dim))
        self.register_buffer("kept", torch.arange(dim if kept is None else kept))

    @classmethod
    @torch.inference_mode(False)  # made while sampling, it must serve when training
    def fit(cls, features: Sequence[Tensor], floor: float = 1e-3) -> Normalizer:
        """Mean and standard deviation over all rows of all clips.

        Parameters
        ----------
        features : list of (frames, dim), the training clips.
        floor : smallest standard deviation that is divided by, in the channel's unit. A channel
            that hardly moves (1 mm, 0.06 degrees) would otherwise be blown up into noise that a
            network must learn.

        Raises
        ------
        EncodingError : no clips, different widths, NaN or infinite values, or a bad floor.
        """
        if not isinstance(floor, int | float) or not 0 <= floor < math.inf:
            raise EncodingError(f"Normalizer.fit: floor is {floor!r}; it must be a number from 0.")
        if not isinstance(features, (list, tuple)) or not all(map(torch.is_tensor, features)):
            raise EncodingError("Normalizer.fit takes a list of features, one tensor a clip.")
        clips = list(features)
        widths = {tuple(clip.shape[1:]) for clip in clips}
        if not clips or len(widths) > 1 or len(next(iter(widths))) != 1:
            raise EncodingError(
                f"Normalizer.fit needs features (frames, dim) of one width; got {len(clips)} clips "
                f"with rows of shape {sorted(widths)}."
            )
        rows = torch.cat(clips).detach()
        if len(rows) == 0 or not rows.isfinite().all():
            raise EncodingError("Normalizer.fit: no rows, or a NaN or infinite value in them.")
        wide = rows.double()
        std, mean = torch.std_mean(wide, dim=0, correction=0)
        varies = (wide.amax(0) - wide.amin(0) > _CONSTANT).nonzero()[:, 0]
        normalizer = cls(rows.shape[1], len(varies))
        normalizer.mean.copy_(mean)
        normalizer.std.copy_(std.clamp(min=floor))
        normalizer.kept.copy_(varies)
        return normalizer.to(rows.device)

    def forward(self, features: Tensor) -> Tensor:
        """Normalised features (..., kept) of raw ones (..., dim)."""
        self._check(features, len(self.mean), "features")
        return (features[..., self.kept] - self.mean[self.kept]) / self.std[self.kept]

    def inverse(self, normalized: Tensor) -> Tensor:
        """Raw features (..., dim) of normalised ones (..., kept); constant channels are the mean."""
        self._check(normalized, len(self.kept), "normalised features")
        values = normalized * self.std[self.kept] + self.mean[self.kept]
        features = self.mean.to(values).expand(*values.shape[:-1], -1)
        return features.index_copy(-1, self.kept, values)

    def _check(self, features: Tensor, width: int, what: str) -> None:
        if not torch.is_tensor(features) or features.shape[-1:] != (width,):
            shape = tuple(features.shape) if torch.is_tensor(features) else type(features).__name__
            raise EncodingError(
                f"{what} are {shape}; this Normalizer needs a tensor (..., {width})."
            )
