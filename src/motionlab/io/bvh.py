"""BVH files in and out, on top of pybvh.

pybvh knows the format's syntax. `read_bvh` adds what real files need besides: channels that move
inner joints, spellings that other programs read, byte-order marks and old encodings, wrong frame
rates, T-poses in front, other axes that point up, and errors that name file, line and remedy.
"""

from __future__ import annotations

import os
import re
import tempfile
import textwrap
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pybvh
import torch
from pybvh.bvhnode import BvhEndSite, BvhJoint, BvhNode, BvhRoot

from ..errors import BvhError
from ..kinematics import heading
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_like import Header
from .bvh_reading import Doubts, Reading, parse, read
from .bvh_units import in_metres
from .bvh_up import check_up, turn_back, turned_back, vertical
from .euler import to_euler, unrolled
from .free_names import safe_names
from .root_motion import Parts, check_kind, root_name
from .root_motion import split as split_root


def read_bvh(
    path: str | os.PathLike,
    *,
    units: str | float = "cm",
    up: str | None = None,
    fps: float | None = None,
    root: str | None = None,
    rigid: str | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    source: str = "",
    roles: Mapping[str, str] | None = None,
) -> Motion:
    """Read a BVH file.

    Parameters
    ----------
    path : the file.
    units : the file's unit of length, one of "m", "dm", "cm", "mm", "in", "ft", or metres per unit.
        BVH does not say, most exporters write centimetres.
    up : the file's axis that points up, one of "y", "-y", "z", "-z", "x", "-x". World and rest pose
        are turned so that y is up; of z-up, x, y, z become x, z, -y. None takes y. A trunk that is
        hardly ever upright then is warned of, unless "y" is said.
    fps : frames per second, for a file whose own frame time is wrong. One that was rounded, or cut off,
        to four to seven decimals is taken for the rate from 20 to 480 that it can mean (0.004166: 240),
        as it stands and with a warning if it can mean several (0.0042).
    root : the ROOT to read, by its name, of a file that holds several bodies.
    rigid : "mean" reads joints that slide against their parents, at their mean offset, and says how
        much that moves them; None refuses them if they slide by more than 1 mm.
    tpose_first : frame 0 is a T-pose for calibration; leave it out.
    drop_zeros : leave out leading frames in which every rotation is zero.
    source : kept as ``motion.source``.
    roles : joints by role, as ``{"left_foot": "LFoot"}``, where names are not understood or wrongly.

    The root's position channels replace its OFFSET. A root that does nothing but carry the body
    (``joint_Root`` above ``Hips``) is folded into it; what else hangs there, such as an engine's
    targets for hands and feet, is left out with a warning. Channels that a joint lacks are zero,
    positions its OFFSET, also if it lacks all of them; scale is left out. Rows are read as they are, with a warning if their
    number is not the one declared; one that is cut off in the middle is refused, as the file has
    lost its end then.

    Returns
    -------
    Motion : metres, y up, frames per second, rotation orders and end sites as in the file.

    Raises
    ------
    BvhError : the file can't be read; the message names file, line and remedy.
    """
    how = Reading(units, fps, tpose_first, drop_zeros, up, root, rigid, roles)
    motion, doubts = read(path, how, source)
    _warn(path, doubts)
    return motion


def parse_bvh(data: bytes, where: str | os.PathLike, *, source: str = "", **reading) -> Motion:
    """`read_bvh` for the bytes of a file; `where` is what errors call it."""
    motion, doubts = parse(data, where, Reading(**reading), source)
    _warn(where, doubts)
    return motion


def _warn(where: str | os.PathLike, doubts: Doubts) -> None:
    for said in doubts.values():
        warnings.warn(f"{where}: {said}", stacklevel=3)


