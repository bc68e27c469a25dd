"""From a BVH file to a Motion, step by step, and what is doubtful about it on the way."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pybvh
import torch
from pybvh.bvhnode import BvhNode

from ..errors import BvhError, SkeletonError
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_header import Layout, Tree
from .bvh_rate import rate_of
from .bvh_text import decode, last_line, opened, parse_rows, split
from .bvh_units import doubt_units, in_metres, is_positive
from .bvh_up import check_up, doubt_up, turn_up
from .euler import from_euler

# Bones are rigid here. Position channels of inner joints may wobble by this much, in metres.
RIGID = 0.001
# What to say to the reader of a file, by what it is about: "units", "up", "frames", ...
Doubts = dict[str, str]


@dataclass(frozen=True)
class Reading:
    """How files are read: the arguments of `read_bvh`, checked before any file is opened.

    Of a BVH file units None is "cm"; an Acclaim skeleton says its own.
    """

    units: str | float | None = None
    fps: float | None = None
    tpose_first: bool = False
    drop_zeros: bool = False
    up: str | None = None
    root: str | None = None
    rigid: str | None = None
    roles: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        if self.units is not None:
            in_metres(self.units)
        check_up(self.up)
        if self.fps is not None and not is_positive(self.fps):
            raise BvhError(f"fps={self.fps!r} is not a positive number of frames per second.")
        if self.rigid not in (None, "mean"):
            raise BvhError(
                f"rigid={self.rigid!r} is not known; use 'mean' for the mean offset of joints that "
                "slide, or leave it out."
            )


def read(path: str | os.PathLike, how: Reading, source: str = "") -> tuple[Motion, Doubts]:
    """The motion in a file, and what to warn of."""
    return parse(opened(path), Path(path), how, source)


def parse(data: bytes, where, how: Reading, source: str = "") -> tuple[Motion, Doubts]:
    """`read` for the bytes of a file; `where` is what errors call it."""
    text = decode(data, where)
    header, first_row = split(text, where)
    layout = Layout(header, where)
    tree = layout.tree(how.root)
    doubts: dict[str, str | None] = {}
    rate = how.fps
    if rate is None:
        rate, doubts["rate"] = rate_of(layout)
    nodes = _parse_tree(tree, where)
    values = parse_rows(text, first_row, layout.width, layout.frames, where)
    doubts["frames"] = _doubt_count(layout, len(values), text)
    doubts["scale"] = tree.doubt_scale(values)
    angles, shifts = tree.sort(values)
    skip = frames_to_skip(angles, how, where)
    units = "cm" if how.units is None else how.units
    metres = in_metres(units)
    body = _Body(nodes, tree, where, metres)
    shifts = {joint: shift[skip:] * metres for joint, shift in shifts.items()}
    motion = body.motion(angles[skip:], shifts, how.rigid == "mean", float(rate), source)
    motion = turn_up(_with_roles(motion, how, where), how.up)  # which asks where the trunk is
    doubts |= body.doubts
    doubts["units"] = doubt_units(motion.skeleton, units)
    doubts["up"] = doubt_up(motion) if how.up is None else None
    return motion, {about: said for about, said in doubts.items() if said}


def _with_roles(motion: Motion, how: Reading, where) -> Motion:
    if how.roles is None:
        return motion
    try:
        return replace(motion, skeleton=replace(motion.skeleton, roles=how.roles))
    except SkeletonError as error:
        raise BvhError(f"{where}: {error}") from error


def _doubt_count(layout: Layout, rows: int, text: str) -> str | None:
    declared = layout.frames
    if rows == declared == 0:
        layout.fail(layout.frames_line, "the clip has no frames", "export it with at least one")
    said = f"the header declares {declared} frames and the file holds {rows}"
    if rows == 0:
        remedy = "it is cut off or edited: copy it again, or correct 'Frames:'"
        layout.fail(last_line(text), said, remedy)
    if rows == declared:
        return None
    return f"{said}, all of which are read; if it was cut off or edited, copy it again."


def frames_to_skip(angles: np.ndarray, how: Reading, where) -> int:
    """How many frames to leave out at the beginning. angles : (frames, joints, 3)."""
    skip = int(how.tpose_first)
    if how.drop_zeros:
        moving = np.flatnonzero(angles[skip:].any((1, 2)))
        skip += int(moving[0]) if len(moving) else len(angles) - skip
    if skip >= len(angles):
        raise BvhError(
            f"{where}: nothing is left of {len(angles)} frames after leaving out the first {skip} "
            "(T-pose and zero frames); read it with tpose_first=False, drop_zeros=False."
        )
    return skip


def _parse_tree(tree: Tree, where) -> list[BvhNode]:
    """The hierarchy's nodes, read by pybvh from the prepared lines and one frame of zeros."""
    lines = [line for _, line in tree.lines]
    zeros = "0 " * (3 + 3 * len(tree.joints))
    lines += ["MOTION", "Frames: 1", "Frame Time: 1", zeros, ""]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "header.bvh"
        # pybvh opens files in the locale's encoding
        file.write_text("\n".join(lines), errors="backslashreplace")
        try:
            return pybvh.read_bvh_file(file, world_up="+y").nodes
        except Exception as error:  # pybvh raises whatever Python raised on a bad token
            message = str(error).replace(f" in file {file}", "")
            found = re.search(r"(.*?),? at line (\d+):? ?(.*)", message)
            what, line, why = found.groups() if found else (message[:200], "1", "")
            number = tree.lines[min(int(line), len(tree.lines)) - 1][0]
            raise BvhError(
                f"{where}, line {number}: {': '.join(filter(None, (what, why)))[:200]}; mend that "
                "part of the hierarchy, or export the file again."
            ) from error


