"""Tables of metrics: every row with its interval, and real against real motion beneath."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from ..errors import MetricError
from .bootstrap import Interval, bootstrap, numbers_of

Row = Mapping[str, Sequence[float] | Interval]


def table(
    rows: Mapping[str, Row],
    *,
    floor: Mapping[str, Row],
    statistic: Callable[[Sequence], float] = np.mean,
    seed: int = 0,
) -> pd.DataFrame:
    """Rows of metrics as text, ``1.2 [1.1, 1.3]``, and the floor: what real motion scores.

    Parameters
    ----------
    rows : ``{"acLSTM": {"foot skate (cm/s)": values, ...}, ...}``: for each metric one value a
        clip, from which the interval is drawn (NaN is left out), or an `Interval` for a metric of
        whole sets.
    floor : rows of the same metrics, of real motion: one half of the clips, the other half; for
        distances from real motion that of one half from the other. What lies within them is
        not to be told from real.
    statistic : what a cell shows of its clips.

    Returns
    -------
    DataFrame of text, the floor last. A star marks what is told apart: a value the interval of
    which does not meet the range that the floor's intervals span.

    Raises
    ------
    MetricError : no floor, or a metric that the floor lacks.
    """
    if not floor:
        raise MetricError(
            "table: no floor; give rows of real motion against real motion, as halves of the data."
        )
    intervals = {
        name: {metric: _interval(values, statistic, seed) for metric, values in row.items()}
        for name, row in [*rows.items(), *floor.items()]
    }
    if len(intervals) < len(rows) + len(floor):
        raise MetricError("table: a row and a floor have the same name; rename one of them.")
    metrics = list(dict.fromkeys(metric for name in rows for metric in intervals[name]))
    metrics = metrics or list(dict.fromkeys(metric for name in floor for metric in floor[name]))
    cells = {}
    for metric in metrics:
        real = [intervals[name][metric] for name in floor if metric in intervals[name]]
        if not real:
            raise MetricError(
                f"table: the floor has no {metric!r}; measure it on real motion against real."
            )
        low, high = min(i.low for i in real), max(i.high for i in real)
        cells[metric] = [
            _cell(row.get(metric), name in rows, low, high) for name, row in intervals.items()
        ]
    return pd.DataFrame(cells, index=list(intervals))


def _interval(values: Sequence[float] | Interval, statistic: Callable, seed: int) -> Interval:
    if isinstance(values, Interval):
        return values
    return bootstrap(numbers_of(values), statistic, seed=seed)


def _cell(interval: Interval | None, marked: bool, low: float, high: float) -> str:
    if interval is None:
        return ""
    apart = marked and (interval.low > high or interval.high < low)
    return f"{interval}{' *' if apart else ''}"
