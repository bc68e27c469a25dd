"""Statistics of ratings against cases worked by hand or published."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from motionlab.errors import StudyError
from motionlab.studies.ratings import (
    agreement,
    differences,
    holm,
    means,
    over_raters,
    raters_needed,
    signed_rank,
)

# Krippendorff (2011), section C: four observers, twelve units.
OBSERVERS = np.array([
    [1, 2, 3, 3, 2, 1, 4, 1, 2, np.nan, np.nan, np.nan],
    [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, np.nan, 3],
    [np.nan, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, np.nan],
    [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, np.nan],
])  # fmt: skip
# Darwin's maize: cross- less self-fertilised, in eighths of an inch; p of W = 24 in scipy's manual.
MAIZE = np.array([6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75.0])


def test_agreement_as_published():
    assert agreement(OBSERVERS, ordinal=False) == pytest.approx(0.743, abs=5e-4)
    assert agreement(OBSERVERS) == pytest.approx(0.815, abs=5e-4)


def test_agreement_at_its_ends():
    same = np.tile([1.0, 3, 5, 2], (6, 1))
    assert agreement(same) == 1
    assert np.isnan(agreement(np.full((3, 4), 2.0)))  # nobody differs, nothing can be told
    assert np.isnan(agreement(same[:1]))  # one rater
    # two raters who always differ on two clips: worse than chance
    assert agreement(np.array([[1.0, 2], [2, 1]]), ordinal=False) == pytest.approx(-0.5)
    chance = np.random.default_rng(0).integers(1, 6, (40, 60)).astype(float)
    assert abs(agreement(chance)) < 0.02


def test_means_and_deviations_are_those_of_all_ratings():
    values = np.array([[1, 2, 5, 5.0], [3, 2, 4, 4]])
    first, second = means(values, np.array([0, 0, 1, 1]), 2)
    assert (first.mean, second.mean) == (2.0, 4.5)
    assert first.sd == pytest.approx(np.sqrt(2 / 3)) and second.sd == pytest.approx(np.sqrt(1 / 3))
    assert first.low <= 2 <= first.high
    (one,) = means(np.array([[4.0]]), np.array([0]), 1)
    assert one.mean == 4 and np.isnan([one.sd, one.low, one.high]).all()


def test_an_interval_is_student_s_where_that_is_right():
    scores = np.random.default_rng(1).normal(3, 0.5, (12, 200))
    low, high = over_raters(scores)
    wide = 2 * stats.t.ppf(0.975, 11) * scores.std(0, ddof=1) / np.sqrt(12)
    assert np.median((high - low) / wide) == pytest.approx(1, abs=0.02)


def test_signed_ranks_as_published_and_by_hand():
    assert signed_rank(MAIZE[:, None])[0] == pytest.approx(0.041259765625)
    up = np.arange(1, 7.0)[:, None]
    assert signed_rank(up)[0] == pytest.approx(2 / 2**6)  # all six of one sign
    assert signed_rank(np.zeros((5, 1)))[0] == 1
    # with ties: mean ranks, and the normal with half of their sum and a quarter of their squares
    tied = np.array([[1.0], [1], [-1], [2], [2]])
    ranks, negative = np.array([2, 2, 2, 4.5, 4.5]), 2.0
    spread = np.sqrt((ranks**2).sum() / 4)
    assert signed_rank(tied)[0] == pytest.approx(2 * stats.norm.cdf((negative - 7.5) / spread))


def test_sevenths_tie():
    thirds = np.array([[0.1 + 0.2 - 0.3], [1.0], [2], [3], [-4]])  # the first is no difference
    assert signed_rank(thirds)[0] == signed_rank(np.array([[0.0], [1], [2], [3], [-4]]))[0]


def test_holm_by_hand():
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm(np.array([0.5, 0.9])) == pytest.approx([1, 1]) and len(holm(np.array([]))) == 0


def test_holm_is_that_of_statsmodels():
    multitest = pytest.importorskip("statsmodels.stats.multitest")
    p = np.random.default_rng(0).random((5, 6)) ** 3
    for row in p:
        assert holm(row) == pytest.approx(multitest.multipletests(row, method="holm")[1])


def test_differences_are_within_raters():
    """Raters who differ by more than the methods do, but all see the same difference."""
    scores = np.arange(10.0)[:, None] + np.array([0.0, 0.5])
    scores[:, 1] += np.linspace(0, 0.1, 10)
    (one,) = differences(scores)
    assert one[:2] == (0, 1) and one.mean == pytest.approx(-0.55) and one.high < 0
    assert one.p == one.holm == pytest.approx(2 / 2**10)
    assert differences(scores[:, :1]) == []


def test_raters_needed_by_the_book():
    """Student's test of a half deviation needs 33.37 (Cohen 1988), Wilcoxon's pi / 3 as many."""
    pytest.importorskip("statsmodels")
    assert raters_needed(1.0, 0.5) == 35
    assert raters_needed(2.0, 1.0) == 35 and raters_needed(1.0, 0.25) > 4 * 32
    assert raters_needed(1.0, 0.5, comparisons=6) > raters_needed(1.0, 0.5)
    assert raters_needed(0.01, 5) == 6  # with fewer nothing is significant: 2 / 2^5 > 0.05
    for sd, difference in ((0, 1), (1, 0), (float("nan"), 1)):
        with pytest.raises(StudyError, match="above 0"):
            raters_needed(sd, difference)
    with pytest.raises(StudyError, match="between 0 and 1"):
        raters_needed(1, 1, power=1)


def test_that_many_raters_find_it():
    pytest.importorskip("statsmodels")
    count = raters_needed(1.0, 0.5)
    apart = np.random.default_rng(0).normal(0.5, 1, (count, 2000))
    assert (signed_rank(apart) < 0.05).mean() == pytest.approx(0.8, abs=0.03)
