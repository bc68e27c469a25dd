"""What weights need besides training to be of use: states to start from, and a temperature.

A mixture density network that was trained on noisy frames expects some: as learned, its samples
tremble. Lower temperatures are calmer, and too low ones calmer than people.
"""

from __future__ import annotations

import os

import torch
from torch import Tensor, nn

from .. import metrics
from ..models import LstmGmm
from .checkpoints import load_weights, save_weights
from .prepared import Prepared
from .presets import Preset

OBSERVED = 2.0  # seconds of real motion that a network sees before it goes on by itself
LEAST, MOST, HALVINGS = 0.1, 1.0, 6  # known to 0.014 then
STARTS = 8


@torch.no_grad()
def finish(path: str | os.PathLike, data: Prepared, preset: Preset) -> dict[str, float]:
    """Add to a training's weights what `motionlab.load` gives with them; what it samples with.

    Starts are validation windows, spread evenly. A mixture also gets the temperature at which its
    motion is as lively as those clips.

    Raises
    ------
    TrainingError : the file is missing, damaged, or can't be written.
    """
    model, about = load_weights(path)
    model.eval()
    windows = torch.cat(preset.windows(data, "val").tiles(64))
    windows = windows[torch.linspace(0, len(windows) - 1, min(STARTS, len(windows))).long()]
    state = model.observe(windows[:, : round(OBSERVED * model.fps)])
    sampling = {}
    clips = [clip for clip in data.clips("val") if len(clip) >= OBSERVED * model.fps]
    if isinstance(model, LstmGmm) and clips:
        sampling["temperature"] = fit_temperature(model, clips, seconds=10.0)
    names = [f"validation {number + 1}" for number in range(len(windows))]
    save_weights(path, model, about | {"starts": names, "sampling": sampling}, starts=state)
    return sampling


@torch.no_grad()
def fit_temperature(
    model: nn.Module, clips: list[Tensor], seed: int = 0, seconds: float = 20.0, **sampling: float
) -> float:
    """Temperature at which mean acceleration is that of the clips the samples begin in.

    Each clip (frames, dim) of two seconds or more gives one sample. Between 0.1 and 1, of which it
    is the nearer end if no temperature does.
    """
    seen = round(OBSERVED * model.fps)
    clips = [clip for clip in clips if len(clip) >= seen]
    start = model.observe(torch.stack([clip[:seen] for clip in clips]))
    wanted = torch.stack([_acceleration(model, clip) for clip in clips]).mean()
    low, high = LEAST, MOST
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        made = model.generate(
            round(seconds * model.fps), start,
            generator=torch.Generator().manual_seed(seed), temperature=middle, **sampling,
        )  # fmt: skip
        # what exploded is NaN: then lower is no help
        if _acceleration(model, made).mean() > wanted:
            high = middle
        else:
            low = middle
    return round((low + high) / 2, 2)


def _acceleration(model: nn.Module, features: Tensor) -> Tensor:
    return metrics.acceleration(model.encoding.positions(features), model.fps)
