"""What is in a glTF file: its tree of objects, which is JSON, and the numbers in its buffers.

What can be wrong with the file itself is found here. Whether its objects fit each other is asked
when they are used: `File.item` and `File.numbers` tell what is not there.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from pathlib import Path
from typing import NoReturn
from urllib.parse import unquote, urlsplit

import numpy as np

from ..errors import GltfError

# Codes that glTF took from OpenGL.
_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}  # of those that skeletons and animations need
LARGEST = 1e12  # no place or turn is larger; beyond 3e38 float32 overflows
_MOST = 100_000_000  # numbers in one array; more are a damaged file's
_AGAIN = "copy or export it again"


class File:
    """The objects of a file and the arrays in it.

    Parameters
    ----------
    data : the file's bytes, binary (.glb) or text (.gltf).
    where : what errors call it.
    folder : where its other files lie; None: nowhere.
    """

    def __init__(self, data: bytes, where, folder: Path | None = None) -> None:
        self.where, self.folder = where, folder
        self.tree, self._blob = self._parse(data)
        self._buffers: dict[int, bytes] = {}

    def fail(self, what: str, remedy: str = _AGAIN) -> NoReturn:
        raise GltfError(f"{self.where}: {what}; {remedy}.")

    def listed(self, value, name: str) -> list:
        """A list out of the tree, empty where there is none."""
        if value is not None and not isinstance(value, list):
            self.fail(f"{name} are {brief(value)}, no list")
        return value or []

    def item(self, kind: str, index) -> dict:
        """One of the tree's "nodes", "accessors" and so on, by its index."""
        items = self.listed(self.tree.get(kind), f"its {kind}")
        if not is_count(index) or index >= len(items):
            self.fail(f"names {kind[:-1]} {brief(index)} of {len(items)}, which is not there")
        return self.object(items[index], f"{kind[:-1]} {index}")

    def items(self, kind: str) -> list[dict]:
        """All of the tree's "nodes", "skins" and so on."""
        count = len(self.listed(self.tree.get(kind), f"its {kind}"))
        return [self.item(kind, i) for i in range(count)]

    def object(self, value, name: str) -> dict:
        """An object out of the tree."""
        if not isinstance(value, dict):
            self.fail(f"{name} is {brief(value)}, no object")
        return value

    def numbers(self, accessor: int, kind: str) -> np.ndarray:
        """The numbers of an accessor of a kind ("SCALAR", "VEC3", "VEC4"), (count, width) float64;
        integers that stand for fractions as the fractions."""
        about = self.item("accessors", accessor)
        name, width = f"accessor {accessor}", _WIDTHS[kind]
        if about.get("type") != kind:
            self.fail(f"{name} holds {brief(about.get('type'))} where {kind} must be")
        count, dtype = self._count(about.get("count"), name), self._dtype(about, name)
        if count * width > _MOST:
            self.fail(f"{name} declares {count} values")
        if "bufferView" in about:
            values = self._view(about, dtype, (count, width), name)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in about:
            sparse = self.object(about["sparse"], f"sparse {name}")
            values = self._replace_some(values, sparse, f"sparse {name}")
        if about.get("normalized") and dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(dtype).max, -1)
        return values.astype(np.float64)

    # -- arrays -----------------------------------------------------------------------------------

    def _view(self, place: dict, dtype: np.dtype, shape: tuple, name: str) -> np.ndarray:
        """Rows of numbers from a place in a part of a buffer; others may lie between the rows."""
        offset = self._count(place.get("byteOffset"), name)
        about = self.item("bufferViews", place.get("bufferView"))
        for extension in self.object(about.get("extensions", {}), f"extensions of {name}"):
            if "meshopt" in extension:
                self.fail(
                    f"its animation is compressed ({extension})",
                    "export it without, or unpack it: gltf-transform copy IN OUT",
                )
        row = shape[1] * dtype.itemsize
        stride = self._count(about.get("byteStride"), name) or row
        start, length = (
            self._count(about.get("byteOffset"), name),
            self._count(about.get("byteLength"), name),
        )
        buffer = self._buffer(about.get("buffer"))
        end = offset + (shape[0] - 1) * stride + row if shape[0] else 0
        if end > length or start + length > len(buffer) or stride < row:
            self.fail(f"{name} reaches beyond what is there")
        steps = (stride, dtype.itemsize)
        return np.ndarray(shape, dtype, buffer, start + offset, steps) if end else np.zeros(shape)

    def _replace_some(self, values: np.ndarray, sparse, name: str) -> np.ndarray:
        """Put the values where a sparse accessor has others than the rest."""
        rows, width = values.shape
        which, what = (self.object(sparse.get(part), name) for part in ("indices", "values"))
        count, dtype = self._count(sparse.get("count"), name), self._dtype(which, name)
        if count > rows:
            self.fail(f"{name} replaces {count} of {rows} values")
        index = self._view(which, dtype, (count, 1), name)[:, 0].astype(int)
        if count and not 0 <= index.min() <= index.max() < rows:
            self.fail(f"{name} replaces what is not there")
        values = values.copy()
        values[index] = self._view(what, values.dtype, (count, width), name)
        return values

    def _count(self, value, name: str) -> int:
        if value is None:
            return 0
        if not is_count(value):
            self.fail(f"{name} has {brief(value)} where a count must be")
        return value

    def _dtype(self, about: dict, name: str) -> np.dtype:
        code = about.get("componentType")
        if not is_count(code) or code not in _DTYPES:
            self.fail(f"{name} is of a type of number, {brief(code)}, that glTF does not have")
        return np.dtype(_DTYPES[code])

    # -- buffers ----------------------------------------------------------------------------------

    def _buffer(self, index) -> bytes:
        buffer = self.item("buffers", index)
        if index not in self._buffers:
            self._buffers[index] = self._fetch(index, buffer.get("uri"))
            declared = self._count(buffer.get("byteLength"), f"buffer {index}")
            if len(self._buffers[index]) < declared:
                self.fail(
                    f"buffer {index} holds {len(self._buffers[index])} of the {declared} bytes "
                    "that are declared"
                )
        return self._buffers[index]

    def _fetch(self, index: int, uri) -> bytes:
        if uri is None:
            if index != 0 or self._blob is None:
                self.fail(f"buffer {index} is not in the file")
            return self._blob
        if not isinstance(uri, str):
            self.fail(f"buffer {index} lies in {brief(uri)}, which is no name of a file")
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except (binascii.Error, ValueError) as error:
                raise GltfError(
                    f"{self.where}: buffer {index} is broken ({error}); {_AGAIN}."
                ) from error
        return self._beside(uri)

    def _beside(self, uri: str) -> bytes:
        """The bytes of another file in the same folder, or in one below it."""
        name = brief(uri)
        if urlsplit(uri).scheme:
            self.fail(f"its numbers lie at {name}", "save that beside it, and write its name there")
        if self.folder is None:
            self.fail(f"its numbers lie in another file, {name}", "export it as one .glb")
        folder = self.folder.resolve()
        try:
            file = (folder / unquote(uri)).resolve()
            if not file.is_relative_to(folder):
                self.fail(
                    f"its numbers lie in {name}, outside its folder, where nothing is read",
                    "put that file beside it, and write its name there",
                )
            return file.read_bytes()
        except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
            reason = getattr(error, "strerror", None) or error
            raise GltfError(
                f"{self.where}: its numbers lie in {name}, which can't be opened ({reason}); put "
                "that file beside it, or export it as one .glb."
            ) from error

    # -- the file ---------------------------------------------------------------------------------

    def _parse(self, data: bytes) -> tuple[dict, bytes | None]:
        """The tree of objects, and the numbers that a binary file has behind it."""
        text, blob = data, None
        if not data.strip():
            self.fail("the file is empty", "copy or download it again")
        if data[:4] == b"glTF":
            text, blob = self._chunks(data)
        elif data[:64].lstrip(b"\xef\xbb\xbf \t\r\n")[:1] != b"{":
            self.fail(f"begins with {data[:20]!r}, as no glTF file does", "export it as .glb")
        try:
            tree = self.object(json.loads(text.decode("utf-8-sig")), "its JSON")
        except (ValueError, RecursionError) as error:  # of UTF-8, of JSON, of braces without end
            raise GltfError(f"{self.where}: its JSON is broken ({error}); {_AGAIN}.") from error
        version = self.object(tree.get("asset"), "its asset").get("version")
        if not str(version).startswith("2."):
            self.fail(f"is glTF {brief(version)}", "export it as glTF 2.0")
        return tree, blob

    def _chunks(self, data: bytes) -> tuple[bytes, bytes | None]:
        """JSON and numbers of a binary file."""
        version, length = struct.unpack("<II", data[4:12].ljust(8, b"\xff"))
        if length > len(data):
            self.fail(f"holds {len(data)} of {length} bytes; it is cut off")
        if version != 2:
            self.fail(f"is binary glTF of version {version}", "export it as glTF 2.0")
        chunks, start = {}, 12
        while start + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, start)
            chunks.setdefault(kind, data[start + 8 : start + 8 + size])
            start += 8 + size
        if b"JSON" not in chunks:
            self.fail("has no part that is JSON")
        return chunks[b"JSON"], chunks.get(b"BIN\0")


def is_count(value) -> bool:
    """Whether it is a whole number and not negative, as indices are."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def brief(value) -> str:
    """A value out of a file, short enough for a message."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