def write_bvh(
    motion: Motion,
    path: str | os.PathLike,
    *,
    units: str | float = "cm",
    up: str | None = None,
    like: str | os.PathLike | None = None,
    overwrite: bool = True,
    root_motion: str | None = None,
    names: str = "kept",
) -> None:
    """Write a motion as BVH, Euler angles in the skeleton's own rotation orders.

    The file appears whole or not at all. Angles and lengths have six decimals.

    Parameters
    ----------
    units, up : of the file, as for `read_bvh`: with the same ones it is read as the same motion.
    like : a BVH file of the motion's rig, in these units and with this axis up: its joints, offsets and
        channels are kept to the letter, so that programs that know it take this one as its motion.
        Channels are added where the motion needs them; what is no joint of the motion, such as a
        root above the body, stands still.
    root_motion : "in-place" leaves way and heading out; "ground" puts them on a root joint on the
        floor, in whose frame the body moves, by position channels (`motionlab.io.root_motion`).
        `read_bvh` folds such a root into the body again.
    names : "kept", but for blanks and braces, which BVH can't have and which become _; or "safe", which
        leaves letters, digits, - and _ alone, and tells apart by a number what becomes alike. three.js
        takes : / [ ] in a name for marks of its own: such joints (mixamorig:Hips) stay still there.

    Raises
    ------
    BvhError : the motion has no frames, the path can't be written, `like` is of another rig, or comes
        with names="safe".
    MotionError : there is no such root motion.
    """
    if not isinstance(motion, Motion) or not isinstance(path, str | os.PathLike):
        raise BvhError(
            f"write_bvh: got {motion!r} and {path!r}; give the motion first, then the path, as in "
            "write_bvh(motion, 'walk.bvh')."
        )
    path = Path(path)
    scale = 1 / in_metres(units)
    if len(motion) == 0:
        raise BvhError(f"{path}: the motion has no frames; there is nothing to write.")
    if path.suffix.lower() != ".bvh":
        raise BvhError(f"{path}: the name must end in .bvh, for example {path.stem}.bvh.")
    if path.exists() and not overwrite:
        raise BvhError(f"{path}: is there already; pass overwrite=True to replace it.")
    if like is not None and names != "kept":
        raise BvhError(f"{path}: names can't be safe and as in {like}; leave names= or like= out.")
    words = file_names(motion.skeleton.names, names, path)
    check_kind(root_motion)
    check_up(up)
    parts = None if root_motion is None else split_root(motion)
    motion = motion if parts is None else parts.body
    header = None if like is None else Header.of(like, units, motion)
    motion = turn_back(motion, up, None if header is None else header.skeleton)
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".bvh-") as folder:
            whole = Path(folder) / "clip.bvh"
            if header is None:
                pybvh.write_bvh_file(_clip(motion, scale), whole)
                _restore_names(whole, words)
            else:
                whole.write_text(header.text(motion, scale), encoding="utf-8")
            if root_motion == "ground":
                _put_on_root(whole, root_name(words), parts, scale, up)
            os.replace(whole, path)
    except OSError as error:
        raise BvhError(
            f"{path}: can't be written ({error.strerror}); check folder and rights."
        ) from error
    except RecursionError as error:
        raise BvhError(
            f"{path}: joints are nested too deeply for pybvh to write; shorten the chain."
        ) from error


def file_names(names: Sequence[str], how: str, path: Path) -> list[str]:
    """Joints' names as a BVH file has them, how : "kept" or "safe"; raises BvhError if it can't."""
    if how not in ("kept", "safe"):
        raise BvhError(f"{path}: names={how!r} is not known; use 'kept' or 'safe'.")
    if how == "safe":
        return safe_names(names)
    words = [re.sub(r"[\s{}]+", "_", name) for name in names]
    if len(set(words)) < len(words):
        raise BvhError(
            f"{path}: without blanks and braces, which BVH can't have in names, two joints have "
            "the same name; rename one of them, or pass names='safe'."
        )
    return words


def _clip(motion: Motion, scale: float) -> pybvh.Bvh:
    """pybvh's clip; scale : units in a metre."""
    order = _depth_first(motion.skeleton.parents)
    root_positions, rotations = motion.numpy()
    angles = unrolled(to_euler(rotations, motion.skeleton.rotation_orders))
    return pybvh.Bvh(
        nodes=_nodes(motion.skeleton, order, scale),
        root_pos=root_positions.astype(np.float64) * scale,
        joint_angles=angles[:, order],
        frame_time=1 / motion.fps,
        world_up="+y",
    )


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


def _put_on_root(file: Path, name: str, parts: Parts, scale: float, up: str | None) -> None:
    """Hang the body of a file that has been written on a root joint that carries way and heading."""
    head, _, rows = file.read_text(encoding="utf-8").partition("MOTION\n")
    _, _, body = head.partition("ROOT ")
    axis, sign = vertical(up)
    turning = "XYZ"[axis] + "XYZ".replace("XYZ"[axis], "")
    channels = " ".join([*(f"{x}position" for x in "XYZ"), *(f"{x}rotation" for x in turning)])
    head = (
        f"HIERARCHY\nROOT {name}\n{{\n\tOFFSET 0.0 0.0 0.0\n\tCHANNELS 6 {channels}\n"
        + textwrap.indent(f"JOINT {body}", "\t")
        + "}\n"
    )
    way = turned_back(parts.way, up).double() * scale
    yaw = sign * torch.rad2deg(heading(parts.turn)).double()
    frames, time, *rows = rows.splitlines()
    moved = [
        f"{x:.6f} {y:.6f} {z:.6f} {angle:.6f} 0.000000 0.000000 {row}"
        for (x, y, z), angle, row in zip(way.tolist(), yaw.tolist(), rows, strict=True)
    ]
    text = "\n".join([f"{head}MOTION", frames, time, *moved, ""])
    file.write_text(text, encoding="utf-8")
