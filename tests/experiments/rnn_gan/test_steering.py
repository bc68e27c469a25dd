"""What is told of steered scripts."""

from __future__ import annotations

import math

from experiments.common.record import rounded
from experiments.rnn_gan.steering import SCRIPTS, summary


def test_who_never_settles_counts_as_infinitely_late_and_is_null():
    rows = [{"settled (s)": late, "broken frames": 0} for late in (1.0, math.inf, math.nan)]
    told = summary(rows)
    assert told["settled (s)"] == math.inf and rounded(told)["settled (s)"] is None
    told = summary([*rows, *rows[:1] * 2])
    assert told["settled (s)"] == 1.0 and told["runs"] == 5


def test_commands_come_in_order_and_before_the_end():
    for script in SCRIPTS.values():
        times = [at for at, *_ in script.commands]
        assert times == sorted(times) and times[-1] < script.seconds
