"""Tables show intervals, and real motion beside every row."""

import numpy as np
import pytest

from motionlab.errors import MetricError
from motionlab.metrics import Interval, bootstrap, table

RANDOM = np.random.default_rng(0)
FLOOR = {
    "real, half A": {
        "skate (cm/s)": RANDOM.normal(2, 0.5, 40),
        "distance": Interval(1, 0.8, 1.2, 40),
    },
    "real, half B": {
        "skate (cm/s)": RANDOM.normal(2, 0.5, 40),
        "distance": Interval(1, 0.9, 1.3, 40),
    },
}


def test_rows_then_floor_with_intervals():
    skate = RANDOM.normal(7, 1, 40)
    found = table(
        {"RNN": {"skate (cm/s)": skate, "distance": Interval(1.2, 1.1, 1.3, 9)}}, floor=FLOOR
    )
    assert list(found.index) == ["RNN", "real, half A", "real, half B"]
    assert list(found.columns) == ["skate (cm/s)", "distance"]
    assert found.loc["RNN", "skate (cm/s)"] == f"{bootstrap(skate)} *"  # told apart from real
    assert found.loc["RNN", "distance"] == "1.2 [1.1, 1.3]"  # not told apart
    assert found.loc["real, half B", "distance"] == "1 [0.9, 1.3]"
    assert not found.loc[list(FLOOR)].map(lambda cell: cell.endswith("*")).any().any()


def test_a_row_may_lack_a_metric_and_the_floor_may_not():
    found = table(
        {"a": {"distance": Interval(3, 2, 4, 5)}, "b": {"skate (cm/s)": [2.0]}}, floor=FLOOR
    )
    assert found.loc["b", "distance"] == "" and found.loc["a", "distance"].endswith("*")
    with pytest.raises(MetricError, match="the floor has no 'jerk'"):
        table({"a": {"jerk": [1.0]}}, floor=FLOOR)
    with pytest.raises(MetricError, match="no floor"):
        table({"a": {"jerk": [1.0]}}, floor={})
    with pytest.raises(MetricError, match="same name"):
        table({"real, half A": {"distance": [1.0]}}, floor=FLOOR)


def test_the_floor_alone_is_a_table():
    assert list(table({}, floor=FLOOR).columns) == ["skate (cm/s)", "distance"]


def test_clips_for_which_a_metric_is_not_defined_are_left_out():
    for statistic in (np.mean, np.median):
        rows = {"a": {"skate (cm/s)": [3.0, np.nan, 3.0]}}
        found = table(rows, floor=FLOOR, statistic=statistic)
        assert found.loc["a", "skate (cm/s)"] == "3 [3, 3] *"


def test_another_statistic():
    found = table(
        {"a": {"time": [1.0, 2.0, np.inf]}}, floor={"real": {"time": [np.inf]}}, statistic=np.median
    )
    assert (
        found.loc["a", "time"].startswith("2 [") and found.loc["real", "time"] == "inf (one clip)"
    )
