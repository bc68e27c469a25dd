"""Which attempts to keep a pace count as a help, and what they change."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from experiments.rnn_gan.pace_attempts import DATA, MORE, TRAINED, drawn, helps, run_of


def found(walk: float = 1.0, run: float | None = 1.0, likelihood: float = 50.0) -> dict:
    of = lambda ratio: {
        span: {"speed over the start's": {"value": ratio}} for span in ("8-10 s", "30-60 s")
    }
    runs = of(run) if run is not None else {"not measured": "nobody runs"}
    return {"likelihood": {"value": likelihood}, "walk": of(walk), "run": runs}


@pytest.mark.parametrize(
    ("row", "wanted"),
    [
        (found(1.04, 0.91), True),
        (found(1.06, 1.0), False),
        (found(1.0, 0.89), False),
        (found(1.0, 1.0, likelihood=48.9), False),  # bought with likelihood
        (found(1.0, 1.0, likelihood=49.1), True),
        (found(1.0, None), True),  # nobody runs in these clips
        (found(0.94, None), False),
    ],
)
def test_what_helps(row, wanted):
    assert helps(row, found()) is wanted


def test_one_span_off_is_enough_to_fail():
    row = found()
    row["walk"]["30-60 s"]["speed over the start's"]["value"] = 1.2
    assert not helps(row, found())


def test_how_frames_are_drawn_is_as_it_ships_times_a_factor():
    model = SimpleNamespace(sampling={"temperature": 0.2, "memory": 0.8})
    assert drawn(model, {}) == model.sampling
    assert drawn(model, {"temperature": 1.5}) == pytest.approx({"temperature": 0.3, "memory": 0.8})


def test_every_training_begins_with_what_ships_in_a_folder_of_its_own():
    runs = [run_of(row, model) for model in DATA for row in TRAINED]
    assert len({run.folder for run in runs}) == len(runs)
    assert {run.first.stem for run in runs} == set(DATA)
    assert {run.preset.updates for run in runs} == {MORE["updates"]}
