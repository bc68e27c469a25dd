"""What is told of runs by so many futures."""

from __future__ import annotations

import math

import pytest

from experiments.rnn_gan.steering_futures import LATE, told


def test_who_settles_late_or_never_does_not_count():
    rows = [
        {"settled (s)": late, "foot skate (cm/s)": 5.0, "broken frames": 0}
        for late in (0.5, 1.0 + LATE, 1.01 + LATE, math.inf)
    ]
    found = told(rows, {"people's (s)": {"median": 1.0}})
    assert found["settled"] == 0.5
    assert found["foot skate (cm/s)"] == pytest.approx(5.0)
