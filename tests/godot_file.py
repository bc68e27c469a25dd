"""Bytes of an animation as Godot 4 writes them, for what reads them."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

_KINDS = {bool: 2, int: 3, float: 4, str: 5, tuple: 22, np.ndarray: 33, type(None): 1}


def animation(tracks: Mapping[tuple[str, str], np.ndarray], *, other_files: int = 0) -> bytes:
    """tracks : by (bone, kind) as `parse_animation` gives them, (keys, 4) or (keys, 5)."""
    properties: dict[str, object] = {"resource_name": "made", "length": 1.0, "script": None}
    for i, ((bone, kind), keys) in enumerate(tracks.items()):
        keys = np.insert(np.asarray(keys, "<f4"), 1, 1.0, axis=1)
        track = {"type": kind, "imported": True, "path": ("Skeleton", bone), "interp": 1}
        track["keys"] = keys.astype("<f4").ravel()
        properties |= {f"tracks/{i}/{name}": value for name, value in track.items()}
    names = [*properties, "Skeleton", *{bone: 0 for bone, _ in tracks}]
    head = b"RSRC" + struct.pack("<5I", 0, 0, 4, 4, 6) + _text("Animation")
    head += struct.pack("<QIQ11I", 0, 3, 7, *[0] * 11)
    head += struct.pack("<I", len(names)) + b"".join(map(_text, names))
    head += struct.pack("<2I", other_files, 1) + _text("res://made.res")
    body = _text("Animation") + struct.pack("<I", len(properties))
    for name, value in properties.items():
        body += struct.pack("<I", names.index(name)) + _value(value, names)
    return head + struct.pack("<Q", len(head) + 8) + body + b"RSRC"


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text) + 1) + text.encode() + b"\0"


def _value(value: object, names: list[str]) -> bytes:
    kind = struct.pack("<I", _KINDS[type(value)])
    match value:
        case None:
            return kind
        case bool() | int():
            return kind + struct.pack("<i", value)
        case float():
            return kind + struct.pack("<f", value)
        case str():
            return kind + _text(value)
        case (node, bone):  # one of its names in the table, one inline
            inline = bone.encode() + b"\0"
            return (
                kind + struct.pack("<HHII", 1, 1, names.index(node), len(inline) | 1 << 31) + inline
            )
        case _:
            return kind + struct.pack("<I", len(value)) + value.tobytes()
