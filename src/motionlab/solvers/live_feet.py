"""Behind a steered stream: a refiner, and feet held still, as the frames come."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from ..encodings import JointAngles
from ..feet.lock_stream import LockStream
from ..metrics import broken
from ..models import Refiner
from ..models.refiner_step import MOST
from ..motion import Motion
from .live_points import rotations_of


class Behind:
    """Frames of characters, corrected as they come.

    Parameters
    ----------
    encoding : of the features.
    fps : of them.
    frame : (batch, dim), raw units, the frame before the first, which stands at place (batch, 3).
    refiner : corrects them, or None. Its root stays within its reach of the one it is given. While
        `refines` is False it only listens.
    lock : hold toes still while they are in contact; gives frames `late` frames behind.
    """

    def __init__(
        self,
        encoding: JointAngles,
        frame: Tensor,
        place: Tensor,
        refiner: Refiner | None = None,
        lock: bool = False,
    ) -> None:
        self.encoding, self.refiner, self.refines = encoding, refiner, True
        self.state, self.place = None, place.double()
        self.known = broken.knows(encoding)
        self.before = frame if refiner is None else self._refined(frame[:, None])[:, 0]
        self._begin_locks(len(frame) if lock else 0)

    def _begin_locks(self, count: int) -> None:
        self.locks = [LockStream(self.encoding.skeleton, self.encoding.fps) for _ in range(count)]
        self.waiting = [torch.zeros(0, 4, dtype=torch.bool) for _ in range(count)]
        self.late = self.locks[0].ahead if count else 0

    @torch.no_grad()
    def go_on(self, frames: Tensor) -> list[Motion]:
        """Of each character, what is done: frames (batch, n, dim) in raw units, or those before them."""
        encoding = self.encoding
        refined = frames if self.refiner is None else self._refined(frames)
        frames = refined if self.refines else frames
        rows = torch.cat([self.before[:, None], frames], 1)
        with np.errstate(all="ignore"):  # as torch: who leaves all bounds is told by the numbers
            roots, rotations = rotations_of(encoding, rows, self.place)
        contacts = self._contacts(frames)
        made = [
            Motion(encoding.skeleton, root[1:], turns[1:], encoding.fps, contacts=down)
            for root, turns, down in zip(roots, rotations, contacts, strict=True)
        ]
        yaw = self.place[:, 2] + frames[..., 2].double().sum(1)
        self.place = torch.stack([roots[:, -1, 0].double(), roots[:, -1, 2].double(), yaw], 1)
        self.before = frames[:, -1]
        return [self._locked(i, motion) for i, motion in enumerate(made)] if self.locks else made

    def finish(self) -> list[Motion | None]:
        """The frames that wait for what comes next, at the end; None where there are none."""
        return [self._done(i, *lock.finish()) for i, lock in enumerate(self.locks)]

    def hold(self, lock: bool) -> list[Motion | None]:
        """From the next frames on feet are held, or no longer; the frames that waited, as of `finish`."""
        if lock == bool(self.locks):
            return [None] * len(self.before)
        left = self.finish() if self.locks else [None] * len(self.before)
        self._begin_locks(len(self.before) if lock else 0)
        return left

    def _refined(self, frames: Tensor) -> Tensor:
        found = []
        for some in frames.split(MOST, 1):  # more at a time go another, slower way
            refined, self.state = self.refiner.refine(some, self.state)
            found.append(refined)
        features = torch.cat(found, 1)
        return broken.within(self.encoding, features) if self.known else features

    def _contacts(self, frames: Tensor) -> Sequence[Tensor | None]:
        """Of each character, as a Motion has them: heels, which no row knows of, are False."""
        toes = self.encoding.contacts(frames)
        if toes is None:
            return [None] * len(frames)
        contacts = torch.zeros(*frames.shape[:2], 4, dtype=torch.bool)
        contacts[..., [1, 3]] = toes > 0.5
        return contacts

    def _locked(self, i: int, motion: Motion) -> Motion | None:
        self.waiting[i] = torch.cat([self.waiting[i], motion.contacts])
        self.shape = motion
        return self._done(
            i, *self.locks[i].push(motion.root_positions, motion.rotations, motion.contacts)
        )

    def _done(self, i: int, root: Tensor, rotations: Tensor) -> Motion | None:
        if not len(root):
            return None
        contacts, self.waiting[i] = self.waiting[i].split(
            [len(root), len(self.waiting[i]) - len(root)]
        )
        return replace(self.shape, root_positions=root, rotations=rotations, contacts=contacts)
