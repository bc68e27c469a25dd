"""A small network on three gaits, for figures whose reader moves a character."""

from __future__ import annotations

import pytest
from tiny_lstm import tiny_clips, tiny_lstm


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0", "stand")


@pytest.fixture(scope="module")
def model(clips):
    model = tiny_lstm(clips)
    model.sampling = {"temperature": 0.5}
    return model
