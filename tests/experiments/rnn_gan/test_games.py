"""The rows of the games: each changes what it says, and all have as many updates of the refiner."""

from __future__ import annotations

import json
import math
from dataclasses import asdict

import pytest

from experiments.rnn_gan import games
from motionlab.errors import DivergedError


def updates(preset):
    """The refiner's, if the game stays in balance."""
    return max(preset.warmup, preset.turns) + (preset.steps - 1) * preset.turns


def test_all_games_are_equally_long():
    for name, row in games.ROWS.items():
        preset = row.preset(0)
        assert updates(preset) == pytest.approx(games.OURS.steps, abs=5), name
        assert preset.steps >= preset.validate_every


def test_a_row_changes_what_it_says_and_nothing_else():
    lengths = {"steps", "validate_every"}
    for row in games.ROWS.values():
        base, changed = asdict(row.base), asdict(row.preset(row.base.seed))
        differ = {key for key in base if base[key] != changed[key]}
        assert differ == {key for key in row.changes if base[key] != row.changes[key]}
        assert len(differ - lengths) <= 2
    paper = games.ROWS["paper"].preset(0)
    assert (paper.warmup, paper.turns, paper.history, paper.root_weight) == (75, 5, 320, 20)


def test_a_game_that_falls_apart_is_told(monkeypatch, tmp_path):
    def fails(*_, **__):
        raise DivergedError("gone")

    monkeypatch.setattr(games, "train_game", fails)
    monkeypatch.setattr(games, "FOLDER", tmp_path)
    found = games.play(None, None, None, "paper", 0)
    assert found["after"] is None and found["said"] == "gone"
    games.told_in("paper", 0).write_text(json.dumps(found))  # its folder is there
    assert math.isfinite(found["seed"])
