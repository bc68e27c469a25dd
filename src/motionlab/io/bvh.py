"""BVH files in and out, on top of pybvh.

pybvh knows the format's syntax. This module adds what real files need besides: channels that move
inner joints, byte-order marks and old encodings, wrong frame rates, T-poses in front, and errors
that name file, line and remedy.
"""

from __future__ import annotations

import math
import os
import re
import tempfile
import warnings
from collections.abc import Sequence
from numbers import Real
from pathlib import Path

import numpy as np
import pybvh
import torch
from pybvh.bvhnode import BvhEndSite, BvhJoint, BvhNode, BvhRoot

from ..errors import BvhError
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_text import Layout, decode, parse_rows, split
from .euler import from_euler, to_euler

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# Bones are rigid here. Position channels of inner joints may wobble by this much, in metres.
RIGID = 0.001
# A person between a toddler and a giant; anything else is most likely a wrong unit.
HEIGHTS = (0.4, 3.0)


def read_bvh(
    path: str | os.PathLike,
    *,
    units: str | float = "cm",
    fps: float | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    source: str = "",
) -> Motion:
    """Read a BVH file.

    Parameters
    ----------
    path : the file.
    units : the file's unit of length, one of "m", "cm", "mm", "in", "ft", or metres per unit. BVH
        does not say, most exporters write centimetres.
    fps : frames per second, for a file whose own frame time is wrong.
    tpose_first : frame 0 is a T-pose for calibration; leave it out.
    drop_zeros : leave out leading frames in which every rotation is zero.
    source : kept as ``motion.source``.

    The root's position channels replace its OFFSET. A root that does nothing but carry one moving
    joint (``joint_Root`` above ``Hips``) is folded into that joint.

    Returns
    -------
    Motion : metres, frames per second, rotation orders and end sites as in the file.

    Raises
    ------
    BvhError : the file can't be read; the message names file, line and remedy.
    """
    if not isinstance(path, str | os.PathLike):
        raise BvhError(f"read_bvh: {path!r} is not a path; give the file to read.")
    path = Path(path)
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise BvhError(f"{path}: can't be opened ({reason}); check path and rights.") from error
    return parse_bvh(
        data,
        path,
        units=units,
        fps=fps,
        tpose_first=tpose_first,
        drop_zeros=drop_zeros,
        source=source,
    )


def parse_bvh(
    data: bytes,
    where: str | os.PathLike,
    *,
    units: str | float = "cm",
    fps: float | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    source: str = "",
) -> Motion:
    """`read_bvh` for the bytes of a file; `where` is what errors call it."""
    metres = _metres(units)
    text = decode(data, where)
    header, first_row = split(text, where)
    layout = Layout(header, where)
    rate = _rate(layout) if fps is None else _positive(fps, where)
    tree = _parse_tree(layout, where)
    values = parse_rows(text, first_row, len(layout.columns), layout.frames, where)
    angles, shifts = layout.sort(values)
    skip = int(tpose_first)
    if drop_zeros:
        moving = np.flatnonzero(angles[skip:].any((1, 2)))
        skip += int(moving[0]) if len(moving) else len(angles) - skip
    if skip >= len(values):
        raise BvhError(
            f"{where}: nothing is left of {len(values)} frames after leaving out the first {skip} "
            "(T-pose and zero frames); read it with tpose_first=False, drop_zeros=False."
        )
    shifts = {joint: shift[skip:] * metres for joint, shift in shifts.items()}
    motion = _assemble(tree, layout.joints, angles[skip:], shifts, metres, rate, where, source)
    _warn_of_units(motion, where, units)
    return motion


