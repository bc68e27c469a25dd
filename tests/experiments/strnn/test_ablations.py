"""Ablations of STRNN: which trainings there are, how rows are compared, and one pass through all."""

import json
import math

import pytest
import torch

from experiments.strnn import ablations
from motionlab.training.strnn import in_body_frame


@pytest.mark.parametrize(("preset", "updates"), [("table", 600), ("long", 2000)])
def test_all_rows_make_as_many_updates_and_differ_in_what_they_name(preset, updates):
    runs = ablations.in_order(preset=preset)
    assert {run.preset.updates for run in runs} == {updates}
    assert len({run.folder for run in runs}) == len(runs)
    first = [run for run in runs if run.seed == 0]
    assert runs[: len(first)] == first
    assert len({str(run.preset) for run in runs}) == len(runs)
    of = {run.row.name: run.preset for run in first}
    assert of["Temporal_39_1_MSE"].predict == 1 and not of["Temporal_39_1_MSE"].smooth
    assert of["Composite_20_20_HY"].alone and of["Composite_20_20_HY"].residual
    assert not of["Composite_20_20_LH"].partial and of["Composite_20_20_LH"].smooth
    assert {p for pairs in ablations.PAIRS.values() for pair in pairs for p in pair} <= {*of}


def row(**seeds):
    return {"seeds": {name[1:]: {"to real": its} for name, its in seeds.items()}}


def test_a_pair_is_better_only_beyond_doubt():
    far, near = [3.0 + 0.1 * (i % 3) for i in range(20)], [2.0 + 0.1 * (i % 4) for i in range(20)]
    found = ablations.compared(row(s0=near), row(s0=far))
    assert found["found"] == "better" and found["difference"].high < 0
    assert math.isclose(found["difference"].value, sum(near) / 20 - sum(far) / 20, abs_tol=1e-5)
    assert ablations.compared(row(s0=far), row(s0=near))["found"] == "worse"
    mixed = [far[i] if i % 2 else near[i] for i in range(20)]
    other = [near[i] if i % 2 else far[i] for i in range(20)]
    assert ablations.compared(row(s0=mixed), row(s0=other))["found"] == "undecided"
    # the prefixes are sure, but one seed says the opposite
    split = ablations.compared(row(s0=near, s1=far), row(s0=[9.0] * 20, s1=near))
    assert split["difference"].high < 0 and split["found"] == "undecided"
    # a seed that only one of them has does not count
    assert ablations.compared(row(s0=near, s1=[99.0] * 20), row(s0=far))["found"] == "better"


@pytest.mark.parametrize(
    "name", ["Composite_5_5_HY", "Temporal_39_1_MSE", "Bidirectional_20_20_LH"]
)
def test_a_row_is_trained_kept_and_judged(walks, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    data = in_body_frame(walks)
    (run,) = (run for run in ablations.in_order([name], "smoke") if run.seed == 0)
    run.train(data, name)
    assert run.done and ablations.weights_of(run).exists()
    found = ablations.judged([run], data, "val")
    its = found["rows"][name]["seeds"]["0"]
    assert len(its["to real"]) == 3 and all(0 < far <= ablations.FAR for far in its["to real"])
    assert its["errors"]["all"] > 0 and its["updates"] == 4
    assert 0 < found["real"]["to real"] < ablations.FAR
    assert found["pairs"]["S2"] == {}
    json.dumps(found["rows"])


def test_rivals_learn_on_the_same_rows(walks):
    data = in_body_frame(walks)
    for name in ablations.METHODS:
        (run,) = ablations.in_order([name], "smoke")
        windows = run.preset.windows(data, "train").draw(3, torch.Generator().manual_seed(0))
        extras = run.preset.extras(windows.shape, 3, torch.Generator().manual_seed(0))
        model = run.preset.model(walks)
        loss = model.loss(windows, **extras)
        loss.backward()
        assert loss.isfinite() and ("noise" in extras) == (name == "erd")
