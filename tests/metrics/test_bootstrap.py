"""Bootstrap intervals against scipy's, and how often they hold the truth."""

import numpy as np
import pytest
import scipy.stats
import torch

from motionlab.errors import MetricError
from motionlab.metrics import Interval, bootstrap, jackknife

VALUES = np.random.default_rng(3).exponential(size=30)


def test_against_scipy():
    ours = bootstrap(VALUES, resamples=20000)
    theirs = scipy.stats.bootstrap(
        (VALUES,), np.mean, n_resamples=20000, method="percentile"
    ).confidence_interval
    assert ours.value == pytest.approx(VALUES.mean())
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=0.02)
    assert ours.clips == 30


def test_any_statistic_of_anything():
    words = ["a", "bb", "cccc", "dddd"]
    interval = bootstrap(words, lambda chosen: max(map(len, chosen)))
    assert interval.value == interval.high == 4 and interval.low <= 4
    slow = bootstrap(list(VALUES), lambda chosen: sum(chosen) / len(chosen))
    assert tuple(slow) == pytest.approx(tuple(bootstrap(VALUES)))


def test_it_holds_the_truth_as_often_as_it_says():
    random = np.random.default_rng(0)
    held = [
        interval.low <= 5 <= interval.high
        for interval in (
            bootstrap(random.normal(5, 1, size=40), confidence=0.8, resamples=300)
            for _ in range(300)
        )
    ]
    assert np.mean(held) == pytest.approx(0.8, abs=0.06)


def test_seed_tensors_and_undefined_clips():
    assert bootstrap(VALUES, seed=1) == bootstrap(torch.from_numpy(VALUES), seed=1)
    assert bootstrap(VALUES, seed=1) != bootstrap(VALUES, seed=2)
    with_gaps = np.r_[np.nan, VALUES, np.nan]
    assert bootstrap(with_gaps) == bootstrap(VALUES)
    assert bootstrap([2.0]) == Interval(2, 2, 2, 1)


def test_times_that_never_come():
    interval = bootstrap([1.0, 2.0, np.inf, np.inf, np.inf], np.median)
    assert interval.value == np.inf and interval.high == np.inf and interval.low in (1, 2, np.inf)
    assert bootstrap([1.0, np.inf]).high == np.inf


def test_intervals_are_read_without_exponents():
    assert str(Interval(1234.5, 0.0004, float("inf"), 3)) == "1234 [0, inf]"
    assert str(Interval(2.0, 2.0, 2.0, 1)) == "2 (one clip)"  # whose interval would be no width


def test_jackknife_of_a_mean_is_students_interval():
    ours = jackknife(list(VALUES), np.mean, confidence=0.9)
    theirs = scipy.stats.ttest_1samp(VALUES, 0).confidence_interval(0.9)
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=1e-9)
    assert ours.value == pytest.approx(VALUES.mean()) and ours.clips == 30


def test_bad_input_is_named():
    with pytest.raises(MetricError, match="two or more"):
        jackknife([1.0], np.mean)
    with pytest.raises(MetricError, match="confidence"):
        jackknife([1.0, 2.0], np.mean, confidence=2)
    for values, words in (([], "no clips"), ([np.nan], "NaN"), ([[1.0, 2.0]], "one number a clip"),
                          (["a"], "one number a clip")):  # fmt: skip
        with pytest.raises(MetricError, match=words):
            bootstrap(values)
    for options in ({"confidence": 1.0}, {"resamples": 0}):
        with pytest.raises(MetricError, match="confidence|resamples"):
            bootstrap([1.0], **options)
