"""A file of motion, read by what its name ends in."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import MotionFileError
from ..motion import Motion
from . import acclaim, bvh_reading, gltf_reading
from .bvh_reading import Doubts, Reading

_READERS = {
    ".bvh": bvh_reading.read,
    ".amc": acclaim.read,
    ".glb": gltf_reading.read,
    ".gltf": gltf_reading.read,
}
SUFFIXES = tuple(_READERS)
_OTHERS = (
    ".fbx",
    ".c3d",
    ".dae",
    ".usd",
    ".usda",
    ".usdc",
    ".usdz",
    ".vmd",
    ".trc",
    ".npz",
    ".blend",
)
ENDINGS = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"  # in words


def is_motion(path: Path) -> bool:
    """Whether a file's name says that it is one of motion."""
    return path.suffix.lower() in _READERS


def is_bvh(path: str | os.PathLike) -> bool:
    """Whether a file is read as BVH."""
    ending = Path(path).suffix.lower()
    return ending != ".asf" and _READERS.get(ending, bvh_reading.read) is bvh_reading.read


def read_rig(path: str | os.PathLike, how: Reading) -> tuple[Motion, Doubts]:
    """`read_motion` of a file that stands for its rig, which an Acclaim skeleton does by itself: it
    is read as one frame, at rest. That its first frame is a pose apart is no fault of a rig."""
    if Path(path).suffix.lower() == ".asf":
        return acclaim.read_rest(path, how)
    motion, doubts = read_motion(path, how)
    return motion, {about: said for about, said in doubts.items() if about != "first"}


def read_motion(path: str | os.PathLike, how: Reading, source: str = "") -> tuple[Motion, Doubts]:
    """The motion in a file, and what to warn of; what ends in none of `SUFFIXES` is read as BVH, but
    for formats that are known to be other ones.

    Raises
    ------
    MotionFileError : the file can't be read; the message names file and remedy.
    """
    ending = Path(path).suffix.lower() if isinstance(path, str | os.PathLike) else ""
    if ending == ".asf":  # which is half a motion, as its reader says
        return acclaim.read(path, how, source)
    if ending in _OTHERS:
        raise MotionFileError(
            f"{path}: {ending} files are not read, but {ENDINGS} are. Blender opens most others: import "
            "it there and export glTF (.glb)."
        )
    return _READERS.get(ending, bvh_reading.read)(path, how, source)
