"""Statistics of ratings from 1 to 5: RNN-GAN's figure 13, with what it leaves out.

Raters are what is drawn from people at large, so all intervals and tests go over raters: answers of
one person hang together, and to count each as if it were a person's would make all too sure. Clips
are as they are: another draw of clips is another study.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy import stats

from ..errors import StudyError
from .packages import statsmodels

RESAMPLES = 2000
MOST = 4_000_000  # numbers that are drawn at a time: ten thousand raters shall not fill the memory
EFFICIENCY = 3 / np.pi  # of Wilcoxon's test against Student's, for normal differences (Pitman)


class Mean(NamedTuple):
    """Of a method's ratings: mean, standard deviation over all of them as in figure 13, interval."""

    mean: float
    sd: float
    low: float
    high: float


class Difference(NamedTuple):
    """How much higher `first` stands than `second`, by rater; p by Wilcoxon, and adjusted by Holm."""

    first: int
    second: int
    mean: float
    low: float
    high: float
    p: float
    holm: float


def over_raters(
    scores: np.ndarray, *, resamples: int = RESAMPLES, confidence: float = 0.95, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Interval (low, high) of the mean over raters of scores (raters, ...): a bootstrap that draws raters.

    Percentiles are taken a little farther out, as Student's t asks of few raters: plain ones are too
    narrow by a factor sqrt((n - 1) / n) and by the normal's tails (Hesterberg 2015, section 4). One
    rater alone has no interval: NaN.
    """
    scores = np.asarray(scores, dtype=float)
    count = len(scores)
    if count < 2:
        return np.full(scores.shape[1:], np.nan), np.full(scores.shape[1:], np.nan)
    reach = np.sqrt(count / (count - 1)) * stats.t.ppf((1 + confidence) / 2, count - 1)
    wider = 2 * stats.norm.cdf(reach) - 1
    found = stats.bootstrap(
        (scores,), np.mean, axis=0, n_resamples=resamples, confidence_level=min(wider, 1 - 1e-9),
        method="percentile", rng=np.random.default_rng(seed), batch=max(1, MOST // scores.size),
    )  # fmt: skip
    return found.confidence_interval.low, found.confidence_interval.high


def means(values: np.ndarray, method: np.ndarray, count: int, *, seed: int = 0) -> list[Mean]:
    """For each of `count` methods the mean of its ratings.

    values : (raters, clips), 1 to 5. method : (clips,), number of the method of each clip.
    """
    scores = by_rater(values, method, count)
    low, high = over_raters(scores, seed=seed)
    sds = [values[:, method == m].std(ddof=1) if values[:, method == m].size > 1 else np.nan
           for m in range(count)]  # fmt: skip
    rows = zip(scores.mean(0), sds, low, high, strict=True)
    return [Mean(*map(float, row)) for row in rows]


def by_rater(values: np.ndarray, method: np.ndarray, count: int) -> np.ndarray:
    """Mean rating (raters, methods) that each rater gives to each method."""
    return np.stack([values[:, method == m].mean(1) for m in range(count)], axis=1)


def differences(scores: np.ndarray, *, seed: int = 0) -> list[Difference]:
    """Every two methods compared within raters, for scores (raters, methods), by Wilcoxon's signed ranks.

    Holm's adjustment holds the chance that any of them is wrongly told apart at its level.
    """
    pairs = list(combinations(range(scores.shape[1]), 2))
    if not pairs:
        return []
    apart = np.stack([scores[:, a] - scores[:, b] for a, b in pairs], axis=1)
    low, high = over_raters(apart, seed=seed)
    p = signed_rank(apart)
    rows = zip(pairs, apart.mean(0), low, high, p, holm(p), strict=True)
    return [Difference(a, b, *map(float, row)) for (a, b), *row in rows]


def signed_rank(apart: np.ndarray) -> np.ndarray:
    """Two-sided p of Wilcoxon's signed-rank test for each column of differences (raters, ...).

    Raters for whom two methods are alike don't count; if they are alike for all, p is 1.
    """
    apart = np.asarray(apart, dtype=float).round(9)  # sevenths that are equal shall tie
    found = np.ones(apart.shape[1:])
    differ = (apart != 0).any(0)
    if differ.any():
        # ranks of few differences without ties have an exact distribution; else the normal's
        chosen = apart[:, differ]
        exact = np.array([_plain(column) for column in chosen.T])
        part = np.empty(len(exact))
        for group, way in ((exact, "exact"), (~exact, "asymptotic")):
            if group.any():
                part[group] = stats.wilcoxon(chosen[:, group], axis=0, method=way).pvalue
        found[differ] = part
    return found


def _plain(column: np.ndarray) -> bool:
    """Few differences, none zero, none of equal size."""
    sizes = np.abs(column)
    return len(sizes) <= 50 and sizes.all() and len(np.unique(sizes)) == len(sizes)


def holm(p: np.ndarray) -> np.ndarray:
    """p values (several,) adjusted for being several (Holm 1979).

    Ours, as statsmodels collects garbage at each call: simulations would wait for that alone.
    """
    order = np.argsort(p)
    found = np.empty(len(p))
    found[order] = np.maximum.accumulate(np.sort(p) * np.arange(len(p), 0, -1)).clip(max=1)
    return found


def agreement(values: np.ndarray, ordinal: bool = True) -> float:
    """Krippendorff's alpha of answers (raters, clips): 1 all agree, 0 as by chance, NaN if none differ.

    ordinal : answers are steps of a scale; else names. NaN in `values` is an answer not given.
    Krippendorff, "Computing Krippendorff's Alpha-Reliability" (2011). Ours, as the packages that have
    it are under the GPL.
    """
    kinds = np.unique(values[~np.isnan(values)])
    counts = np.stack([(values == kind).sum(0) for kind in kinds], axis=1).astype(float)
    counts = counts[counts.sum(1) >= 2]  # clips that two raters or more have judged
    if len(kinds) < 2 or not len(counts):
        return float("nan")
    each = counts.sum(1, keepdims=True)
    together = (counts / (each - 1)).T @ counts - np.diag((counts / (each - 1)).sum(0))
    total = together.sum(0)
    if ordinal:
        below = np.cumsum(total) - total / 2
        distance = (below[:, None] - below[None]) ** 2
    else:
        distance = 1.0 - np.eye(len(kinds))
    chance = np.outer(total, total) - np.diag(total)
    expected = (chance * distance).sum() / (total.sum() - 1)
    return float(1 - (together * distance).sum() / expected) if expected else float("nan")


def raters_needed(
    sd: float, difference: float, *, comparisons: int = 1, power: float = 0.8, level: float = 0.05
) -> int:
    """How many raters tell two methods apart that differ by `difference`, by Wilcoxon's signed ranks.

    Parameters
    ----------
    sd : standard deviation over raters of the difference of two methods, in the same unit.
    comparisons : how many are made at once; the first step of Holm's asks `level` over as many.
    power : chance to find the difference.
    """
    if not (sd > 0 and difference > 0 and np.isfinite([sd, difference]).all()):
        raise StudyError(
            f"difference is {difference!r} and standard deviation {sd!r}; both must be above 0."
        )
    if not (0 < power < 1 and 0 < level < 1 and comparisons >= 1):
        raise StudyError("power and level lie between 0 and 1, comparisons are 1 or more.")
    solver = statsmodels("stats.power").TTestPower()
    effect, alpha = difference / sd, level / comparisons
    count = 2
    if solver.power(effect, 2, alpha) < power:
        count = float(np.squeeze(solver.solve_power(effect, alpha=alpha, power=power)))
    return max(int(np.ceil(count / EFFICIENCY - 1e-9)), _least(alpha))


def _least(alpha: float) -> int:
    """Raters below which no signed rank is significant: all of one sign has p = 2 / 2^n."""
    return int(np.ceil(1 - np.log2(alpha)))
