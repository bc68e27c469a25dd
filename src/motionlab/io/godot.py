"""Animations as Godot 4 stores them: binary resources (`RSRC`), uncompressed, little endian.

Only what an animation of bones needs: one resource, and the kinds of values that it holds. The
layout is that of Godot's `resource_format_binary.cpp`, version 4.
"""

from __future__ import annotations

import os
import struct

import numpy as np

from ..errors import GodotError

_MAGIC = b"RSRC"
_COLUMNS = {"position_3d": 5, "rotation_3d": 6, "scale_3d": 5}  # time, transition, then values
_INLINE = 1 << 31  # a string that is not in the file's table
_RESERVED = 11  # words


def parse_animation(data: bytes, where: str | os.PathLike) -> dict[tuple[str, str], np.ndarray]:
    """Keys of the tracks of one animation, from the bytes of a `.res` file.

    where : what errors call it.

    Returns
    -------
    by (bone, kind), the kind "position_3d", "rotation_3d" or "scale_3d": (keys, 4) or (keys, 5),
    seconds, then x, y, z or a quaternion x, y, z, w, by time. Keys may lie at any times, and each
    track has its own. Tracks without keys are left out.

    Raises
    ------
    GodotError : the bytes are not such a file, or are cut off.
    """
    if data[:4] == b"RSCC":
        raise GodotError(f"{where}: is compressed; save it from Godot without compression.")
    if data[:4] != _MAGIC:
        raise GodotError(f"{where}: is no binary resource of Godot: it does not begin with RSRC.")
    try:
        properties = _Resource(data).properties()
    except (struct.error, IndexError, OverflowError, ValueError) as error:
        raise GodotError(
            f"{where}: can't be read as an animation of Godot 4 ({error}); fetch it again."
        ) from error
    tracks = {}
    for name, kind in properties.items():
        if name.endswith("/type") and isinstance(kind, str) and kind in _COLUMNS:
            bone, keys = (properties.get(name.replace("/type", end)) for end in ("/path", "/keys"))
            keys = _keys(keys, kind)
            if keys is None or not isinstance(bone, str):
                raise GodotError(
                    f"{where}: the keys of {name.removesuffix('/type')} are damaged; fetch it again."
                )
            if len(keys):
                tracks[bone, kind] = keys
    return tracks


def _keys(values: object, kind: str) -> np.ndarray | None:
    """Keys (keys, 4 or 5) without their transitions; None if they make no sense."""
    columns = _COLUMNS[kind]
    if not isinstance(values, np.ndarray) or len(values) % columns:
        return None
    keys = np.delete(values.reshape(-1, columns), 1, axis=1)
    sound = np.isfinite(keys).all() and (np.diff(keys[:, 0]) > 0).all()
    if kind == "rotation_3d":
        sound = sound and keys[:, 1:].any(1).all()
    return keys if sound else None


class _Resource:
    """Reads values one after another; `at` is where the next one begins."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, len(_MAGIC)
        big, *_ = self.take("<5I")  # big endian, 64-bit reals, versions of engine and format
        if big:
            raise ValueError("big endian")
        self.text()  # what it is
        self.take(f"<QIQ{_RESERVED}I")
        self.strings = [self.text() for _ in range(self.number())]
        if self.number():
            raise ValueError("it refers to other files")
        places = [(self.text(), *self.take("<Q")) for _ in range(self.number())]
        self.at = places[-1][1]  # the last is what the file is for

    def properties(self) -> dict:
        self.text()  # its class
        return {self.name(): self.value() for _ in range(self.number())}

    def take(self, layout: str) -> tuple:
        values = struct.unpack_from(layout, self.data, self.at)
        self.at += struct.calcsize(layout)
        return values

    def number(self) -> int:
        return self.take("<I")[0]

    def text(self, size: int | None = None) -> str:
        (raw,) = self.take(f"<{self.number() if size is None else size}s")
        return raw.rstrip(b"\0").decode()

    def name(self) -> str:
        """A string by its place in the table, or inline."""
        index = self.number()
        return self.text(index - _INLINE) if index >= _INLINE else self.strings[index]

    def value(self):
        """A variant: what it is, then what it says."""
        kind = self.number()
        match kind:
            case 1:
                return None
            case 2 | 3:  # true or false, whole number
                return self.take("<i")[0]
            case 4:
                return self.take("<f")[0]
            case 5 | 44:
                return self.text()
            case 22:  # a path of nodes and, of the last node, what: here a bone of the skeleton
                nodes, parts = self.take("<HH")
                names = [self.name() for _ in range(nodes + (parts & 0x7FFF))]
                return names[-1]
            case 33:
                return np.array(self.take(f"<{self.number()}f"), np.float32)
        raise ValueError(f"a value of kind {kind}, which no such animation has, at byte {self.at}")
