"""When one training is better than another: the one rule of the book for comparisons of trainings.

Two kinds of training are compared in a column by their seeds, three of each or more. One is *better* if

1. each of its seeds is better than each of the other's, and
2. their means differ by more than real motion does from real motion: half the width of the interval of
   the column's floor.

Else they are *undecided*, and with fewer than three seeds of either *not tested*: what one training has over
another may be its seed, however narrow the interval over starts. If two kinds did not differ, the first
condition would hold by chance, in one direction or the other, in one of ten columns (2 of the 20 ways to
deal six ranks to two threes). So what is better is counted beside the tenth of all columns that chance would
give, and a row is called better than another only if it is so in more of them than that.

Weights that were trained once, as those that ship, are told beside each other with intervals over starts:
these say how sure a number is of these weights, and nothing of another training.
"""

from __future__ import annotations

from collections.abc import Sequence

LEAST_SEEDS = 3
BY_CHANCE = 0.1  # share of columns in which three seeds part from three others without a reason
BETTER, WORSE, UNDECIDED, NOT_TESTED = "better", "worse", "undecided", "not tested"


def compared(ours: Sequence[float], theirs: Sequence[float], least: float) -> str:
    """Whether one kind of training is better than another in a column.

    ours, theirs : how far each seed is from what is wished (see `columns.off`); less is better.
    least : by which means must differ, in the same unit.
    """
    if min(len(ours), len(theirs)) < LEAST_SEEDS:
        return NOT_TESTED
    apart = sum(theirs) / len(theirs) - sum(ours) / len(ours)
    if abs(apart) <= least:
        return UNDECIDED
    if max(ours) < min(theirs):
        return BETTER
    return WORSE if max(theirs) < min(ours) else UNDECIDED
