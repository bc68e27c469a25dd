"""What a recurrent network knows between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import NamedTuple

from torch import Tensor


class State(NamedTuple):
    """All that a network knows after it has seen a frame.

    Indexed along the batch: ``state[2:5]``, one character as ``state[2]`` (a batch of one), a start
    for a hundred futures as ``state[[2] * 100]``.
    """

    frame: Tensor  # (batch, dim), the last input frame as it was seen, raw units
    hidden: Tensor  # (batch, layers, width), h of the recurrent layers
    cell: Tensor  # (batch, layers, width), C of the LSTM layers

    def __getitem__(self, rows: int | slice | Sequence[int] | Tensor) -> State:
        if isinstance(rows, Integral):
            size = len(self.frame)
            if not -size <= rows < size:
                raise IndexError(f"state {rows} of a batch of {size}")
            rows = slice(rows % size, rows % size + 1)
        return State(*(part[rows] for part in self))
