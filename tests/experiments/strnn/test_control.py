"""Runs along paths: where they begin, and one pass through a row."""

import pytest
import torch

from experiments.strnn import control
from motionlab import metrics
from motionlab.errors import DataError
from motionlab.paths import Path as Way
from motionlab.training import PRESETS, build
from motionlab.training.strnn import in_body_frame


@pytest.fixture(scope="module")
def named(walks):
    from dataclasses import replace

    return replace(walks, names=tuple(f"gaits/walk_{i}" for i in range(len(walks.names))))


def test_paths_begin_at_the_origin_lead_ahead_and_are_as_long_as_asked():
    for name, curve in control.paths(20.0).items():
        way = Way.through(curve)
        assert way.length == pytest.approx(20, rel=0.02), name
        assert torch.allclose(curve[0], torch.zeros(2, dtype=curve.dtype), atol=1e-6)
        lead = way.places[3] - way.places[0]
        assert lead[1] > 5 * abs(lead[0]), name
    half = control.paths(20.0)["half circles"]
    assert half[:, 0].max() > 3.9 and half[:, 1].max() < 2.1 + half[:, 1].min() + 2.0


def test_runs_take_paths_in_turn_from_clips_of_walking(named, walks):
    data = in_body_frame(named)
    runs = control.runs_of(data, "val", 3, 20, 90)
    assert len(runs) == 3 and len({float(run.speed) for run in runs}) == 3
    clips = data.clips("val")
    for run, clip in zip(runs, clips, strict=True):
        assert torch.equal(run.seed, clip[len(clip) // 2 - 20 :][:20])
        assert run.speed == pytest.approx(float(run.seed[:, 67].mean()))
        assert run.way.length > run.speed * 90 / 30
    with pytest.raises(DataError, match="No clip of walking"):
        control.runs_of(in_body_frame(walks), "val", 3, 20, 90)


def test_a_row_tells_what_became_of_its_runs(named):
    data = in_body_frame(named)
    model = build(named, PRESETS["strnn-temporal-hy"]["smoke"])
    runs = control.runs_of(data, "val", 2, model.encode, 40)
    judge = control.rollouts.judge_of(data)
    row, made = control.of_one(model, runs, 40, judge, fit="state", steps=2)
    assert row["runs"] == 2 and row["weights restored"] and 0 <= row["alive"] <= 1
    points = model.encoding.positions(made.features, made.places)
    off = metrics.root_path_error(points, runs[0].way.places.float()).rms[0]
    assert control.told(points[0], runs[0], model)["root to path (cm)"] == pytest.approx(
        float(off), abs=0.1
    )
    on = control.put_on(model, made, runs)
    assert on["bones, mean (cm)"] < 1e-3 < row["bones, mean (cm)"]
