"""Motion below the header of another BVH file of its rig: joints, offsets and channels as they are there.

What a program knows by that file, such as a character that is bound to it, takes the motion as its own.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BvhError
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_header import Layout, Tree
from .bvh_reading import Reading, parse
from .bvh_text import decode, opened, split
from .euler import to_euler, unrolled

_STILL = 1e-4  # degrees; a joint that turns by less about an axis needs no channel for it
_Channel = tuple[str, int]  # "position" or "rotation", and axis 0 to 2


@dataclass(frozen=True)
class Header:
    """What stands in a BVH file before its rows, and the skeleton that it draws.

    Attributes
    ----------
    tree : the lines and channels of the file's body.
    skeleton : as it is read in the file's own axes, metres.
    """

    tree: Tree
    skeleton: Skeleton

    @classmethod
    def of(cls, path: str | os.PathLike, units: str | float, motion: Motion) -> Header:
        """The header of a file of the motion's rig; raises BvhError if it is of another."""
        data = opened(path)
        body = motion.skeleton
        layout = Layout(split(decode(data, path), path)[0], path)
        root = next((tree.root for tree in layout.trees if body.names[0] in tree.joints), None)
        how = Reading(units=units, up="y", rigid="mean", root=root)
        drawn = parse(data, path, how)[0].skeleton
        if (drawn.names, drawn.parents) != (body.names, body.parents):
            raise BvhError(
                f"{path}: is no file of the motion's rig: {drawn.difference(body)}; name one that is, "
                "or leave like= out."
            )
        return cls(layout.tree(root), replace(drawn, roles=body.roles))

    def text(self, motion: Motion, scale: float) -> str:
        """The file with the rows of another motion of `skeleton`, in the file's axes; scale : units in
        a metre."""
        root_positions, rotations = motion.numpy()
        angles = np.rad2deg(unrolled(to_euler(rotations, self.skeleton.rotation_orders)))
        channels = self._channels(angles)
        rows = np.empty((len(motion), sum(map(len, channels))))
        each = ((joint, *channel) for joint, listed in enumerate(channels) for channel in listed)
        for column, (joint, kind, axis) in enumerate(each):
            if kind == "rotation":
                rows[:, column] = self._angle(joint, axis, angles)
            elif joint == self._first:
                rows[:, column] = root_positions[:, axis].astype(np.float64) * scale
            else:
                rows[:, column] = self._shift(joint, axis, scale)
        rows += 0.0  # no -0.0
        lines = [" ".join(f"{value:.6f}" for value in row) for row in rows.tolist()]
        head = [*self._lines(channels), "MOTION", f"Frames: {len(motion)}"]
        return "\n".join([*head, f"Frame Time: {1 / motion.fps:.10g}", *lines, ""])

    @property
    def _first(self) -> int:
        """The file's number of the joint that is the skeleton's first; what carries it was folded."""
        return list(self.tree.joints).index(self.skeleton.names[0])

    def _channels(self, angles: np.ndarray) -> list[list[_Channel]]:
        """The channels of each joint of the file, and more where the motion needs them.

        angles : (frames, joints, 3) degrees of the skeleton's joints, in their orders.
        """
        found: list[list[_Channel]] = [[] for _ in self.tree.joints]
        for _, (joint, kind, axis) in self.tree.columns:
            if kind != "scale":
                found[joint].append((kind, axis))
        for joint in (*self._carriers(), self._first):
            lacking = [("position", axis) for axis in range(3)]
            found[joint][:0] = [each for each in lacking if each not in found[joint]]
        turning = np.abs(angles).max(0, initial=0) > _STILL
        for joint, order in enumerate(self.skeleton.rotation_orders, start=self._first):
            for place, letter in enumerate(order):
                each = ("rotation", "XYZ".index(letter))
                if each not in found[joint] and turning[joint - self._first, place]:
                    found[joint].append(each)
        return found

    def _carriers(self) -> list[int]:
        """The joints that the skeleton's first hangs on."""
        above, joint = [], -1
        for _, line in self.tree.lines:
            if line.startswith(("ROOT ", "JOINT ", "End ")):
                joint += line != "End Site"
                if joint == self._first:
                    break
                above.append(joint)
            elif line == "}":
                above.pop()
        return above

    def _angle(self, joint: int, axis: int, angles: np.ndarray) -> np.ndarray | float:
        """Degrees about an axis; what is no joint of the skeleton does not turn."""
        index = joint - self._first
        if not 0 <= index < self.skeleton.joints:
            return 0.0
        return angles[:, index, self.skeleton.rotation_orders[index].index("XYZ"[axis])]

    def _shift(self, joint: int, axis: int, scale: float) -> float:
        """Where a joint is that has positions and is not the skeleton's first: where it was read."""
        if joint in self._carriers():
            return 0.0
        index = joint - self._first
        if not 0 <= index < self.skeleton.joints:
            return self.tree.offsets[joint][axis]
        return float(self.skeleton.offsets[index, axis]) * scale

    def _lines(self, channels: list[list[_Channel]]) -> list[str]:
        """The lines of the hierarchy with these channels."""
        lines, depth = ["HIERARCHY"], 0
        left = iter(channels)
        for _, line in self.tree.lines:
            if line.startswith("CHANNELS"):
                listed = [f"{'XYZ'[axis]}{kind}" for kind, axis in next(left)]
                line = " ".join(["CHANNELS", str(len(listed)), *listed])
            depth -= line == "}"
            lines.append("\t" * depth + line)
            depth += line == "{"
        return lines
