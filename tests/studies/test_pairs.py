"""Bradley-Terry against cases worked by hand."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.special import expit

from motionlab.errors import StudyError
from motionlab.studies.pairs import bradley_terry

pytest.importorskip("statsmodels")


def test_thirty_of_forty_is_the_logarithm_of_three():
    won = np.repeat([1.0, 0.0], [30, 10])
    zeros = np.zeros(40, int)
    rows, (apart,) = bradley_terry(zeros, zeros + 1, won, np.arange(40), 2)
    assert [row.share for row in rows] == [0.75, 0.25]
    assert [row.strength for row in rows] == pytest.approx([np.log(3) / 2, -np.log(3) / 2])
    assert apart.mean == pytest.approx(np.log(3))
    # the error of a log odds is sqrt(1 / 30 + 1 / 10), of 40 raters a little more
    reach = 2.0227 * np.sqrt((1 / 30 + 1 / 10) * 40 / 39)
    assert apart.high - apart.mean == pytest.approx(reach, rel=0.02)
    assert apart.p < 0.01


def test_no_difference_is_half_a_win_for_each():
    first, second = np.zeros(40, int), np.ones(40, int)
    halves = np.repeat([1.0, 0.5, 0.0], [25, 10, 5])  # as 30 of 40
    rows, _ = bradley_terry(first, second, halves, np.arange(40), 2)
    assert rows[0].strength - rows[1].strength == pytest.approx(np.log(3))


def test_chances_that_follow_the_model_give_its_strengths_back():
    true = np.array([0.8, 0.1, -0.2, -0.7])
    first, second = np.array(list(combinations(range(4), 2)) * 10).T
    won = expit(true[first] - true[second])
    rater = np.arange(len(won)) // 6
    rows, compared = bradley_terry(first, second, won, rater, 4)
    assert [row.strength for row in rows] == pytest.approx(true.tolist())
    assert [one.mean for one in compared] == pytest.approx(
        (true[first] - true[second])[:6].tolist()
    )
    turned, _ = bradley_terry(second, first, 1 - won, rater, 4)  # which stands first is no matter
    assert np.array(turned) == pytest.approx(np.array(rows))


def test_a_circle_leaves_all_equal():
    first, second = np.array([0, 1, 2] * 6), np.array([1, 2, 0] * 6)
    won = np.repeat([1.0, 0.0], [12, 6])
    rows, compared = bradley_terry(first, second, won, np.arange(18) // 3, 3)
    assert [row.strength for row in rows] == pytest.approx([0, 0, 0], abs=1e-9)
    assert all(one.holm == 1 for one in compared)


def test_who_never_lost_has_no_finite_strength():
    first, second = np.array([0, 0, 1, 1]), np.array([1, 2, 2, 2])
    rows, compared = bradley_terry(first, second, np.array([1.0, 1, 1, 0]), np.arange(4), 3)
    assert np.isnan([row.strength for row in rows]).all() and rows[0].share == 1
    assert np.isnan([one.p for one in compared]).all()


def test_one_rater_has_strengths_but_no_intervals():
    first, second = np.zeros(4, int), np.ones(4, int)
    rows, (apart,) = bradley_terry(first, second, np.array([1.0, 1, 1, 0]), np.zeros(4, int), 2)
    assert rows[0].strength == pytest.approx(np.log(3) / 2)
    assert np.isnan([rows[0].low, rows[0].high, apart.p, apart.holm]).all()
    with pytest.raises(StudyError, match="nothing to be compared"):
        bradley_terry(first, first, np.ones(4), np.zeros(4, int), 1)


def test_answers_of_one_rater_count_once():
    """The same answers, from forty raters or from four who repeat theirs: intervals differ."""
    first, second = np.zeros(40, int), np.ones(40, int)
    won = np.tile(np.repeat([1.0, 0.0], [3, 1]), 10)
    many, _ = bradley_terry(first, second, won, np.arange(40), 2)
    few, _ = bradley_terry(first, second, won, np.arange(40) % 4, 2)
    assert few[0].high - few[0].low > 2 * (many[0].high - many[0].low)


def test_nobody_sees_a_difference():
    first, second = np.array(list(combinations(range(4), 2)) * 5).T
    rows, compared = bradley_terry(first, second, np.full(30, 0.5), np.arange(30) // 6, 4)
    assert [row.strength for row in rows] == pytest.approx([0] * 4)
    assert [one.holm for one in compared] == [1] * 6
