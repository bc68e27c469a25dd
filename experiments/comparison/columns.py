"""The columns of the table: what is measured, in which unit, and what is better.

All of it is measured on the joints of one body, walks and runs by themselves, after the same starts: the first
two seconds of held-out clips. A method gives the frames that go on from there. Sizes stand here, too, so that
they are fixed before the run.

Beside each column stands its floor, real against real motion: validation clips in the place of what is made.
"""

from __future__ import annotations

import math
from typing import NamedTuple

STARTS = (
    48  # of a gait, spread evenly over the test clips that are long enough (validation for critics)
)
FEW = 12  # starts of a method that takes minutes a start
SEEN, SECONDS = 2.0, 5.0  # of a clip that a method sees; of what it makes
LONG_STARTS, LONG = 8, 20_000  # starts of a gait, and frames, for survival
SAMPLES, AFTER = 50, 5.0  # from one start, for variety; seconds after which it is forgotten
PIECE = {
    "walk": 3.0,
    "run": 2.0,
}  # seconds then that are looked at: nearly all recorded clips are as long
MILLISECONDS = (80, 160, 320, 400, 560, 640)
CHARACTERS = (1, 256)
CRITICS = 3  # seeds of critics of weights that were trained once; else one a training
SHUFFLES = 10_000  # of the permutation test of a critic's accuracy
GAITS = {"walk": ("walk",), "run": ("run", "dash")}  # actions that begin so

LOW, HIGH, REAL = "low", "high", "real"  # what is better: less, more, or nearer to real motion


class Column(NamedTuple):
    """A number of a row in a gait."""

    name: str
    better: str
    what: str


COLUMNS = (
    *(Column(f"error, {ms} ms (cm)", LOW, "mean distance of joints from where they came to be")
      for ms in MILLISECONDS),
    Column("alive", HIGH, "share of rollouts of 20 000 frames that neither froze nor diverged"),
    Column("foot skate (cm/s)", REAL, "how fast feet slide while they are in contact"),
    Column("jerk (m/s³)", REAL, "how much all joints tremble"),
    Column("Fréchet distance", LOW, "how far hands, feet and head are, as a set, from test clips"),
    Column("manifold distance", LOW, "from windows of 4/3 s to the nearest of the training clips"),
    Column("variety", HIGH, "spread of speed, turning and steps from one start, over people's; "
           "geometric mean"),
    Column("critic", LOW, "accuracy of a critic that learned to tell it from recorded motion"),
)  # fmt: skip


def off(column: Column, value: float, real: float) -> float:
    """How far a value is from what is wished; less is better, infinite for what is no number."""
    if value is None or math.isnan(value):
        return math.inf
    return {LOW: value, HIGH: -value, REAL: abs(value - real)}[column.better]
