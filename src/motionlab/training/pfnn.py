"""How a PFNN is trained: on the clips of the generators, a frame of them at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import torch
from torch import Tensor
from tqdm import tqdm

from ..encodings import JointAngles
from ..errors import TrainingError
from ..models.pfnn import Layout, Pfnn
from ..models.pfnn.examples import examples, normalizers
from .prepared import Prepared
from .presets import Preset
from .windows import Windows

_POINTS = 6  # of the trajectory either way, as in the paper


@dataclass(frozen=True)
class PfnnPreset(Preset):
    """Settings of a training of the PFNN; `frames` are those of its trajectory, 12 n + 1."""

    drop: float = 0.3
    """Share of the inputs of each layer that are dropped."""
    sparsity: float = 0.01
    """What the mean size of weights costs."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.frames % (2 * _POINTS) != 1:
            raise TrainingError(
                f"frames is {self.frames}; a trajectory of {_POINTS} points either way needs 13, 25, "
                "37, 49, 61 or 12 more, and so on."
            )

    def windows(self, data: Prepared, split: str) -> Windows:
        """Rows of `models.pfnn.examples` of a split, as windows of one row."""
        return Windows(_rows(self.frames, data, split), 1)

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """Lots for all numbers of a row and all hidden units: what is dropped."""
        lots = torch.rand(*shape[:2], shape[2] + 2 * self.width, generator=generator)
        return {"lots": lots}

    def model(self, data: Prepared) -> Pfnn:
        """An untrained network for some data."""
        layout = _layout(self.frames, data)
        seen, said = normalizers(layout, torch.cat(_rows(self.frames, data, "train")))
        return Pfnn(layout, self.width, self.drop, self.sparsity, seen, said)


def _layout(frames: int, data: Prepared) -> Layout:
    """What a network sees and says of some data, with a trajectory of so many frames."""
    if not isinstance(data.encoding, JointAngles) or "contacts" not in data.encoding.slices:
        raise TrainingError(
            "A PFNN learns from JointAngles features with contacts; the data are of another kind. "
            "`motionlab prepare` one of the data sets."
        )
    reach = frames // 2
    return Layout(data.encoding.skeleton, data.encoding.fps, reach, reach // _POINTS)


@lru_cache(maxsize=2)  # a model is made, and then trained, of the same rows
def _rows(frames: int, data: Prepared, split: str) -> list[Tensor]:
    """Rows of each clip of a split that has some."""
    layout = _layout(frames, data)
    clips = tqdm(data.clips(split), f"rows of {split}", unit="clip", leave=False, delay=2)
    rows = [examples(layout, data.motion(clip)) for clip in clips]
    rows = [some for some in rows if len(some)]
    if not rows:
        raise TrainingError(
            f"No clip of the split {split!r} has {frames} frames with a strike of a foot before "
            "and after them; train on longer clips, or with fewer frames."
        )
    return rows


# As of the LSTM-GMM, with as many frames in an update. paper: 20 times through all of `locomotion`.
_TABLE = PfnnPreset(
    updates=3_000, decay=600, batch=2_048, frames=61, validate_every=200, width=128, noise=0.0
)
PRESETS = {
    "pfnn": {
        "smoke": replace(
            _TABLE, updates=40, decay=10, batch=64, frames=25, validate_every=10, width=32, warmup=5
        ),
        "table": _TABLE,
        "ship": replace(_TABLE, updates=10_000, decay=3_000, width=256),
        "paper": replace(
            _TABLE, updates=140_000, decay=0, batch=32, validate_every=2_000, width=512,
            learning_rate=1e-4, warmup=0,
        ),
    }
}  # fmt: skip
