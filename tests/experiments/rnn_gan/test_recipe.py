"""The list of trainings: what is run when, at the smallest size, on gaits."""

import json

import pytest

from experiments.rnn_gan import recipe
from motionlab.training import PRESETS

pytest.importorskip("lightning_fabric")


@pytest.fixture(autouse=True)
def small(gaits, tmp_path, monkeypatch):
    """Gaits for all data, in an empty folder."""
    data = gaits.without_contacts()
    monkeypatch.setattr(recipe.recipe_data, "of", lambda name: data)
    monkeypatch.setattr(recipe.recipe_data, "name_of", lambda data: "gaits")
    recipe._judged.cache_clear()
    monkeypatch.chdir(tmp_path)
    yield
    recipe._judged.cache_clear()


def row(name):
    return next(row for row in recipe.ROWS if row.name == name)


def test_rows_that_are_judged_are_there():
    names = {row.name for row in recipe.ROWS}
    assert {
        "table",
        "no noise",
        "RMSProp",
        "SGD",
        "pretrained",
        "scratch",
        "30 fps",
        "120 fps",
    } <= names
    assert all(row.first in names | {None} for row in recipe.ROWS)


def test_scratch_has_as_many_updates_as_pretraining_and_after():
    base = PRESETS["lstm-gmm"]["table"]
    updates = {name: recipe.preset_of(row(name), base).updates
               for name in ("everything else", "pretrained", "scratch")}  # fmt: skip
    assert updates["scratch"] == updates["everything else"] + updates["pretrained"]


def test_rows_differ_from_the_table_in_what_they_say():
    base = PRESETS["lstm-gmm"]["table"]
    assert recipe.preset_of(row("table"), base) == base
    for name, change in [("no noise", {"noise": 0.0}), ("skip 0", {"skip": 0.0})]:
        preset = recipe.preset_of(row(name), base)
        assert {key for key in vars(base) if getattr(preset, key) != getattr(base, key)} == set(
            change
        )


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_two_processes_never_train_the_same(tmp_path, monkeypatch, parts):
    monkeypatch.setattr(recipe.Run, "validation", 1.0)
    base, shares = PRESETS["lstm-gmm"]["table"], []
    for part in range(1, parts + 1):
        rows = recipe.shared(recipe.ROWS, part, parts)
        runs = [run for row in rows for seed in recipe.SEEDS
                for run in recipe.needed(row, seed, base, tmp_path)]  # fmt: skip
        shares.append({run.folder for run in runs})
    assert len(set().union(*shares)) == sum(map(len, shares)) == 10 * 3 + 2 * 3


def test_list_is_trained_stopped_gone_on_with_and_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(recipe, "SEEDS", (0, 1))
    arguments = ["--preset", "smoke", "--starts", "2", "--seconds", "2", "--output", "found.json"]
    only = ["--only", "RMSProp", "pretrained"]
    for share in ("1/2", "2/2"):
        recipe.main([*arguments, *only, "--share", share])
    assert not (tmp_path / "found.json").exists()
    before = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("best.safetensors")}
    assert len(before) == (3 + 2) + (2 + 2)  # trials and seeds; before and after
    recipe.main([*arguments, *only])
    assert {p: p.stat().st_mtime_ns for p in before} == before  # nothing was trained again
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert list(found["rows"]) == ["RMSProp", "pretrained"]
    for told in found["rows"].values():
        assert [run["seed"] for run in told["runs"]] == [0, 1]
        assert all(0 < run["seconds until failure"] <= 2 for run in told["runs"])
    rates = found["rows"]["RMSProp"]["learning rates"]
    assert len(rates) == 3 and min(rates.values()) < max(rates.values())
    capsys.readouterr()
    recipe.main(["--preset", "smoke", "--list", "--only", "pretrained"])
    assert capsys.readouterr().out.count("10 of     10") == 2


def test_another_preset_must_not_overwrite_the_result(capsys):
    with pytest.raises(SystemExit):
        recipe.main(["--preset", "smoke"])
    assert "--output" in capsys.readouterr().err


def test_a_training_that_falls_apart_is_told_and_not_begun_again(tmp_path):
    wild = recipe.Row(
        "wild", "a far too high learning rate", {"learning_rate": 1e12, "optimizer": "sgd"}
    )
    base = PRESETS["lstm-gmm"]["smoke"]
    run = recipe.final(wild, 0, base, tmp_path)
    run.train(recipe.recipe_data.of(wild.data), recipe.NAME)
    assert run.done and (run.folder / "failed.txt").exists()
    assert recipe.evaluated(run, 2, 1.0)["fell apart"] is True
