"""Windows that overlap: those of clips, as rows; what is said of a frame in all of them, averaged."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import torch
from torch import Tensor, nn

from .checks import checked_features


def rows_of_windows(
    model: nn.Module, clips: Sequence[Tensor], length: int, step: int
) -> Iterator[Tensor]:
    """All windows of each clip (frames, dim) that has one, normalised as rows (windows, length * kept).

    A window begins at every `step` frames. ModelError for what are no features of the model's.
    """
    for clip in clips:
        if len(clip) >= length:
            rows = model.normalizer(checked_features(model, clip[None])[0])
            yield rows.unfold(0, length, step).transpose(1, 2).flatten(1)


def mean_of_windows(
    frames: Tensor, length: int, step: int, say: Callable[[Tensor], Tensor]
) -> Tensor:
    """What `say` makes of windows (batch, length, kept) of frames (batch, frames, kept); like frames.

    A window begins at every `step` frames, the last one ends with the last frame; a frame is the mean
    of what is said of it. There must be `length` frames or more.
    """
    last = frames.shape[1] - length
    total, count = torch.zeros_like(frames), frames.new_zeros(frames.shape[1], 1)
    for begin in sorted({*range(0, last, step), last}):
        span = slice(begin, begin + length)
        total[:, span] += say(frames[:, span])
        count[span] += 1
    return total / count
