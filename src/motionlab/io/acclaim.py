"""Acclaim's files in: a skeleton, ``.asf``, and its motions, ``.amc``, as CMU publishes them.

A joint of ours is the beginning of a bone and is called after it: ``lfemur`` is the left hip,
``lfoot`` the ankle. Where nothing hangs on a bone, its end is an end site.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from ..errors import AmcError, BvhError, SkeletonError
from ..motion import Motion
from ..skeleton import Skeleton
from .acclaim_frames import USUAL, AcclaimFrames, parse_frames
from .acclaim_skeleton import ROOT, AcclaimSkeleton, parse_skeleton
from .bvh_reading import Doubts, Reading, frames_to_skip
from .bvh_text import opened
from .bvh_units import doubt_units, in_metres
from .bvh_up import doubt_up, turn_up
from .euler import from_euler
from .first_pose import doubt_first
from .rigid import RIGID

_INCH = 0.0254
_NAMED = re.compile(rb"^#!OML:ASF[ \t]+(?:.*[\\/])?([^\\/\r\n]+?)[ \t]*\r?$", re.MULTILINE)


def read_amc(
    path: str | os.PathLike,
    skeleton: str | os.PathLike | None = None,
    *,
    fps: float | None = None,
    units: str | float | None = None,
    up: str | None = None,
    rigid: str | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    source: str = "",
    roles: Mapping[str, str] | None = None,
) -> Motion:
    """Read an Acclaim motion file and the skeleton that it moves.

    Parameters
    ----------
    path : the ``.amc`` file.
    skeleton : the ``.asf`` file. None finds it beside the motion: it has the same name up to a
        number, as ``05.asf`` for ``05_01.amc``, or is named in the motion's first line, or is alone.
    fps : frames per second, which hardly any file says. None takes 120, as most of CMU's have, and
        warns.
    units : the files' unit of length, as for `read_bvh`. None takes what the skeleton says: inches
        divided by its ``length``, which for CMU's is 5.6444 cm.
    up : the files' axis that points up, as for `read_bvh`.
    rigid : "mean" leaves out what stretches or shifts bones, and says how much that is; None
        refuses it if it is more than 1 mm.
    tpose_first, drop_zeros, source, roles : as for `read_bvh`.

    A bone's angles turn it about its own axes: with C of its ``axis`` and M of the motion, both
    about fixed axes in the order that ``axis`` says, its rotation against its parent is C M C⁻¹.
    The root's angles are about the world's axes, in the order that its ``order`` says.

    Returns
    -------
    Motion : metres, y up; joints called as the bones that begin there.

    Raises
    ------
    AmcError : a file is missing or can't be read; the message names file, line and remedy.
    """
    motion, doubts = read(
        path,
        _reading(
            fps=fps, units=units, up=up, rigid=rigid, tpose_first=tpose_first,
            drop_zeros=drop_zeros, roles=roles,
        ),
        source,
        skeleton,
    )  # fmt: skip
    _warn(path, doubts)
    return motion


def parse_amc(
    data: bytes, skeleton: bytes, where: str | os.PathLike, *, source: str = "", **reading
) -> Motion:
    """`read_amc` for the bytes of a motion and of a skeleton file; `where` is what errors call it."""
    parsed = parse_skeleton(skeleton, f"{where} (its .asf)")
    motion, doubts = _parse(data, parsed, where, _reading(**reading), source)
    _warn(where, doubts)
    return motion


def read(
    path: str | os.PathLike,
    how: Reading,
    source: str = "",
    skeleton: str | os.PathLike | None = None,
) -> tuple[Motion, Doubts]:
    """The motion in a file, and what to warn of."""
    data = opened(path, AmcError)
    said = {}
    if skeleton is None:
        skeleton, said = _skeleton_of(Path(path), data)
    parsed = parse_skeleton(opened(skeleton, AmcError), skeleton)
    motion, doubts = _parse(data, parsed, Path(path), how, source)
    return motion, said | doubts


def read_rest(path: str | os.PathLike, how: Reading) -> tuple[Motion, Doubts]:
    """A skeleton file by itself, as a motion of one frame at rest, and what to warn of."""
    skeleton = parse_skeleton(opened(path, AmcError), path)
    still = np.zeros((1, len(skeleton.bones), 3))
    root = np.array([skeleton.position], dtype=float)
    orders = ["ZYX"] * len(skeleton.bones)
    motion, doubts = _made(skeleton, (still, orders, root, USUAL), Path(path), how)
    return motion, skeleton.doubts | doubts


def _reading(**reading) -> Reading:
    try:
        return Reading(**reading)
    except BvhError as error:
        raise AmcError(str(error)) from error


def _warn(where: str | os.PathLike, doubts: Doubts) -> None:
    for said in doubts.values():
        warnings.warn(f"{where}: {said}", stacklevel=3)


def _skeleton_of(path: Path, data: bytes) -> tuple[Path, Doubts]:
    """The skeleton file beside a motion file, and what to say if it is there by chance."""
    if path.suffix.lower() == ".asf":
        raise AmcError(f"{path}: is a skeleton without motion; name the .amc file that moves it.")
    found = sorted(file for file in path.parent.iterdir() if file.suffix.lower() == ".asf")
    stem = path.stem.lower()
    # 05.asf, and not 0.asf, for 05_01.amc
    begins = [f for f in found if re.match(rf"{re.escape(f.stem.lower())}(?![0-9a-z])", stem)]
    if begins:
        return max(begins, key=lambda file: len(file.stem)), {}
    named = _NAMED.search(data[:1000])
    name = named[1].decode("latin-1").lower() if named else ""
    for file in found:
        if name in (file.name.lower(), file.stem.lower()):
            return file, {}
    if len(found) == 1:
        said = (
            f"it is read with {found[0].name}, the only .asf file beside it; if that is another "
            "body's, name its own as skeleton=."
        )
        return found[0], {"skeleton": said}
    there = f"of {len(found)} .asf files beside it none has its name" if found else "none is there"
    raise AmcError(
        f"{path}: a motion needs its skeleton file, and {there}; put {stem.partition('_')[0]}.asf "
        "beside it, or name it as skeleton=."
    )


def _parse(
    data: bytes, skeleton: AcclaimSkeleton, where, how: Reading, source: str
) -> tuple[Motion, Doubts]:
    frames = parse_frames(data, where, skeleton)
    doubts = {**skeleton.doubts, **frames.doubts}
    if how.fps is not None:
        doubts.pop("rate", None)
    angles, orders = _angles(skeleton, frames)
    try:
        skip = frames_to_skip(angles, how, where)
    except BvhError as error:
        raise AmcError(str(error)) from error
    doubts |= _doubt_rigid(skeleton, frames, _metres(skeleton, how), how, where)
    moves = (angles[skip:], orders, _root(skeleton, frames)[skip:], how.fps or frames.rate)
    motion, more = _made(skeleton, moves, where, how)
    return replace(motion, source=source), doubts | more


def _made(
    skeleton: AcclaimSkeleton,
    moves: tuple[np.ndarray, list[str], np.ndarray, float],
    where,
    how: Reading,
) -> tuple[Motion, Doubts]:
    """The motion of a skeleton, y up, and what to warn of.

    moves : angles and orders as `_angles` gives them, where the root is, and the rate.
    """
    if how.root is not None:
        raise AmcError(f"{where}: an .amc file holds one body; leave root={how.root!r} out.")
    metres = _metres(skeleton, how)
    try:
        body = _body(skeleton, metres, how.roles)
    except SkeletonError as error:
        raise AmcError(f"{where}: {error}") from error
    angles, orders, root, rate = moves
    motion = Motion(
        body, root * metres, _rotations(skeleton, angles, orders), float(rate),
        name=Path(where).stem,
    )  # fmt: skip
    motion = turn_up(motion, how.up)
    said = {"units": doubt_units(motion.skeleton, float(f"{metres:.6g}"))}
    said["up"] = doubt_up(motion, how.up)
    said["first"] = doubt_first(motion, how.tpose_first or how.drop_zeros)
    return motion, {about: text for about, text in said.items() if text}


def _metres(skeleton: AcclaimSkeleton, how: Reading) -> float:
    """Metres in the file's unit."""
    return _INCH / skeleton.length if how.units is None else in_metres(how.units)


