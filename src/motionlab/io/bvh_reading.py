"""From a BVH file to a Motion, step by step, and what is doubtful about it on the way."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pybvh
from pybvh.bvhnode import BvhNode

from ..errors import BvhError, SkeletonError
from ..motion import Motion
from . import rigid
from .bvh_header import Layout, Tree
from .bvh_rate import rate_of
from .bvh_text import decode, last_line, opened, parse_rows, split
from .bvh_units import doubt_units, in_metres, is_positive
from .bvh_up import check_up, doubt_up, turn_up
from .euler import from_euler
from .first_pose import doubt_first

# What to say to the reader of a file, by what it is about: "units", "up", "frames", ...
Doubts = dict[str, str]


@dataclass(frozen=True)
class Reading:
    """How files are read: the arguments of `read_bvh` and of the other readers, checked before any
    file is opened.

    Of a BVH file units None is "cm", of glTF "m"; an Acclaim skeleton says its own. Files of other
    kinds than glTF hold one animation.
    """

    units: str | float | None = None
    fps: float | None = None
    tpose_first: bool = False
    drop_zeros: bool = False
    up: str | None = None
    root: str | None = None
    rigid: str | None = None
    roles: Mapping[str, str] | None = None
    animation: str | int | None = None

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
    if layout.width:
        values = parse_rows(text, first_row, layout.width, layout.frames, where)
    else:
        values = _blank_rows(layout, text, first_row)
    doubts["frames"] = _doubt_count(layout, len(values), text)
    doubts["scale"] = tree.doubt_scale(values)
    angles, shifts = tree.sort(values)
    skip = frames_to_skip(angles, how, where)
    units = "cm" if how.units is None else how.units
    metres = in_metres(units)
    body = _joints(nodes, tree, where, metres)
    shifts = {joint: shift[skip:] * metres for joint, shift in shifts.items()}
    rotations = from_euler(angles[skip:], body.orders)
    motion = body.motion(rotations, shifts, float(rate), mean=how.rigid == "mean")
    motion = replace(motion, name=Path(where).stem, source=source)
    motion = turn_up(_with_roles(motion, how, where), how.up)  # which asks where the trunk is
    doubts |= body.doubts
    doubts["units"] = doubt_units(motion.skeleton, units)
    doubts["up"] = doubt_up(motion, how.up)
    doubts["first"] = doubt_first(motion, how.tpose_first or how.drop_zeros)
    return motion, {about: said for about, said in doubts.items() if said}


def _with_roles(motion: Motion, how: Reading, where) -> Motion:
    if how.roles is None:
        return motion
    try:
        return replace(motion, skeleton=replace(motion.skeleton, roles=how.roles))
    except SkeletonError as error:
        raise BvhError(f"{where}: {error}") from error


def _blank_rows(layout: Layout, text: str, first_row: int) -> np.ndarray:
    """Rows (frames, 0) of a body that stands still, so that no joint has a channel: blank lines."""
    lines = text.count("\n") - layout.time[0] + 1
    if text[first_row:].strip() or layout.frames > lines:
        remedy = "export the file with its motion"
        layout.fail(layout.frames_line, "no joint has a channel", remedy)
    return np.zeros((layout.frames, 0))


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


def _joints(nodes: list[BvhNode], tree: Tree, where, metres: float) -> rigid.Tree:
    """Joints and end sites of a tree, in metres."""
    joints = [node for node in nodes if not node.is_end_site()]
    index = {id(node): i for i, node in enumerate(joints)}
    # in the order of their joints, so that a clip written and read again keeps its points
    ends = [(index[id(node.parent)], node.offset) for node in nodes if node.is_end_site()]
    ends.sort(key=lambda end: end[0])
    return rigid.Tree(
        list(tree.joints),
        [-1 if node.parent is None else index[id(node.parent)] for node in joints],
        np.array([node.offset for node in joints]) * metres,
        [parent for parent, _ in ends],
        np.array([offset for _, offset in ends]).reshape(-1, 3) * metres,
        lambda name, said: BvhError(f"{where}, line {tree.joints[name]}: {said}"),
        tree.orders,
    )
