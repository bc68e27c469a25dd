"""How the convolutional autoencoder is trained, STRNN's rival in denoising: on the same rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch

from ..models.conv_autoencoder import ConvAutoencoder
from .prepared import Prepared
from .presets import Preset
from .strnn import in_body_frame
from .windows import Windows


@dataclass(frozen=True)
class ConvAutoencoderPreset(Preset):
    """Settings of a training of the convolutional autoencoder; `width` is that of its innermost layer,
    of which the others have a half and a quarter."""

    missing: float = 0.1
    """Share of the numbers of a frame that are zero, instead of noise."""
    sparse: float = 0.01
    """What the mean size of the innermost numbers costs."""

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of the body's frame of a split."""
        return Windows(in_body_frame(data).clips(split), self.frames)

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """The seed of what is missing, and noise if there is some."""
        lots = torch.randint(2**31, shape[:1], generator=generator)
        return super().extras(shape, update, generator) | {"lots": lots}

    def model(self, data: Prepared) -> ConvAutoencoder:
        """An untrained network for some data."""
        data = in_body_frame(data)
        widths = [max(1, self.width // share) for share in (4, 2, 1)]
        return ConvAutoencoder(
            data.encoding, data.normalizer, widths, missing=self.missing, sparse=self.sparse
        )


# smoke: seconds, for tests. table: minutes. ship, paper: longer, the last in
# windows as long as the paper's; how many updates it makes is not said there.
_TABLE = ConvAutoencoderPreset(
    updates=16_000, decay=6_000, batch=8, frames=64, validate_every=500, width=256, noise=0.0
)
PRESETS = {
    "conv-autoencoder": {
        "smoke": replace(_TABLE, updates=40, decay=5, validate_every=10, width=32, warmup=5),
        "table": _TABLE,
        "ship": replace(_TABLE, updates=40_000, decay=15_000, validate_every=1_000),
        "paper": replace(_TABLE, updates=200_000, decay=0, frames=160, batch=1,
                         validate_every=5_000),
    }
}  # fmt: skip
