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
_BLENDER = "Blender opens most others: import it there and export glTF (.glb)."
_USD = (
    f"What motionlab writes as USD it does not read back: keep the clip it was made of. {_BLENDER}"
)
_OTHERS = {
    **dict.fromkeys((".fbx", ".c3d", ".dae", ".vmd", ".trc", ".npz", ".blend"), _BLENDER),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), _USD),
    **dict.fromkeys((".zip", ".7z", ".rar", ".tar", ".gz"), "Unpack it, and name the folder."),
    ".xml": "Models of MuJoCo are written, but not read back: keep the clip it was made of.",
}  # what to do with a file of a format that is known not to be read
_BEGINNING = 4096  # bytes, in which a BVH file says HIERARCHY, comments before it and all
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
    """The motion in a file, and what to warn of; what ends in none of `SUFFIXES` is read as BVH if it
    begins so.

    Raises
    ------
    MotionFileError : the file can't be read; the message names file and remedy.
    """
    ending = Path(path).suffix.lower() if isinstance(path, str | os.PathLike) else ""
    if ending == ".asf":  # which is half a motion, as its reader says
        return acclaim.read(path, how, source)
    if ending in _OTHERS or (ending and ending not in _READERS and not _begins_as_bvh(path)):
        said = f"{path}: {ending} files are not read, but {ENDINGS} are."
        raise MotionFileError(" ".join([said, *filter(None, [_OTHERS.get(ending)])]))
    return _READERS.get(ending, bvh_reading.read)(path, how, source)


def _begins_as_bvh(path: str | os.PathLike) -> bool:
    """Whether a file with a strange ending is BVH all the same, or can't be opened, as its reader says."""
    try:
        with open(path, "rb") as file:
            beginning = file.read(_BEGINNING)
    except (OSError, ValueError):
        return True
    return b"HIERARCHY" in beginning.replace(b"\0", b"").upper()  # UTF-16, too
