"""Statistics of pairs: how strong each method is, by Bradley and Terry (1952).

The chance that method i is taken over j is logistic(s_i - s_j); "no difference" counts half for each.
It is a logistic regression without a constant. Errors are those of raters, not of answers (clustered:
Liang and Zeger 1986), with Student's t of as many.
"""

from __future__ import annotations

import warnings
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.sparse.csgraph import connected_components

from ..errors import StudyError
from .packages import statsmodels
from .ratings import Difference, holm

TINY = 1e-8  # a log odds that is none


class Strength(NamedTuple):
    """Of a method: its share of wins, its strength (log odds; all add up to 0) and its interval."""

    share: float
    strength: float
    low: float
    high: float


def bradley_terry(
    first: np.ndarray, second: np.ndarray, won: np.ndarray, rater: np.ndarray, count: int
) -> tuple[list[Strength], list[Difference]]:
    """Strengths of `count` methods, and every two of them compared.

    Parameters
    ----------
    first, second, won, rater : (answers,) numbers of the methods shown and of who judged; `won` is 1 if
        the first was taken, 0 if the second, 0.5 for no difference.

    A method that never lost, or never won, has no finite strength, nor have those it is told from:
    then strengths and p are NaN, shares are not. So are intervals and p of a single rater.
    """
    if count < 2:
        raise StudyError("Bradley-Terry: one method has nothing to be compared with.")
    wins = np.zeros((count, count))
    np.add.at(wins, (first, second), won)
    np.add.at(wins, (second, first), 1 - won)
    shares = wins.sum(1) / (wins + wins.T).sum(1)
    pairs = list(combinations(range(count), 2))
    groups, _ = connected_components(wins > 0, directed=True, connection="strong")
    if groups > 1:  # Ford (1957)
        none = [Strength(float(share), *[float("nan")] * 3) for share in shares]
        return none, [Difference(a, b, *[float("nan")] * 5) for a, b in pairs]
    strength, covariance = _fit(first, second, won, rater, count)
    degrees = len(np.unique(rater)) - 1
    reach = stats.t.ppf(0.975, degrees) if degrees > 0 else np.nan
    error = np.sqrt(np.diag(covariance))
    found = [
        Strength(*map(float, row))
        for row in zip(
            shares, strength, strength - reach * error, strength + reach * error, strict=True
        )
    ]
    a, b = np.array(pairs).T
    apart = strength[a] - strength[b]
    error = np.sqrt(covariance[a, a] + covariance[b, b] - 2 * covariance[a, b])
    with np.errstate(divide="ignore", invalid="ignore"):
        p = 2 * stats.t.sf(np.abs(apart) / error, max(degrees, 1))
    # where all raters answer alike there is no error: nothing is told apart if they see no difference
    p = np.where(error > TINY, p, np.where(np.abs(apart) < TINY, 1.0, np.nan))
    adjusted = holm(p) if np.isfinite(p).all() else p
    rows = zip(pairs, apart, apart - reach * error, apart + reach * error, p, adjusted, strict=True)
    return found, [Difference(i, j, *map(float, row)) for (i, j), *row in rows]


def _fit(
    first: np.ndarray, second: np.ndarray, won: np.ndarray, rater: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Strengths (count,) that add up to 0, and their covariance."""
    rows = np.arange(len(won))
    design = np.zeros((len(won), count))
    design[rows, first] += 1
    design[rows, second] -= 1
    models = statsmodels("genmod.generalized_linear_model")
    families = statsmodels("genmod.families")
    model = models.GLM(won, design[:, 1:], family=families.Binomial())  # method 0 stands at 0
    several = len(np.unique(rater)) > 1
    ways = {"cov_type": "cluster", "cov_kwds": {"groups": rater}} if several else {}
    with warnings.catch_warnings():
        # it takes a fit without any rest for separation, which was looked for above
        warnings.simplefilter("ignore", statsmodels("tools.sm_exceptions").PerfectSeparationWarning)
        fit = model.fit(**ways)
    centre = (np.eye(count) - 1 / count)[:, 1:]
    covariance = centre @ fit.cov_params() @ centre.T
    return centre @ fit.params, covariance if several else np.full((count, count), np.nan)
