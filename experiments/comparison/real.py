"""What recorded motion says: the clips that methods are held against, and the floor of each column."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from motionlab import metrics
from motionlab.encodings import Normalizer
from motionlab.training import Prepared

from ..common import rollouts
from ..rnn_gan import samples
from .begun import Begun, ahead, beginnings, clips_of, frames_of, joints_of
from .columns import GAITS, SEEN, STARTS


@dataclass(frozen=True, eq=False)
class Real:
    """Recorded motion, with where it is judged (test) and learned from (val)."""

    data: Prepared
    starts: int = STARTS

    @property
    def skeleton(self):
        return self.data.encoding.skeleton

    @property
    def fps(self) -> float:
        return self.data.encoding.fps

    @cached_property
    def judge(self) -> rollouts.Judge:
        """What failure is, read off all training clips."""
        long = [clip for clip in self._training() if len(clip) >= rollouts.WHOLE * self.fps]
        return rollouts.Judge.fit(long, self.skeleton, self.fps)

    @cached_property
    def people(self) -> samples.People:
        """How people vary who do one thing again."""
        return samples.people(self.data, self.judge)

    def of(self, gait: str) -> Gait:
        return Gait(self, gait)

    def _training(self) -> list[Tensor]:
        each = zip(self.data.names, self.data.splits,
                   self.data.features.split(self.data.lengths.tolist()), strict=True)  # fmt: skip
        return [
            joints_of(self.data.encoding, clip)
            for name, split, clip in each
            if split == "train" and not name.endswith("_mirrored")
        ]


class Gait:
    """One gait: starts and clips of both splits, and the distances from its clips."""

    def __init__(self, real: Real, name: str) -> None:
        self.real, self.name, data = real, name, real.data
        self.begun: dict[str, Begun] = {}
        self.clips: dict[str, list[Tensor]] = {}  # joints of the whole clips that are begun in
        for split in ("test", "val"):
            self.begun[split], clips = beginnings(data, clips_of(data, name, split), real.starts)
            self.clips[split] = [joints_of(data.encoding, clip) for clip in clips]
        training = [
            joints_of(data.encoding, clip) for clip in clips_of(data, name, "train")
        ]  # fmt: skip
        poses = [self._pose(points) for points in training]
        self._normalizer = Normalizer.fit(poses)
        self._training = list(map(self._normalizer, poses))
        self.frechet = metrics.Frechet.fit(self.clips["test"], real.skeleton, real.fps)

    @property
    def actions(self) -> tuple[str, ...]:
        return GAITS[self.name]

    @property
    def came(self) -> Tensor:
        """Joints (starts, frames, joints, 3) that followed the test starts."""
        seen = frames_of(self.real.data, SEEN)
        return torch.stack(
            [clip[seen : seen + ahead(self.real.data)] for clip in self.clips["test"]]
        )

    def moments(self, points: Tensor) -> metrics.frechet.Moments:
        """What the Fréchet distance needs of one motion."""
        return self.frechet.moments(points, self.real.fps)

    def off_manifold(self, motions: list[Tensor]) -> list[float]:
        """Distance of each motion (frames, joints, 3) from the training clips of the gait."""
        poses = [self._normalizer(self._pose(points)) for points in motions]
        return metrics.manifold_distance(poses, self._training, self.real.fps).tolist()

    def _pose(self, points: Tensor) -> Tensor:
        """Joints in the heading frame (frames, 3 joints)."""
        return metrics.heading_frame(points, self.real.skeleton)[0].flatten(1).float()
