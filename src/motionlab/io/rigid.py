"""From a tree of joints that turn and also shift to a motion of rigid bones.

Files let every joint shift. Here the root alone does: what carries it is folded into it, the others
are put where they are, or on average are, against their parents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import torch

from ..errors import MotionLabError
from ..motion import Motion
from ..skeleton import Skeleton

# Joints may wobble against their parents by this much, in metres.
RIGID = 0.001


@dataclass
class Tree:
    """Joints and end sites, in the order in which a tree is walked: each joint's are right below it.

    Attributes
    ----------
    names, parents : of the joints, as a `Skeleton`'s.
    offsets : (joints, 3) metres, where the joints rest against their parents.
    end_parents, end_offsets : as a `Skeleton`'s.
    fault : makes the error that tells of a joint, by its name, and what is wrong with it.
    orders : as a `Skeleton`'s.
    doubts : what to warn of, by what it is about.
    """

    names: Sequence[str]
    parents: Sequence[int]
    offsets: np.ndarray
    end_parents: Sequence[int]
    end_offsets: np.ndarray
    fault: Callable[[str, str], MotionLabError]
    orders: Sequence[str] = ()
    doubts: dict[str, str] = field(default_factory=dict)

    def motion(
        self, rotations: np.ndarray, shifts: dict[int, np.ndarray], fps: float, *, mean: bool
    ) -> Motion:
        """The motion of rigid bones.

        rotations : (frames, joints, 3, 3), local, which are written over; shifts : where joints are
        against their parents, (frames, 3) metres, of those that may not be at their offsets; mean :
        joints that slide get their mean offset, else they are refused.
        """
        first, last, root, turn = self._fold(rotations, shifts)
        rotations = rotations[:, first:last]
        rotations[:, 0] = turn
        offsets = self._rigid_offsets(range(first + 1, last), shifts, mean)
        ends = [i for i, parent in enumerate(self.end_parents) if first <= parent < last]
        skeleton = Skeleton(
            tuple(self.names[first:last]),
            tuple(max(parent - first, -1) for parent in self.parents[first:last]),
            torch.from_numpy(offsets[first:last]),
            tuple(self.end_parents[i] - first for i in ends),
            torch.tensor(self.end_offsets[ends]),
            tuple(self.orders[first:last]),
        )
        return Motion(skeleton, root, rotations, fps)

    def _fold(self, rotations: np.ndarray, shifts: dict[int, np.ndarray]):
        """Fold a root that only carries the body, which is not where its offset says, into it: the
        root's pose times the body's. (Compared with the offset so that one frame tells, too.)

        Returns the range of joints that are left, and the first one's positions (frames, 3) and
        orientations (frames, 3, 3).
        """
        first, last = 0, len(self.names)
        root = shifts.get(0, np.tile(self.offsets[0], (len(rotations), 1)))
        turn = rotations[:, 0].astype(np.float64)
        while (body := self._carried(first, last, shifts)) is not None:
            left_out = [i for i in range(first + 1, last) if not body[0] <= i < body[1]]
            if left_out:
                names = ", ".join(self.names[i] for i in left_out)[:200]
                self.doubts["extra"] = (
                    f"the body hangs on {self.names[body[0]]!r}, which moves against "
                    f"{self.names[first]!r}; what else hangs there is left out: {names}."
                )
            first, last = body
            root = root + (turn @ shifts[first][..., None])[..., 0]
            turn = turn @ rotations[:, first]
        return first, last, root, turn

    def _moves(self, joint: int, shifts: dict[int, np.ndarray]) -> bool:
        return joint in shifts and np.abs(shifts[joint] - self.offsets[joint]).max() > RIGID

    def _carried(self, first: int, last: int, shifts: dict) -> tuple[int, int] | None:
        """The range of joints of a body that moves against the joint `first`, which carries it
        alone, or among others: then it is what has both legs and the head, as far as names tell."""
        children = [i for i in range(first + 1, last) if self.parents[i] == first]
        bodies = [body for body in pairwise([*children, last]) if self._moves(body[0], shifts)]
        if not bodies:
            return None
        if len(children) == 1 and first not in self.end_parents:
            return bodies[0]
        bare = torch.zeros(len(self.names), 3)
        roles = Skeleton(tuple(self.names), tuple(self.parents), bare).roles
        parts = ("left_upper_leg", "right_upper_leg", "head" if "head" in roles else "neck")
        for start, stop in bodies:
            if all(start < roles.get(part, -1) < stop for part in parts):
                return start, stop
        return None

    def _rigid_offsets(
        self, joints: range, shifts: dict[int, np.ndarray], mean: bool
    ) -> np.ndarray:
        """Offsets (joints, 3), of joints that shift where they are, if they keep to one place."""
        offsets = np.array(self.offsets, dtype=np.float64)
        most, worst = RIGID, ""
        for joint in joints:
            if joint not in shifts:
                continue
            offsets[joint] = shifts[joint].mean(0)
            name = self.names[joint]
            wobble = np.linalg.norm(shifts[joint] - offsets[joint], axis=-1).max()
            if wobble > RIGID and not mean:
                raise self.fault(
                    name,
                    f"joint {name!r} moves against its parent by up to {wobble * 100:.1f} cm; "
                    "bones here are rigid: read the file with rigid='mean', which takes the mean "
                    "offset, or bake the motion to rotations in the program it comes from.",
                )
            if wobble > most:
                most, worst = wobble, name
        if worst:
            self.doubts["rigid"] = (
                f"joints slide against their parents, {worst!r} the most; they are put at their "
                f"mean offset, which moves it by up to {most * 1000:.1f} mm."
            )
        return offsets