def _angles(skeleton: AcclaimSkeleton, frames: AcclaimFrames) -> tuple[np.ndarray, list[str]]:
    """Angles (frames, bones, 3) in degrees, and in which order they are about which axes.

    What is applied first about fixed axes stands last: "ZYX" is Rz Ry Rx.
    """
    angles = np.zeros((frames.frames, len(skeleton.bones), 3))
    orders = []
    for joint, (name, bone) in enumerate(skeleton.bones.items()):
        turning = bone.applied(frames.dof[name])[::-1]
        for place, kind in enumerate(turning):
            if name in frames.values:
                column = frames.dof[name].index(kind)
                angles[:, joint, place] = frames.values[name][:, column]
        order = "".join(kind[1] for kind in turning)
        orders.append((order + "".join(axis for axis in "zyx" if axis not in order)).upper())
    return angles, orders


def _rotations(skeleton: AcclaimSkeleton, angles: np.ndarray, orders: list[str]) -> np.ndarray:
    """Rotations against the parent, (frames, bones, 3, 3)."""
    turns = skeleton.turns().astype(np.float64)
    rotations = turns @ from_euler(angles, orders)
    turns[0] = np.eye(3)  # the root's first pose is no turn of its axes
    return rotations @ turns.transpose(0, 2, 1)


