"""Which rows of the comparison of runs help, and what it trains."""

from __future__ import annotations

import pytest

from experiments.rnn_gan.running_on import JUDGED, ROWS, helping, run_of


def found(run: float, walk: float = 1.0, likelihood: float = 50.0) -> dict:
    of = lambda ratio: {JUDGED: {"speed over the start's": {"value": ratio}}}
    return {"likelihood": {"value": likelihood}, "run": of(run), "walk": of(walk)}


@pytest.mark.parametrize(
    ("rows", "wanted"),
    [
        ({"a": [found(0.9), found(0.92)]}, ["a"]),
        ({"a": [found(0.9), found(0.79)]}, []),  # in one seed no better
        ({"a": [found(1.3), found(0.9)]}, []),  # too fast is no better than too slow
        ({"a": [found(0.9), found(0.9, walk=1.06)]}, []),  # walks must keep their pace
        ({"a": [found(0.9)], "b": [found(0.85, likelihood=51.0)]}, ["b", "a"]),
    ],
)
def test_what_helps(rows, wanted):
    rows = {"as recorded": [found(0.7), found(0.8)]} | rows
    assert helping(rows) == wanted


def test_without_what_was_recorded_nothing_is_said_to_help():
    assert helping({"a": [found(1.0)]}) == []


def test_rows_differ_in_what_they_say_and_in_their_folders():
    runs = [run_of(row, seed, "table") for row in ROWS for seed in (0, 1)]
    assert len({run.folder for run in runs}) == len(runs)
    assert [(r.preset.run_on, r.preset.runs) for r in runs[::2]] == [
        (0, 0.0), (0, 0.2), (180, 0.0), (180, 0.2), (180, 0.3),
    ]  # fmt: skip
    assert {run.preset.seed for run in runs} == {0, 1}
