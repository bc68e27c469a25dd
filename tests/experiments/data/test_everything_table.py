"""How clips are told apart by kind, and summed up."""

from __future__ import annotations

from dataclasses import replace

import pytest

from experiments.data.everything_table import KINDS, amount, kind_of
from motionlab.datasets import registry


def clip_of(action):
    return next(clip for clip in registry.clips() if clip.action == action)


def test_kinds():
    expected = {"walk-turn-left": "locomotion", "dance-short": "dance", "kick": "martial arts",
                "byebye": "gestures", "skip": "jumps"}  # fmt: skip
    assert {action: kind_of(clip_of(action)) for action in expected} == expected
    assert {kind_of(clip) for clip in registry.members("everything")} == set(KINDS)


def test_an_action_without_a_kind_is_refused():
    with pytest.raises(ValueError, match="juggle"):
        kind_of(replace(clip_of("walk"), action="juggle"))


def test_amounts_add_up():
    walk, dance = clip_of("walk"), clip_of("dance")
    both, each = amount([walk, dance]), [amount([walk]), amount([dance])]
    assert both == {key: pytest.approx(each[0][key] + each[1][key]) for key in both}
    assert each[0]["minutes"] == pytest.approx(walk.frames / walk.fps / 60)
    assert both[f"minutes, {walk.split}"] >= each[0]["minutes"]