def write_bvh(
    motion: Motion, path: str | os.PathLike, *, units: str | float = "cm", overwrite: bool = True
) -> None:
    """Write a motion as BVH, Euler angles in the skeleton's own rotation orders.

    The file appears whole or not at all. Angles and lengths have six decimals.

    Raises
    ------
    BvhError : the motion has no frames, or the path can't be written.
    """
    if not isinstance(motion, Motion) or not isinstance(path, str | os.PathLike):
        raise BvhError(
            f"write_bvh: got {motion!r} and {path!r}; give the motion first, then the path, as in "
            "write_bvh(motion, 'walk.bvh')."
        )
    path = Path(path)
    scale = 1 / _metres(units)
    if len(motion) == 0:
        raise BvhError(f"{path}: the motion has no frames; there is nothing to write.")
    if path.suffix.lower() != ".bvh":
        raise BvhError(f"{path}: the name must end in .bvh, for example {path.stem}.bvh.")
    if path.exists() and not overwrite:
        raise BvhError(f"{path}: is there already; pass overwrite=True to replace it.")
    names = [re.sub(r"[\s{}]+", "_", name) for name in motion.skeleton.names]
    if len(set(names)) < len(names):
        raise BvhError(
            f"{path}: without blanks and braces, which BVH can't have in names, two joints have "
            "the same name; rename one of them."
        )
    order = _depth_first(motion.skeleton.parents)
    root_positions, rotations = motion.numpy()
    angles = to_euler(rotations, motion.skeleton.rotation_orders)
    clip = pybvh.Bvh(
        nodes=_nodes(motion.skeleton, order, scale),
        root_pos=root_positions.astype(np.float64) * scale,
        joint_angles=angles[:, order],
        frame_time=1 / motion.fps,
        world_up="+y",
    )
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".bvh-") as folder:
            whole = Path(folder) / "clip.bvh"
            pybvh.write_bvh_file(clip, whole)
            _restore_names(whole, names)
            os.replace(whole, path)
    except OSError as error:
        raise BvhError(
            f"{path}: can't be written ({error.strerror}); check folder and rights."
        ) from error
    except RecursionError as error:
        raise BvhError(
            f"{path}: joints are nested too deeply for pybvh to write; shorten the chain."
        ) from error


# -- reading ------------------------------------------------------------------------------------


def _metres(units: str | float) -> float:
    metres = UNITS.get(units) if isinstance(units, str) else units
    if not _is_positive(metres):
        raise BvhError(
            f"Unknown unit {units!r}; use one of {', '.join(UNITS)}, or metres per unit."
        )
    return float(metres)


def _positive(fps: float, where) -> float:
    if not _is_positive(fps):
        raise BvhError(f"{where}: fps={fps!r} is not a positive number of frames per second.")
    return float(fps)


def _is_positive(value) -> bool:
    try:
        return isinstance(value, Real) and math.isfinite(value) and value > 0
    except OverflowError:  # an integer beyond every float
        return False


def _rate(layout: Layout) -> float:
    """Frames per second. Most headers round their frame time to six or seven digits: a rate
    within 0.01 % of a whole number is that number."""
    rate = 1 / layout.frame_time()
    whole = round(rate)
    return float(whole) if abs(rate - whole) < 1e-4 * rate else round(rate, 6)


def _parse_tree(layout: Layout, where) -> list[BvhNode]:
    """The hierarchy's nodes, read by pybvh from the prepared header and one frame of zeros."""
    lines = [line for _, line in layout.hierarchy]
    zeros = "0 " * (3 + 3 * len(layout.joints))
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
            number = layout.hierarchy[min(int(line), len(layout.hierarchy)) - 1][0]
            raise BvhError(
                f"{where}, line {number}: {': '.join(filter(None, (what, why)))[:200]}; mend that "
                "part of the hierarchy, or export the file again."
            ) from error


