"""Which attempts against replays count as a help, and what they change."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from experiments.rnn_gan.replay_attempts import MORE, TRAINED, drawn, helps, run_of


def found(replays=0.01, far=1.0, acceleration=1.0, jerk=1.0, likelihood=50.0) -> dict:
    return {
        "likelihood": {"value": likelihood},
        "samples over data": {"acceleration (m/s²)": acceleration, "jerk (m/s³)": jerk},
        "novelty": {"replays": replays, "median over that of held-out clips": far},
    }


@pytest.mark.parametrize(
    ("row", "wanted"),
    [
        (found(replays=0.05), True),
        (found(replays=0.06), False),
        (found(far=1.6), False),  # new because it is like nothing human
        (found(acceleration=0.89), False),
        (found(acceleration=1.11), False),
        (found(jerk=1.21), False),
        (found(likelihood=48.9), False),  # bought with likelihood
        (found(likelihood=49.1), True),
        (found() | {"novelty": {}}, False),  # nobody lasted a minute
    ],
)
def test_what_helps(row, wanted):
    assert helps(row, found()) is wanted


def test_how_frames_are_drawn_is_as_it_ships_times_a_factor():
    model = SimpleNamespace(sampling={"temperature": 0.1})
    assert drawn(model, {"temperature": 1.5}) == pytest.approx({"temperature": 0.15})


def test_every_training_begins_with_what_ships_in_a_folder_of_its_own():
    runs = [run_of(row) for row in TRAINED]
    assert len({run.folder for run in runs}) == len(runs)
    assert {run.first.stem for run in runs} == {"lstm-gmm"}
    assert {run.preset.updates for run in runs} == {MORE["updates"]}
