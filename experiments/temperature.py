"""The temperature at which a generator's motion is as lively as the motion it goes on with.

A mixture density network that was trained on noisy frames expects some: as learned, its samples
tremble. Lower temperatures are calmer, and too low ones calmer than people.
"""

from __future__ import annotations

import rollouts
import torch
from torch import Tensor, nn

from motionlab import metrics

SECONDS = 20.0
LEAST, MOST, HALVINGS = 0.1, 1.0, 6  # known to 0.014 then


@torch.no_grad()
def fit(model: nn.Module, clips: list[Tensor], seed: int = 0, **sampling: float) -> float:
    """Temperature at which mean acceleration is that of the clips the samples begin in.

    Each clip (frames, dim) of two seconds or more gives one sample of 20 s. Between 0.1 and 1, of
    which it is the nearer end if no temperature does.
    """
    seen = round(rollouts.OBSERVED * model.fps)
    clips = [clip for clip in clips if len(clip) >= seen]
    start = model.observe(torch.stack([clip[:seen] for clip in clips]))
    wanted = torch.stack([_acceleration(model, clip) for clip in clips]).mean()
    low, high = LEAST, MOST
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        generator = torch.Generator().manual_seed(seed)
        made = model.generate(
            round(SECONDS * model.fps), start, generator=generator, temperature=middle, **sampling
        )
        if (
            _acceleration(model, made).mean() > wanted
        ):  # what exploded is NaN: then lower is no help
            high = middle
        else:
            low = middle
    return round((low + high) / 2, 2)


def _acceleration(model: nn.Module, features: Tensor) -> Tensor:
    return metrics.acceleration(model.encoding.positions(features), model.fps)
