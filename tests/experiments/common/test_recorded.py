"""Recorded clips: each with its own entry and split, mirrored ones left out."""

from __future__ import annotations

from types import SimpleNamespace

import torch

from experiments.common.recorded import recorded_clips
from motionlab.datasets.registry import choose


def test_recorded_clips_come_with_their_entries():
    first, second = choose("locomotion")[:2]
    names = [f"{clip.source}/{clip.name}" for clip in (second, first)]
    data = SimpleNamespace(
        names=(names[0], f"{names[1]}_mirrored", names[1], "mine/walk"),
        splits=("val", "train", "train", "train"), lengths=torch.tensor([2, 3, 4, 1]),
        features=torch.arange(10.0)[:, None],
    )  # fmt: skip
    found = recorded_clips(data)
    assert [(entry, split) for entry, split, _ in found] == [(second, "val"), (first, "train")]
    assert [clip[:, 0].tolist() for _, _, clip in found] == [[0, 1], [5, 6, 7, 8]]