def _assemble(
    nodes: list[BvhNode],
    lines: dict[str, int],
    angles: np.ndarray,
    shifts: dict[int, np.ndarray],
    metres: float,
    fps: float,
    where,
    source: str,
) -> Motion:
    """A motion from pybvh's nodes, angles in degrees and shifts in metres (see `Layout`)."""
    names = list(lines)
    joints = [node for node in nodes if not node.is_end_site()]
    index = {id(node): i for i, node in enumerate(joints)}
    parents = [-1 if node.parent is None else index[id(node.parent)] for node in joints]
    orders = ["".join(node.rot_channels) for node in joints]
    offsets = np.array([node.offset for node in joints]) * metres
    # in the order of their joints, so that a clip written and read again keeps its points
    ends = [(index[id(node.parent)], node.offset) for node in nodes if node.is_end_site()]
    ends.sort(key=lambda end: end[0])
    end_parents = [parent for parent, _ in ends]
    rotations = from_euler(angles, orders)
    root = shifts.get(0, np.tile(offsets[0], (len(angles), 1)))

    # A root that only carries one joint, which is not where its OFFSET says, is folded into it:
    # its pose times the joint's. (Compared with the OFFSET so that one frame tells, too.)
    children = np.bincount([parent + 1 for parent in parents + end_parents])
    first, turn = 0, rotations[:, 0].astype(np.float64)
    while (
        first + 1 < len(names)
        and children[first + 1] == 1
        and first + 1 in shifts
        and np.abs(shifts[first + 1] - offsets[first + 1]).max() > RIGID
    ):
        first += 1
        root = root + (turn @ shifts[first][..., None])[..., 0]
        turn = turn @ rotations[:, first]
    rotations = rotations[:, first:]
    rotations[:, 0] = turn

    for joint in range(first + 1, len(names)):
        if joint in shifts:
            offsets[joint] = shifts[joint].mean(0)
            wobble = np.linalg.norm(shifts[joint] - offsets[joint], axis=-1).max()
            if wobble > RIGID:
                raise BvhError(
                    f"{where}, line {lines[names[joint]]}: joint {names[joint]!r} moves against "
                    f"its parent by up to {wobble * 100:.1f} cm; bones here are rigid: bake the "
                    "motion to rotations in the program it comes from."
                )
    skeleton = Skeleton(
        tuple(names[first:]),
        tuple(max(parent - first, -1) for parent in parents[first:]),
        torch.from_numpy(offsets[first:]),
        tuple(parent - first for parent in end_parents),
        torch.tensor(np.array([offset for _, offset in ends]) * metres),
        tuple(orders[first:]),
    )
    return Motion(skeleton, root, rotations, fps, name=Path(where).stem, source=source)


# -- writing ------------------------------------------------------------------------------------


def _depth_first(parents: Sequence[int]) -> list[int]:
    """The joints in the order in which a BVH file nests them."""
    children: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(joint)
    order, waiting = [], [0]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    return order


def _nodes(skeleton: Skeleton, order: Sequence[int], scale: float) -> list[BvhNode]:
    """pybvh's nodes, joints in the given order. A node is called after its joint's index: pybvh
    writes in the locale's encoding, which may lack a name's letters. The root gets a zero offset:
    some programs add it to the position channels, others replace it."""
    ends: dict[int, list[list[float]]] = {}
    for parent, offset in zip(
        skeleton.end_parents, (skeleton.end_offsets.double() * scale).tolist(), strict=True
    ):
        ends.setdefault(parent, []).append(offset)
    offsets = (skeleton.offsets.double() * scale).tolist()
    nodes: dict[int, BvhJoint] = {}
    children: dict[int, list[BvhNode]] = {}
    for joint in order:
        parent, channels = skeleton.parents[joint], list(skeleton.rotation_orders[joint])
        if parent < 0:
            nodes[joint] = BvhRoot(f"joint{joint}", [0.0, 0.0, 0.0], list("XYZ"), channels)
        else:
            nodes[joint] = BvhJoint(f"joint{joint}", offsets[joint], channels, [], nodes[parent])
            children[parent].append(nodes[joint])
        children[joint] = [
            BvhEndSite("End Site", offset, nodes[joint]) for offset in ends.get(joint, ())
        ]
    for joint, node in nodes.items():
        node.children = children[joint]
    return list(nodes.values()) + [
        end for joint in order for end in children[joint] if end.is_end_site()
    ]


def _restore_names(file: Path, names: Sequence[str]) -> None:
    """Give the joints their names in a file that has been written with `_nodes`."""
    header, motion, rows = file.read_text(encoding="ascii").partition("MOTION\n")
    header = re.sub(
        r"(ROOT|JOINT) joint(\d+)", lambda found: f"{found[1]} {names[int(found[2])]}", header
    )
    file.write_text(header + motion + rows, encoding="utf-8")


def _warn_of_units(motion: Motion, where, units: str | float) -> None:
    """Warn if the body is not the size of a person."""
    roles, skeleton = motion.skeleton.roles, motion.skeleton
    if not {"head", "left_foot"} <= roles.keys():
        return
    height = 0.0
    for joint in (roles["head"], roles["left_foot"]):
        while skeleton.parents[joint] >= 0:
            height += float(skeleton.offsets[joint].norm())
            joint = skeleton.parents[joint]
    if not HEIGHTS[0] < height < HEIGHTS[1]:
        warnings.warn(
            f"{where}: from foot to head the body measures {height:.2f} m in units={units!r}; "
            "pass another unit if that is not a person.",
            stacklevel=4,
        )
