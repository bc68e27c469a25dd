"""The way over the ground: steps from frame to frame, and their sum.

A character's path is stored as steps, each seen from the frame before it, so that neither where it
stands nor which way it faces matters. Decoding adds thousands of steps up; sums are therefore kept
in double precision, whatever the features are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from ..errors import EncodingError

Start = Tensor | Sequence[float | Tensor]


def turned(vectors: Tensor, yaw: Tensor) -> Tensor:
    """Vectors (..., 3) turned about the vertical by `yaw` (...) radians, +z towards +x."""
    sine, cosine = yaw.sin(), yaw.cos()
    x, y, z = vectors.unbind(-1)
    across, ahead = x * cosine + z * sine, z * cosine - x * sine
    return torch.stack([across, y.expand_as(across), ahead], dim=-1)


def steps_between(root_positions: Tensor, yaw: Tensor) -> Tensor:
    """Steps over the ground, each in the heading frame of the frame before (RNN-GAN, eq. 3).

    root_positions : (frames, 3) metres; yaw : (frames,) radians.

    Returns (frames, 3) in float64: step to the left (x), step ahead (z) in metres, and turn in
    radians, within half a turn. Row 0 repeats row 1; a single frame has made no step.
    """
    moves = root_positions.double().diff(dim=0)
    turns = yaw.double().diff()
    ahead = turned(moves, -yaw[:-1].double())
    rows = torch.stack([ahead[:, 0], ahead[:, 2], _within_half_turn(turns)], dim=-1)
    return torch.cat([rows[:1], rows]) if len(rows) else rows.new_zeros(1, 3)


def walk(steps: Tensor, start: tuple[Tensor, ...]) -> tuple[Tensor, Tensor]:
    """Add steps up (RNN-GAN, eq. 4).

    steps : (..., frames, 3) as from `steps_between`; row 0 is not used, frame 0 is at the start.
    start : x, z, yaw, each (...).

    Returns the path (..., frames, 3) in metres, with y = 0, and yaw (..., frames) in radians, within
    half a turn; both like `steps`.
    """
    wide = _double(steps)
    x, z, yaw = (value.expand(steps.shape[:-2]) for value in start)
    yaw = torch.cat([yaw[..., None], wide[..., 1:, 2]], dim=-1).cumsum(-1)
    nothing = torch.zeros_like(wide[..., 1:, 0])
    moves = torch.stack([wide[..., 1:, 0], nothing, wide[..., 1:, 1]], dim=-1)
    first = torch.stack([x, torch.zeros_like(x), z], dim=-1)[..., None, :]
    path = torch.cat([first, turned(moves, yaw[..., :-1])], dim=-2).cumsum(-2)
    # float32 blurs an angle of many turns
    return path.to(steps), _within_half_turn(yaw).to(steps)


def total(first: Tensor | float, changes: Tensor) -> Tensor:
    """Sum of changes (..., frames) whose row 0 is replaced by `first` (...)."""
    wide = _double(changes)
    first = torch.as_tensor(first).to(wide).expand(changes.shape[:-1])[..., None]
    return torch.cat([first, wide[..., 1:]], dim=-1).cumsum(-1).to(changes)


def read_start(start: Start | None, features: Tensor, default: Sequence[float]) -> list[Tensor]:
    """Where frame 0 stands: x, z, yaw and what else `default` has, double precision, (...) each.

    start : numbers or tensors (...), one each, or one tensor (..., 3); what follows yaw may be left
        out. They broadcast with the leading dimensions of features (..., frames, dim).
    """
    start = default if start is None else start
    try:
        values = list(torch.as_tensor(start).unbind(-1) if hasattr(start, "shape") else start)
        values += default[len(values) :] if len(values) >= 3 else ()
        device = _double(features[..., :0]).device
        tensors = [_double(torch.as_tensor(v, dtype=_wide(v))).to(device) for v in values]
        fits = all(t.expand(features.shape[:-2]).isfinite().all() for t in tensors)
    except (TypeError, ValueError, IndexError, RuntimeError):
        fits = False
    if not fits or len(values) != len(default):
        raise EncodingError(
            "start must be x and z in metres and yaw in radians: finite numbers, or tensors of "
            f"shape {tuple(features.shape[:-2])} as the features' leading dimensions."
        )
    return tensors


def _within_half_turn(angle: Tensor) -> Tensor:
    return torch.remainder(angle + math.pi, 2 * math.pi) - math.pi


def _wide(value: float | Tensor) -> torch.dtype | None:
    """What a number is kept in until it is a tensor: torch would round it to float32."""
    return None if isinstance(value, Tensor) else torch.float64


def _double(values: Tensor) -> Tensor:
    """In double precision; on the CPU where the device (Apple's GPU) has none."""
    return (values.cpu() if values.device.type == "mps" else values).double()
