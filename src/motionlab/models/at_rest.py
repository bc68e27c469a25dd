"""A network as it is used, whatever mode it is in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from torch import nn


@contextmanager
def at_rest(model: nn.Module) -> Iterator[None]:
    """A network as it is used: nothing is dropped, batch norm keeps its statistics."""
    training = model.training
    model.eval()
    try:
        yield
    finally:
        model.train(training)