class _Body:
    """Joints and end sites of a tree, in metres, and the motion that they make."""

    def __init__(self, nodes: list[BvhNode], tree: Tree, where, metres: float) -> None:
        self.tree, self.where = tree, where
        self.doubts: dict[str, str] = {}
        self.names = list(tree.joints)
        joints = [node for node in nodes if not node.is_end_site()]
        index = {id(node): i for i, node in enumerate(joints)}
        self.parents = [-1 if node.parent is None else index[id(node.parent)] for node in joints]
        self.orders = tree.orders
        self.offsets = np.array([node.offset for node in joints]) * metres
        # in the order of their joints, so that a clip written and read again keeps its points
        ends = [(index[id(node.parent)], node.offset) for node in nodes if node.is_end_site()]
        ends.sort(key=lambda end: end[0])
        self.end_parents = [parent for parent, _ in ends]
        self.end_offsets = np.array([offset for _, offset in ends]).reshape(-1, 3) * metres

    def motion(
        self, angles: np.ndarray, shifts: dict[int, np.ndarray], mean: bool, fps: float, source: str
    ) -> Motion:
        """angles : (frames, joints, 3) degrees; shifts : of some joints, (frames, 3) metres;
        mean : joints that slide get their mean offset."""
        rotations = from_euler(angles, self.orders)
        first, last, root, turn = self._fold(rotations, shifts)
        rotations = rotations[:, first:last]
        rotations[:, 0] = turn
        self._rigid_offsets(range(first + 1, last), shifts, mean)
        ends = [i for i, parent in enumerate(self.end_parents) if first <= parent < last]
        skeleton = Skeleton(
            tuple(self.names[first:last]),
            tuple(max(parent - first, -1) for parent in self.parents[first:last]),
            torch.from_numpy(self.offsets[first:last]),
            tuple(self.end_parents[i] - first for i in ends),
            torch.tensor(self.end_offsets[ends]),
            tuple(self.orders[first:last]),
        )
        return Motion(skeleton, root, rotations, fps, name=Path(self.where).stem, source=source)

    def _fold(self, rotations: np.ndarray, shifts: dict[int, np.ndarray]):
        """Fold a root that only carries the body, which is not where its OFFSET says, into it: the
        root's pose times the body's. (Compared with the OFFSET so that one frame tells, too.)

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

    def _rigid_offsets(self, joints: range, shifts: dict[int, np.ndarray], mean: bool) -> None:
        """Put joints with position channels where these say, if they keep to one place."""
        most, worst = RIGID, ""
        for joint in joints:
            if joint not in shifts:
                continue
            self.offsets[joint] = shifts[joint].mean(0)
            name = self.names[joint]
            wobble = np.linalg.norm(shifts[joint] - self.offsets[joint], axis=-1).max()
            if wobble > RIGID and not mean:
                raise BvhError(
                    f"{self.where}, line {self.tree.joints[name]}: joint {name!r} moves against "
                    f"its parent by up to {wobble * 100:.1f} cm; bones here are rigid: read the "
                    "file with rigid='mean', which takes the mean offset, or bake the motion to "
                    "rotations in the program it comes from."
                )
            if wobble > most:
                most, worst = wobble, name
        if worst:
            self.doubts["rigid"] = (
                f"joints slide against their parents, {worst!r} the most; they are put at their "
                f"mean offset, which moves it by up to {most * 1000:.1f} mm."
            )
