"""How sure is a number: intervals over clips.

Clips, not frames or windows: these depend on each other within a clip, and an interval over them
would be far too narrow. The smaller the set, the less it can know of what it does not hold: below
some ten clips take intervals for too narrow as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from scipy.stats import t as student

from ..errors import MetricError


class Interval(NamedTuple):
    """A statistic of clips, the interval in which it lies, and how many clips counted."""

    value: float
    low: float
    high: float
    clips: int

    def __str__(self) -> str:
        # a share of 0.00006 reads as 0, not as 6.09e-05; a jerk of 1234 not as 1.23e+03
        value, low, high = (
            f"{round(x, 3):.3g}" if abs(x) < 1000 else f"{x:.0f}"
            for x in (self.value, self.low, self.high)
        )
        return f"{value} (one clip)" if self.clips == 1 else f"{value} [{low}, {high}]"


def bootstrap(
    values: Sequence,
    statistic: Callable[[Sequence], float] = np.mean,
    *,
    resamples: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> Interval:
    """Percentile interval of a statistic of clips (Efron 1979): clips are drawn with replacement.

    Parameters
    ----------
    values : one entry a clip: numbers (the default takes their mean, and leaves out NaN: metrics
        give it for clips for which they are not defined), or anything else that `statistic` takes
        a list of, such as the windows of a clip. For distances between sets see `jackknife`.
    statistic : from a list of entries to a number, in the unit of the metric.
    resamples, confidence : how often clips are drawn anew; share that the interval holds.
    seed : the same seed draws the same clips: two rows of one table are drawn alike.

    Raises
    ------
    MetricError : no clips, not one number a clip, or a confidence that is not between 0 and 1.
    """
    if isinstance(values, torch.Tensor):
        values = values.detach().cpu().numpy()
    if len(values) == 0:
        raise MetricError("bootstrap: there are no clips; give one value for each of some.")
    _check_confidence(confidence)
    if resamples < 1:
        raise MetricError(f"bootstrap: resamples is {resamples!r}; it must be at least 1.")
    plain = statistic is np.mean
    if plain:
        values = numbers_of(values)
    count = len(values)
    draws = np.random.default_rng(seed).integers(count, size=(resamples, count))
    if plain:
        value, found = values.mean(), values[draws].mean(1)
    else:
        value = statistic(values)
        found = np.array([float(statistic([values[i] for i in draw])) for draw in draws])
    edge = (1 - confidence) / 2
    # an infinite value, as the time of a failure that never came, has no value between it and others
    method = "linear" if np.isfinite(found).all() else "nearest"
    low, high = np.quantile(found, [edge, 1 - edge], method=method)
    return Interval(float(value), float(low), float(high), count)


def jackknife(
    values: Sequence, statistic: Callable[[Sequence], float], *, confidence: float = 0.95
) -> Interval:
    """Interval of a statistic of a whole set of clips, from leaving out each (Tukey 1958).

    For distances between sets, such as Fréchet's. A bootstrap of these is biased: a drawn set
    holds a third of the clips not at all and others twice, has less variety, and lies farther
    from everything; the value of the whole set may even lie outside the interval of such draws.

    Parameters
    ----------
    values : one entry a clip, two or more; whatever `statistic` takes a list of.

    Returns
    -------
    Interval : value ± Student's quantile times the jackknife's standard error. An interval of a
        distance that reaches below 0 says that it is not told from 0.
    """
    _check_confidence(confidence)
    values = list(values)
    count = len(values)
    if count < 2:
        raise MetricError(f"jackknife: {count} clips; it needs two or more, to leave one out.")
    value = float(statistic(values))
    left = np.array([float(statistic(values[:i] + values[i + 1 :])) for i in range(count)])
    error = np.sqrt((count - 1) * left.var())
    reach = float(student.ppf((1 + confidence) / 2, count - 1) * error)
    return Interval(value, value - reach, value + reach, count)


def _check_confidence(confidence: float) -> None:
    if not 0 < confidence < 1:
        raise MetricError(f"confidence is {confidence!r}; it must lie between 0 and 1.")


def numbers_of(values: Sequence) -> np.ndarray:
    """One number a clip, as an array without NaN; raises MetricError."""
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError, RuntimeError) as error:
        raise MetricError(
            f"bootstrap: values must be one number a clip, unless a statistic is given: {error}."
        ) from error
    if numbers.ndim != 1:
        raise MetricError(
            f"bootstrap: values has shape {numbers.shape}; it must be one number a clip."
        )
    defined = numbers[~np.isnan(numbers)]
    if len(defined) == 0:
        raise MetricError(
            f"bootstrap: the values of all {len(numbers)} clips are NaN: the metric is defined for "
            "none of them."
        )
    return defined
