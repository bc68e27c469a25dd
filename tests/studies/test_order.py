"""Orders: every condition in every place, and after every other one, equally often."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from motionlab.studies.order import orders, williams


@pytest.mark.parametrize("count", range(1, 9))
def test_a_williams_square_is_balanced(count):
    square = williams(count)
    assert [sorted(row) for row in square.tolist()] == [list(range(count))] * len(square)
    for place in square.T:  # each condition equally often in each place
        assert len(set(Counter(place.tolist()).values())) == 1
    follow = Counter((a, b) for row in square.tolist() for a, b in zip(row, row[1:], strict=False))
    assert len(follow) == count * (count - 1) and len(set(follow.values())) <= 1


@pytest.mark.parametrize("conditions", [2, 3, 4, 5])
def test_over_all_orders_no_method_comes_earlier(conditions):
    groups = [np.arange(3 * conditions).reshape(3, -1), 3 * conditions + np.arange(3 * conditions).reshape(3, -1)]  # fmt: skip
    last = 6 * conditions
    found = orders(groups, [last, last + 1], seed=1)
    assert len(found) >= 24 and all(sorted(order) == list(range(last + 2)) for order in found)
    clips = np.array([[item for item in order if item < last] for order in found])
    for place in range(last):
        counts = Counter((clips[:, place] % conditions).tolist())
        assert len(counts) == conditions and len(set(counts.values())) == 1
    # a block has one clip of each condition, of one gait
    blocks = clips.reshape(len(found), 6, conditions)
    assert all(len({item // (3 * conditions) for item in b}) == 1 for b in blocks.reshape(-1, conditions).tolist())  # fmt: skip
    assert len({tuple(order) for order in found}) == len(found)


def test_checks_are_neither_first_nor_last_and_take_turns():
    found = orders([np.arange(8).reshape(4, 2)], [8, 9], seed=0)
    places = [[order.index(8), order.index(9)] for order in found]
    assert {tuple(sorted(p)) for p in places} == {(3, 6)}
    assert {a < b for a, b in places} == {True, False}


def test_the_seed_alone_decides():
    groups = [np.arange(12).reshape(4, 3)]
    assert orders(groups, [], seed=5) == orders(groups, [], seed=5) != orders(groups, [], seed=6)
