"""The table of methods: what is marked, and what is said of what is missing."""

from __future__ import annotations

import re

import pytest

from motionlab import viewer
from motionlab.errors import ViewerError


def found(rows=2):
    """A result of `experiments.comparison.table`: one method like real motion, others apart."""
    real = {"value": 2.0, "low": 1.5, "high": 2.5}
    cells = lambda value: {
        "error, 80 ms (cm)": {"value": 1.0, "low": 0.9, "high": 1.1},
        "foot skate (cm/s)": {"value": value, "low": value - 0.1, "high": value + 0.1},
        "variety": {"value": 0.5, "seeds": [0.5]},
    }
    row = lambda value: {
        "gaits": {"walk": cells(value)}, "parameters": 1_300_000, "bytes": 2_700_000,
        "frames seen": 20_480_000, "seeds": [], "left out": {},
        "frames a second, over the reference's": {"1": 0.5, "256": None},
    }  # fmt: skip
    its = {f"method {i}": row(2.0 + 3 * i) for i in range(rows)}
    its["method 0"]["left out"] = {"256": "too dear", "alive": "as method 1"}
    return {
        "columns": dict.fromkeys(("error, 80 ms (cm)", "alive", "foot skate (cm/s)", "variety")),
        "floor": {"walk": {"foot skate (cm/s)": real, "variety": {"value": 1.0}}},
        "speed": {"reference": "method 1"}, "rows": its,
    }  # fmt: skip


def test_only_what_is_told_apart_from_real_motion_is_marked():
    frame = viewer.method_table(found()).frame
    assert list(frame.index) == ["method 0", "method 1", "real against real"]
    assert frame.loc["method 0", "foot skate (cm/s)"] == "2 [1.9, 2.1]"
    assert frame.loc["method 1", "foot skate (cm/s)"] == "5 [4.9, 5.1] *"
    assert frame.loc["real against real", "foot skate (cm/s)"] == "2 [1.5, 2.5]"
    assert list(frame["variety"]) == ["0.5", "0.5", "1"]
    assert set(frame["alive"]) == {"–"}


def test_parts_have_their_columns_and_say_what_they_leave_out():
    table = viewer.method_table(found())
    assert table.notes == ["method 0, alive: as method 1."] and "as method 1" in repr(table)
    forecasts = viewer.method_table(found(), "walk", "forecasts")
    assert list(forecasts.frame.columns) == ["80 ms (cm)"] and not forecasts.notes
    cost = viewer.method_table(found(), part="cost")
    assert cost.notes == ["method 0, 256 characters: too dear."]
    row = cost.frame.loc["method 0"]
    assert [row.iloc[0], row["256 characters"]] == ["0.5", "–"]
    assert [row["parameters (million)"], row["weights (MB)"]] == ["1.3", "2.7"]


def test_what_is_said_of_several_rows_stands_once():
    its = found(3)
    its["rows"]["method 0"]["left out"] = {"alive": "not measured yet"}
    its["rows"]["method 1"]["left out"] = {"alive": "as method 0"}
    its["rows"]["method 2"]["left out"] = {
        "alive": "not measured yet",
        "variety": "not measured yet",
    }
    assert viewer.method_table(its).notes == [
        "method 0; method 2, alive: not measured yet.",
        "method 1, alive: as method 0.",
        "method 2, variety: not measured yet.",
    ]


def test_it_is_shown_whole_with_its_floor():
    """A book's build folds what is long; a kernel shows it."""
    shown = viewer.method_table(found(12))._repr_html_()
    assert len(re.findall("<tr", shown)) == 12 + 2  # its head, and the floor
    assert 'class="dataframe"' in shown
    assert (
        '<td>2<br><small style="white-space: nowrap">[1.9, 2.1]</small></td>' in shown
    )  # not marked
    assert '<td>5 *<br><small style="white-space: nowrap">[4.9, 5.1]</small></td>' in shown


def test_what_is_not_there_is_said():
    with pytest.raises(ViewerError, match="'sound'; it is one of motion, forecasts, cost"):
        viewer.method_table(found(), part="sound")
    with pytest.raises(ViewerError, match="'hop'; the result has walk"):
        viewer.method_table(found(), "hop")