def _root(skeleton: AcclaimSkeleton, frames: AcclaimFrames) -> np.ndarray:
    """Where the root is, (frames, 3), in the file's unit."""
    root = np.tile(skeleton.position, (frames.frames, 1))
    for column, kind in enumerate(frames.dof[ROOT]):
        if kind[0] == "t":
            root[:, "xyz".index(kind[1])] += frames.values[ROOT][:, column]
    return root


def _body(skeleton: AcclaimSkeleton, metres: float, roles: Mapping[str, str] | None) -> Skeleton:
    bones = list(skeleton.bones.values())
    vectors = np.array([bone.vector for bone in bones]) * metres
    # a bone begins where its parent ends
    offsets = np.array(
        [vectors[parent] if parent >= 0 else [0, 0, 0] for parent in skeleton.parents]
    )
    ends = [joint for joint in range(len(bones)) if joint not in skeleton.parents]
    return Skeleton(
        tuple(bone.name for bone in bones),
        tuple(skeleton.parents),
        torch.from_numpy(offsets),
        tuple(ends),
        torch.from_numpy(vectors[ends]),
        ("ZYX",) * len(bones),
        roles,
    )


def _doubt_rigid(
    skeleton: AcclaimSkeleton, frames: AcclaimFrames, metres: float, how: Reading, where
) -> Doubts:
    """What to say of bones that stretch or shift, which are left as the skeleton has them."""
    most, worst = RIGID, ""
    for name, values in frames.values.items():
        shifts = [i for i, kind in enumerate(frames.dof[name]) if kind[0] in "tl" and name != ROOT]
        shift = np.abs(values[:, shifts]).max(initial=0) * metres
        if shift > most:
            most, worst = shift, skeleton.bones[name].name
    if not worst:
        return {}
    said = f"bones stretch or shift by up to {most * 100:.1f} cm, {worst!r} the most"
    if how.rigid != "mean":
        raise AmcError(
            f"{where}: {said}; bones here are rigid: read the file with rigid='mean', which leaves "
            "that out, or bake the motion to rotations in the program it comes from."
        )
    return {"rigid": f"{said}; that is left out, and bones are as the .asf file has them."}
