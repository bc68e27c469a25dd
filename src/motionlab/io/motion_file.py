"""A file of motion, read by what its name ends in."""

from __future__ import annotations

import os
from pathlib import Path

from ..motion import Motion
from . import acclaim, bvh_reading
from .bvh_reading import Doubts, Reading

_READERS = {".bvh": bvh_reading.read, ".amc": acclaim.read}
SUFFIXES = tuple(_READERS)


def is_motion(path: Path) -> bool:
    """Whether a file's name says that it is one of motion."""
    return path.suffix.lower() in _READERS


def read_motion(path: str | os.PathLike, how: Reading, source: str = "") -> tuple[Motion, Doubts]:
    """The motion in a file, and what to warn of; what ends in none of `SUFFIXES` is read as BVH.

    Raises
    ------
    MotionFileError : the file can't be read; the message names file and remedy.
    """
    known = isinstance(path, str | os.PathLike) and Path(path).suffix.lower()
    return _READERS.get(known, bvh_reading.read)(path, how, source)
