"""Simulated raters of a known truth: it lies in its interval, and nothing is found where nothing is."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from motionlab.studies.order import orders
from motionlab.studies.pairs import bradley_terry
from motionlab.studies.ratings import by_rater, holm, over_raters, signed_rank
from motionlab.studies.simulate import choices, expected, in_order, ratings

FELT = np.array([2.6, 3.0, 3.4, 3.8])
METHOD = np.repeat(np.arange(4), 7)  # seven clips of each of four methods
PAIRS = list(combinations(range(4), 2))


def studies(felt: np.ndarray, raters: int, count: int, seed: int) -> np.ndarray:
    """Mean ratings (raters, studies, methods), a study after another."""
    rng = np.random.default_rng(seed)
    found = [ratings(felt[METHOD], METHOD, raters, rng).astype(float) for _ in range(count)]
    return np.stack([by_rater(values, METHOD, 4) for values in found], axis=1)


def test_the_expected_rating_is_the_mean_of_very_many():
    values = ratings(FELT[METHOD], METHOD, 40_000, np.random.default_rng(0))
    assert by_rater(values, METHOD, 4).mean(0) == pytest.approx(expected(FELT), abs=0.015)


@pytest.mark.parametrize("raters", [10, 25])
def test_means_lie_in_their_intervals(raters):
    """95 of 100 are asked; of 500 studies with 4 methods each, 93.5 to 96.5 % are that within chance."""
    scores = studies(FELT, raters, 500, seed=raters)
    low, high = over_raters(scores.reshape(raters, -1), resamples=1000)
    inside = (low <= np.tile(expected(FELT), 500)) & (np.tile(expected(FELT), 500) <= high)
    assert 0.935 <= inside.mean() <= 0.965


def test_differences_lie_in_their_intervals():
    scores = studies(FELT, 25, 500, seed=2)
    a, b = np.array(PAIRS).T
    true = np.tile(expected(FELT)[a] - expected(FELT)[b], 500)
    low, high = over_raters((scores[..., a] - scores[..., b]).reshape(25, -1), resamples=1000)
    assert 0.935 <= ((low <= true) & (true <= high)).mean() <= 0.965


@pytest.mark.parametrize("raters", [8, 25])
def test_where_all_are_alike_five_in_a_hundred_are_told_apart(raters):
    scores = studies(np.full(4, 3.2), raters, 1000, seed=3)
    a, b = np.array(PAIRS).T
    p = signed_rank((scores[..., a] - scores[..., b]).reshape(raters, -1)).reshape(1000, -1)
    assert (p < 0.05).mean() == pytest.approx(0.05, abs=0.02)
    # Holm: any of the six, in no more studies than that
    assert np.mean([holm(row).min() < 0.05 for row in p]) <= 0.07


def judged(strength: np.ndarray, rng: np.random.Generator):
    """25 raters, each two methods side by side four times."""
    first, second = np.array(PAIRS * 4).T
    won = choices(strength[first] - strength[second], 25, rng)
    rater = np.repeat(np.arange(25), len(first))
    return bradley_terry(np.tile(first, 25), np.tile(second, 25), won.ravel(), rater, 4)


def test_strengths_lie_in_their_intervals():
    pytest.importorskip("statsmodels")
    true, rng = np.array([-0.6, -0.2, 0.2, 0.6]), np.random.default_rng(0)
    found = [judged(true, rng)[0] for _ in range(300)]
    inside = [
        [row.low <= t <= row.high for row, t in zip(rows, true, strict=True)] for rows in found
    ]
    assert 0.93 <= np.mean(inside) <= 0.97


def test_where_all_are_as_strong_five_in_a_hundred_are_told_apart():
    pytest.importorskip("statsmodels")
    rng = np.random.default_rng(1)
    compared = [judged(np.zeros(4), rng)[1] for _ in range(300)]
    assert np.mean([[one.p < 0.05 for one in each] for each in compared]) == pytest.approx(0.05, abs=0.02)  # fmt: skip
    assert np.mean([min(one.holm for one in each) < 0.05 for each in compared]) <= 0.07


def order_errors(sequence, **moved) -> np.ndarray:
    """How far means (methods,) of very many raters lie from those of a study without any such thing."""
    felt, rng = FELT[METHOD], np.random.default_rng(5)
    calm = in_order(felt, sequence, rng).astype(float)
    found = in_order(felt, sequence, rng, **moved).astype(float)
    return by_rater(found, METHOD, 4).mean(0) - by_rater(calm, METHOD, 4).mean(0)


def test_a_fixed_order_favours_who_comes_first_and_balanced_ones_do_not():
    """Tired raters: what comes late loses. In balanced orders all lose alike, so that none is favoured."""
    raters = 4000
    fixed = np.tile(np.arange(28), (raters, 1))  # method after method
    rows = orders([np.arange(28).reshape(4, 7).T], [], seed=0)
    balanced = np.array([rows[i % len(rows)] for i in range(raters)])
    assert np.ptp(order_errors(fixed, tired=1.0)) > 0.5
    assert np.ptp(order_errors(balanced, tired=1.0)) < 0.12  # scales end, so not quite alike
    assert np.ptp(order_errors(balanced)) < 0.06


def test_after_a_bad_clip_one_looks_good():
    pairs = np.array([[0, 27], [27, 0]] * 3000)
    felt = np.where(np.arange(28) == 0, 1.5, 3.5)
    order = np.concatenate([pairs, np.tile(np.arange(1, 27), (6000, 1))], axis=1)
    found = in_order(felt, order, np.random.default_rng(0), contrast=0.5)
    assert found[0::2, 27].mean() > found[1::2, 27].mean() + 0.3


def test_who_knows_the_name_rates_the_name():
    hoped = np.where(METHOD == 3, 0.8, 0.0)
    found = order_errors(np.tile(np.arange(28), (2000, 1)), hoped=hoped)
    assert found[3] > 0.5 and np.abs(found[:3]).max() < 0.06
