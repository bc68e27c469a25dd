"""What a recurrent network knows between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import NamedTuple

from torch import Tensor


class _Parts(NamedTuple):
    frame: Tensor
    hidden: Tensor
    cell: Tensor
    noise: Tensor
    seen: Tensor


class State(_Parts):
    """All that a network knows after it has seen a frame.

    Indexed along the batch: ``state[2:5]``, one character as ``state[2]`` (a batch of one), a start
    for a hundred futures as ``state[[2] * 100]``.

    Parameters
    ----------
    frame : (batch, dim), the last input frame as it was seen, raw units.
    hidden : (batch, layers, width), h of the recurrent layers.
    cell : (batch, layers, width), C of the LSTM layers.
    noise : (batch, kept), what the last frame was drawn with, in deviations (see `next_noise`); a
        state of frames that were observed has none, (batch, 0).
    seen : (batch, kept), `frame` in normalised units as it was drawn, to the last digit; or
        (batch, 0).
    """

    __slots__ = ()

    def __new__(
        cls,
        frame: Tensor,
        hidden: Tensor,
        cell: Tensor,
        noise: Tensor | None = None,
        seen: Tensor | None = None,
    ) -> State:
        nothing = frame[..., :0]
        noise, seen = (nothing if part is None else part for part in (noise, seen))
        return super().__new__(cls, frame, hidden, cell, noise, seen)

    def __getitem__(self, rows: int | slice | Sequence[int] | Tensor) -> State:
        if isinstance(rows, Integral):
            size = len(self.frame)
            if not -size <= rows < size:
                raise IndexError(f"state {rows} of a batch of {size}")
            rows = slice(rows % size, rows % size + 1)
        return State(*(part[rows] for part in self))
