"""A window in which a network sees recorded frames in places and its own output elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import torch
from torch import Tensor

from ..errors import ModelError

Memory = TypeVar("Memory")


def checked_real(real: Tensor | None, features: Tensor) -> Tensor | None:
    """Which frames (batch, frames) of features (batch, frames, dim) are input as they were recorded.

    real : (frames,) or (batch, frames) bool; None, which stays None: all. Raises ModelError.
    """
    if real is None:
        return None
    batch, frames = features.shape[:2]
    real = torch.as_tensor(real, device=features.device)
    if real.dtype != torch.bool or real.shape not in ((frames,), (batch, frames)):
        raise ModelError(
            f"real is {real.dtype} of shape {tuple(real.shape)}; for these features it must be bool "
            f"of shape ({frames},) or ({batch}, {frames})."
        )
    real = real.expand(batch, frames)
    if not real[:, 0].all():
        raise ModelError("The first frame can't be fed back: nothing was said before it.")
    return real


def feed_back(
    run: Callable[[Tensor, Memory], tuple[Tensor, Memory]],
    inputs: Tensor,
    real: Tensor | None,
    memory: Memory,
) -> tuple[Tensor, Memory]:
    """Outputs (batch, frames, dim) after each frame, and the memory after the last.

    Gradients go through the frames that were fed back.

    Parameters
    ----------
    run : a network: inputs (batch, some frames, dim) and memory to outputs like inputs and memory.
    inputs : (batch, frames, dim).
    real : (batch, frames) bool, from `checked_real`: where the input is used. Elsewhere the network
        sees the output it made one frame before.
    memory : before the first frame.
    """
    frames, outputs, first = inputs.shape[1], [], 0
    recorded = [True] * frames if real is None else real.all(0).tolist()
    while first < frames:
        # as many frames at once as are known beforehand
        last = first + 1
        while last < frames and recorded[last]:
            last += 1
        seen = inputs[:, first:last]
        if not recorded[first]:
            again = torch.where(real[:, first, None], seen[:, 0], outputs[-1][:, -1])
            seen = torch.cat([again[:, None], seen[:, 1:]], dim=1)
        output, memory = run(seen, memory)
        outputs.append(output)
        first = last
    return torch.cat(outputs, dim=1), memory
