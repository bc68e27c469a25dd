"""Windows and where they meet: those of clips, as rows; what is said of a frame in all that hold it,
averaged; the jump from one to the next, faded."""

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


def without_jumps(frames: Tensor, first: int, window: int, fade: int) -> Tensor:
    """Frames (batch, frames, channels) of which each window begins where the one before was going.

    That is on the line through the two frames before the seam. By how much the window's first frame is
    off that line is taken from it, and less and less from those after it, by the square of what is left
    of `fade` frames; as engines do where one clip gives way to the next.

    first : frame where the first window begins, 2 or more. window : frames of each.
    """
    found = frames.clone()
    left = (1 - torch.arange(fade).to(frames) / fade).square()[:, None]
    for begin in range(first, frames.shape[1], window):
        further, last = found[:, begin - 2], found[:, begin - 1]
        jump = found[:, begin] - (2 * last - further)
        some = found[:, begin : begin + fade]
        some -= left[: some.shape[1]] * jump[:, None]
    return found
