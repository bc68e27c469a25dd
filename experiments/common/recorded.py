"""The recorded clips of prepared data, each with its entry in the table of all clips."""

from __future__ import annotations

from torch import Tensor

from motionlab.datasets.registry import Clip, choose
from motionlab.training import Prepared


def recorded_clips(data: Prepared) -> list[tuple[Clip, str, Tensor]]:
    """Entry, split and features (frames, dim) of each clip; mirrored ones are in no table."""
    table = {f"{clip.source}/{clip.name}": clip for clip in choose("locomotion")}
    each = zip(data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True)
    return [(table[name], split, features) for name, split, features in each if name in table]
