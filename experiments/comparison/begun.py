"""Where all methods begin: the same seconds of the same recorded clips."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from motionlab.encodings import JointAngles
from motionlab.errors import DataError
from motionlab.training import Prepared

from ..common import rollouts
from ..common.recorded import recorded_clips
from .columns import GAITS, MILLISECONDS, SEEN


@dataclass(frozen=True, eq=False)
class Begun:
    """Motion that goes on.

    rows : (starts, seen, dim) of `JointAngles` with contacts; each begins at the origin, facing ahead.
    """

    rows: Tensor
    encoding: JointAngles

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which) -> Begun:
        return Begun(self.rows[which], self.encoding)

    @property
    def points(self) -> Tensor:
        """Joints (starts, seen, joints, 3) in metres."""
        return joints_of(self.encoding, self.rows)


def joints_of(encoding: JointAngles, rows: Tensor) -> Tensor:
    """Joints (..., frames, joints, 3) without end sites, which not every method names."""
    return encoding.positions(rows)[..., : encoding.skeleton.joints, :]


def clips_of(data: Prepared, gait: str, split: str) -> list[Tensor]:
    """Recorded clips (frames, dim) of a gait that last for what is seen and what is foretold."""
    long = frames_of(data, SEEN) + ahead(data)
    return [
        clip
        for entry, its, clip in recorded_clips(data)
        if its == split and len(clip) >= long and entry.action.startswith(GAITS[gait])
    ]


def beginnings(data: Prepared, clips: list[Tensor], count: int) -> tuple[Begun, list[Tensor]]:
    """The first seconds of some clips, spread evenly, and those clips.

    Raises
    ------
    DataError : there are no clips.
    """
    if not clips:
        raise DataError("No recorded clip of this gait is long enough to begin in and to go on.")
    chosen = [clips[i] for i in rollouts.spread_evenly(len(clips), count)]
    rows = torch.stack([clip[: frames_of(data, SEEN)] for clip in chosen])
    return Begun(rows, data.encoding), chosen


def frames_of(data: Prepared, seconds: float) -> int:
    return round(seconds * data.encoding.fps)


def ahead(data: Prepared) -> int:
    """Frames that must follow for a forecast to be judged."""
    return -int(-MILLISECONDS[-1] * data.encoding.fps // 1000)
