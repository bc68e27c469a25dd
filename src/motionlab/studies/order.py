"""In which order raters see what they judge: balanced by Latin squares, drawn by a seed.

What is seen early is judged otherwise than what is seen late, and what follows a bad clip looks good.
In a Williams square every condition stands in every place once, and follows every other one equally
often (Williams 1949), so that over raters neither favours any.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

LEAST = 24  # orders of a study: raters shall not all see the same clips first


def williams(count: int) -> np.ndarray:
    """A Williams square of `count` conditions (rows, count): each row is one order of them.

    An even count needs as many rows, an odd one twice as many. Over all rows each condition stands in
    each place equally often, and directly after each other one equally often.
    """
    zigzag = [(step + 1) // 2 if step % 2 else -(step // 2) for step in range(count)]
    rows = (np.array(zigzag)[None] + np.arange(count)[:, None]) % count
    return np.concatenate([rows, rows[:, ::-1]]) if count % 2 and count > 1 else rows


def orders(
    groups: Sequence[np.ndarray], checks: Sequence[int], seed: int, least: int = LEAST
) -> list[list[int]]:
    """Orders of items for raters 0, 1, ...: at least `least`, as many as whole squares need.

    Parameters
    ----------
    groups : for each gait the numbers of its items (clips, conditions).
    checks : numbers of the attention checks; they come at even distances, each order in another turn.
    seed : draws which clip of a condition comes when, and how gaits are mixed.

    Items come in blocks, one of each condition, in the order of a row of the square; from block to
    block and from order to order the row moves on.
    """
    conditions = groups[0].shape[1]
    square = williams(conditions)
    rows = len(square)
    found = []
    for number in range(rows * -(-least // rows)):
        draw = np.random.default_rng([seed, number])
        blocks = np.concatenate([draw.permuted(items, axis=0) for items in groups])
        draw.shuffle(blocks)
        turned = [block[square[(number + b) % rows]] for b, block in enumerate(blocks)]
        found.append(_with_checks(np.concatenate(turned).tolist(), checks, number))
    return found


def _with_checks(items: list[int], checks: Sequence[int], number: int) -> list[int]:
    """The checks put between the items, none first or last where that can be."""
    placed = list(items)
    for k in reversed(range(len(checks))):
        at = round((k + 1) * len(items) / (len(checks) + 1))
        placed.insert(at, checks[(k + number) % len(checks)])
    return placed
