"""The list of trainings of chapter 4, at the smallest size, on gaits."""

import json
import math
from dataclasses import replace

import pytest
import torch

from experiments.aclstm import trainings
from motionlab.training import PRESETS
from motionlab.training.dances import METHODS

pytest.importorskip("lightning_fabric")
pytestmark = pytest.mark.usefixtures("dances")  # gaits for dances, in an empty folder


def row(name):
    return next(row for row in trainings.ROWS if row.name == name)


def test_every_method_learns_every_style_and_the_plain_pair_has_three_seeds():
    names = [row.name for row in trainings.ROWS]
    assert len(set(names)) == len(names)
    wanted = {
        f"{method}-{style}" for method in METHODS for style in ("martial", "indian", "walking")
    }
    assert wanted | {"length-1", "length-2", "length-10", "fps-60"} <= set(names)
    assert {row.name for row in trainings.ROWS if len(row.seeds) == 3} == set(trainings.PLAIN)


def test_what_claims_need_most_comes_first():
    first = [(run.row.name, run.seed) for run in trainings.in_order(None, "table")][:7]
    assert first[:4] == [("aclstm-indian", 0), ("lstm-3lr-indian", 0),
                         ("aclstm-indian", 1), ("lstm-3lr-indian", 1)]  # fmt: skip
    assert first[6][0].endswith("-indian") and first[6][0] not in trainings.PLAIN


def test_rows_differ_from_the_table_in_what_they_say():
    for name, changes in {
        "length-10": {"real", "fed"}, "fps-60": {"fps"}, "staircase": {"staircase"},
        "trim": {"trim"}, "metres": {"metres"}, "aclstm-indian": set(),
    }.items():  # fmt: skip
        preset, base = (
            trainings.run_of(row(name), 0, "table").preset,
            METHODS["aclstm"]["table"],
        )
        assert {key for key in vars(base) if getattr(preset, key) != getattr(base, key)} == changes
    ten = trainings.run_of(row("length-10"), 0, "table").preset
    assert (ten.real, ten.fed) == (10, 10)
    assert trainings.run_of(row("aclstm-indian"), 2, "table").preset.seed == 2


def test_all_rows_have_the_same_budget():
    budgets = {
        (p.updates, p.batch, p.frames)
        for p in (run.preset for run in trainings.in_order(None, "table"))
    }
    assert len(budgets) == 1
    assert all(run.preset.snapshots for preset in ("table", "smoke")
               for run in trainings.in_order(None, preset))  # fmt: skip


def test_list_is_trained_in_shares_gone_on_with_and_told(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(trainings, "ROWS", (row("staircase"), row("trim")))
    trainings.main(["--preset", "smoke", "--share", "1/2"])
    made = sorted(path.parent.as_posix() for path in tmp_path.rglob("at-40.safetensors"))
    assert len(made) == 1
    assert not (tmp_path / "runs" / "dances-smoke" / "all.json").exists()
    run = trainings.run_of(trainings.ROWS[1], 0, "smoke")
    assert trainings.weights_of(run) is None
    trainings.main(["--preset", "smoke", "--share", "2/2"])
    assert trainings.weights_of(run) == run.folder / "at-40.safetensors"
    assert list(trainings.snapshots(run)) == [10, 20, 30, 40]
    told = json.loads((tmp_path / "runs" / "dances-smoke" / "all.json").read_text(encoding="utf-8"))
    assert len(told) == 2 and all(its["updates"] == 40 for its in told.values())
    before = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.safetensors")}
    trainings.main(["--preset", "smoke"])
    assert {p: p.stat().st_mtime_ns for p in before} == before  # nothing was trained again
    capsys.readouterr()
    trainings.main(["--preset", "smoke", "--list"])
    assert capsys.readouterr().out.count("40 of     40") == 2


def test_a_training_that_falls_apart_counts_with_what_it_had(dances):
    run = trainings.run_of(row("aclstm-indian"), 0, "smoke")
    wild = replace(run, preset=replace(run.preset, learning_rate=1e30, clip=1e30, optimizer="sgd"))
    wild.train(dances.found("indian"), "aclstm-indian")
    assert wild.done and wild.fell_apart and wild.made < 40
    assert trainings._told(wild)["fell apart"]


def test_shares_are_apart_and_together_everything(monkeypatch):
    trained = []
    monkeypatch.setattr(
        trainings.Run, "train", lambda run, data, name: trained.append((run.folder, name))
    )
    for share in ("1/3", "2/3", "3/3"):
        trainings.main(["--share", share])
    runs = trainings.in_order(None, "table")
    assert sorted(trained) == sorted((run.folder, run.row.model) for run in runs)
    assert all(name in PRESETS for _, name in trained)


def test_same_moments_at_every_rate_and_every_recording_once(dances):
    slow, fast = dances.seeds("indian", 6), dances.seeds("indian", 6, 60.0)
    assert slow.seen.shape[:2] == fast.seen.shape[:2] == (6, 10)
    assert slow.true.shape[1] == 20 and fast.true.shape[1] == 39
    torch.testing.assert_close(slow.seen[:, -1, 3:], fast.seen[:, -1, 3:])
    torch.testing.assert_close(slow.true[:, :18, 3:], fast.true[:, 1:37:2, 3:])
    torch.testing.assert_close(
        slow.true[:, :18, 0], fast.true[:, :36, 0].unflatten(1, (18, 2)).sum(-1), atol=1e-5, rtol=0
    )
    assert len(set(slow.clips)) == 2 and not any(
        "_2/2" in name for name in dances.of("indian").names
    )
    data = dances.found("indian")
    names = [name for name in data.names if not name.endswith("_2/2")]
    assert list(dances.of("indian").names) == names
    minutes = lambda its: float(its.lengths.sum()) / its.encoding.fps
    whole = sum(int(n) for n, name in zip(data.lengths, data.names, strict=True) if name in names)
    assert minutes(dances.of("indian")) == pytest.approx(whole / 60, rel=0.02)
    with pytest.raises(Exception, match="60 frames a second, not 120"):
        dances.of("indian", 120.0)


def test_moments_are_spread_over_all_held_out_clips(dances):
    found = dances.moments("indian", 20)
    assert len(found) == len(set(found)) == 20
    for number in {clip for clip, _ in found}:
        seconds = [at for clip, at in found if clip == number]
        assert min(seconds) >= 10 / 30 - 1e-9 and math.isfinite(max(seconds))
    assert len(dances.moments("indian", 10**6)) < 10**6
