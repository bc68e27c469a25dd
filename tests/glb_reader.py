"""Reads binary glTF as its specification says, and does what a program that plays it does."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

DTYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    """A file's tree of objects, and what a program that plays it computes."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and length % 4 == 0
        self.tree = json.loads(data[20 : 20 + length])
        size, kind = struct.unpack_from("<I4s", data, 20 + length)
        assert kind == b"BIN\0" and size % 4 == 0
        self.binary = data[28 + length :]
        assert len(self.binary) == size == self.tree["buffers"][0]["byteLength"]

    def array(self, accessor: int) -> np.ndarray:
        accessor = self.tree["accessors"][accessor]
        view = self.tree["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        flat = np.frombuffer(
            self.binary,
            DTYPES[accessor["componentType"]],
            count=width * accessor["count"],
            offset=view["byteOffset"],
        )
        assert flat.nbytes == view["byteLength"]
        return flat.reshape(-1, width)

    def keys(self, path: str) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Times (keys,) and values (keys, width) of each node that the animation moves."""
        (animation,) = self.tree["animations"]
        found = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            assert sampler["interpolation"] == "LINEAR"
            if channel["target"]["path"] == path:
                values = self.array(sampler["output"])
                found[channel["target"]["node"]] = self.array(sampler["input"])[:, 0], values
        return found

    def worlds(self, frames: int | None = None) -> np.ndarray:
        """Matrices (frames, nodes, 4, 4) at the keys; (1, ...) in the pose of the nodes if None."""
        nodes = self.tree["nodes"]
        local = np.tile(np.eye(4), (frames or 1, len(nodes), 1, 1))
        for i, node in enumerate(nodes):
            local[:, i, :3, 3] = node.get("translation", (0, 0, 0))
            local[:, i, :3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
        if frames:
            for node, (_, turns) in self.keys("rotation").items():
                local[:, node, :3, :3] = Rotation.from_quat(turns).as_matrix()
            for node, (_, places) in self.keys("translation").items():
                local[:, node, :3, 3] = places
        world = np.full_like(local, np.nan)
        waiting = [(node, np.eye(4)) for node in self.tree["scenes"][0]["nodes"]]
        while waiting:
            node, above = waiting.pop()
            world[:, node] = above @ local[:, node]
            waiting += [(child, world[:, node]) for child in nodes[node].get("children", ())]
        return world

    def mesh(self) -> dict[str, np.ndarray]:
        (primitive,) = self.tree["meshes"][0]["primitives"]
        arrays = {name: self.array(i) for name, i in primitive["attributes"].items()}
        return arrays | {"triangles": self.array(primitive["indices"]).reshape(-1, 3)}

    def posed(self, frames: int | None = None) -> np.ndarray:
        """Vertices (frames, vertices, 3) as the skin's joints carry them."""
        (skin,), mesh = self.tree["skins"], self.mesh()
        inverse = self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        carry = self.worlds(frames)[:, skin["joints"]] @ inverse
        vertices = np.concatenate([mesh["POSITION"], np.ones((len(mesh["POSITION"]), 1))], axis=1)
        places = 0.0
        for joints, weights in zip(mesh["JOINTS_0"].T, mesh["WEIGHTS_0"].T, strict=True):
            places = places + weights[:, None] * (carry[:, joints] @ vertices[..., None])[..., 0]
        return places[..., :3]
