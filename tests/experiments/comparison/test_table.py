"""Cells of the table, pairs of trainings, and what is kept of what was measured."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from experiments.comparison import table
from experiments.comparison.columns import COLUMNS, GAITS
from experiments.comparison.methods import EQUAL, FLOOR, Method

NAMES = [column.name for column in COLUMNS]


def row(values, kind=EQUAL):
    """One whose every seed has one value in every column."""
    cells = {name: {"value": sum(values) / len(values), "seeds": values} for name in NAMES}
    return {"kind": kind, "gaits": {gait: cells for gait in GAITS}}


def floor(wide=0.2):
    cell = {"value": 0.0, "low": -wide / 2, "high": wide / 2}
    return {gait: dict.fromkeys(NAMES, cell) for gait in GAITS}


def test_trainings_are_compared_by_seeds_and_counted_beside_chance():
    rows = {"near": row([1.0, 1.1, 1.2]), "far": row([2.0, 2.1, 2.2]), "ships": row([9.0], FLOOR)}
    found = table.compared(rows, floor())
    assert list(found["pairs"]) == ["near / far"]
    walk = found["pairs"]["near / far"]["walk"]
    assert (
        walk["jerk (m/s³)"] == "better" and walk["alive"] == "worse"
    )  # of survival more is better
    count = len(GAITS) * len(COLUMNS)
    assert (found["tested"], found["parted"]) == (count, count)
    assert found["by chance"] == pytest.approx(0.1 * count)
    assert table.compared(rows, floor(wide=3.0))["parted"] == 0
    few = table.compared(rows | {"far": row([2.0])}, floor())
    assert few["tested"] == 0 and few["pairs"]["near / far"]["run"]["critic"] == "not tested"


def test_a_cell_has_the_mean_of_seeds_and_an_interval_over_starts():
    seeds = [{"critic": [0.5, 0.7, 0.9]}, {"critic": [0.7, 0.9, 1.1]}]
    cell = table.cell("critic", seeds, None)
    assert cell["value"] == pytest.approx(0.8) and cell["seeds"] == pytest.approx([0.7, 0.9])
    assert 0.6 <= cell["low"] < 0.8 < cell["high"] <= 1.0
    errors = [{"errors": [[1, 2, 3, 4, 5, 6], [3, 4, 5, 6, 7, 8]]}]
    assert table.cell("error, 160 ms (cm)", errors, None)["value"] == 3.0
    variety = [{"variety": {"value": 0.5}}, {"variety": {"value": 0.7}}]
    assert table.cell("variety", variety, None) == {
        "value": pytest.approx(0.6),
        "seeds": [0.5, 0.7],
    }
    lasted = {"alive": {"value": 0.5}, "seconds each": 600.0, "failed": {"frozen": 2, "diverged": 0},
              "seconds until failure": [float("inf"), 30.0, 90.0, float("inf")]}  # fmt: skip
    alive = table.cell("alive", [{"alive": lasted}] * 2, None)
    assert alive["failed"] == {"frozen": 4, "diverged": 0} and alive["rollouts"] == 8
    assert alive["value"] == 0.5 and 0.2 < alive["low"] < 0.5 < alive["high"] < 0.8
    assert alive["median seconds until failure"] == pytest.approx(345.0)
    assert table.cell("alive", [{"alive": lasted}, {}], None) is None  # of one seed it isn't known


def test_what_was_measured_is_kept_by_weights_and_source(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "KEPT", tmp_path)
    weights = lambda name: SimpleNamespace(hash=name)
    one, other = (Method("RNN", EQUAL, "", None, (weights(name),)) for name in ("a" * 9, "b" * 9))
    calls = []
    measure = lambda: calls.append(1) or {"value": len(calls)}
    assert table.kept(one, "walk", measure) == table.kept(one, "walk", measure) == {"value": 1}
    assert table.kept(other, "walk", measure) == {"value": 2}
    monkeypatch.setattr(table, "source", lambda: "another")
    assert table.kept(one, "walk", measure) == {"value": 3}
    assert not table.made_before(one)
    assert not list(tmp_path.rglob("*.part"))
