"""Which attempts to hide solved walks from a critic count as a help."""

from __future__ import annotations

import pytest

from experiments.rnn_gan.critic_attempts import helps


def row(critic: float, rms: float = 0.5, skate: float = 2.5) -> dict:
    return {"critic": {"value": critic}, "rms (cm)": rms, "foot skate (cm/s)": skate}


@pytest.mark.parametrize(
    ("found", "wanted"),
    [
        (row(0.7), True),
        (row(0.81), False),
        (row(0.7, rms=1.1), False),
        (row(0.7, skate=3.1), False),
        ({"critic": {"value": 0.5}}, False),  # free samples follow nothing
    ],
)
def test_what_helps(found, wanted):
    assert helps(found, {"critic": {"value": 0.74, "high": 0.8}}) is wanted
