"""The rule for comparisons of trainings, and that the table's trainings are equal where they say so."""

from __future__ import annotations

import itertools
import math

import pytest

from experiments.comparison import trainings
from experiments.comparison.columns import COLUMNS, off
from experiments.comparison.significance import BETTER, BY_CHANCE, UNDECIDED, WORSE, compared


@pytest.mark.parametrize(
    ("ours", "theirs", "least", "wanted"),
    [
        ([1.0, 1.1, 1.2], [2.0, 2.1, 2.2], 0.5, "better"),
        ([2.0, 2.1, 2.2], [1.0, 1.1, 1.2], 0.5, "worse"),
        ([1.0, 1.1, 1.2], [2.0, 2.1, 2.2], 1.5, "undecided"),  # less than real motion differs
        ([1.0, 1.1, 2.05], [2.0, 2.1, 2.2], 0.1, "undecided"),  # seeds overlap
        ([1.0, 1.1, math.inf], [2.0, 2.1, 2.2], 0.1, "undecided"),  # one fell apart
        ([1.0, 1.1], [2.0, 2.1, 2.2], 0.1, "not tested"),
    ],
)
def test_when_one_is_better(ours, theirs, least, wanted):
    assert compared(ours, theirs, least) == wanted


def test_chance_parts_three_from_three_as_often_as_is_said():
    deals = [
        compared(first, [rank for rank in range(6) if rank not in first], 0.0)
        for first in map(list, itertools.combinations(range(6), 3))
    ]
    parted = sum(said in (BETTER, WORSE) for said in deals)
    assert parted / len(deals) == BY_CHANCE and UNDECIDED in deals


def test_what_is_better_in_a_column():
    named = {column.name: column for column in COLUMNS}
    assert off(named["alive"], 0.9, 1.0) < off(named["alive"], 0.1, 1.0)
    assert off(named["critic"], 0.6, 0.5) < off(named["critic"], 0.9, 0.5)
    assert off(named["jerk (m/s³)"], 90.0, 100.0) == off(named["jerk (m/s³)"], 110.0, 100.0)
    assert off(named["critic"], math.nan, 0.5) == math.inf


def test_all_trainings_see_as_many_frames_in_folders_of_their_own():
    presets = trainings.PRESETS_OF.values()
    assert {trainings.frames_seen(preset) for preset in presets} == {trainings.BUDGET}
    runs = [trainings.run_of(row.name, seed) for row in trainings.ROWS for seed in trainings.SEEDS]
    assert len({run.folder for run in runs}) == len(runs)
    assert {run.preset.seed for run in runs} == set(trainings.SEEDS)
