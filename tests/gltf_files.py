"""glTF files for tests, as other programs write them, and where their nodes are by the format's own
words: matrices multiplied from the top down, quaternions by the formula of its appendix C."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path

import numpy as np
import roma
import torch
from scipy.spatial.transform import Rotation

from motionlab import Motion

DTYPES = {"i1": 5120, "u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126}
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """A file in the making: `json`, to be changed at will, and the bytes of its buffer."""

    def __init__(self, nodes: list[dict]) -> None:
        self.json: dict = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "nodes": nodes,
            "bufferViews": [],
            "accessors": [],
        }
        children = {child for node in nodes for child in node.get("children", ())}
        self.json["scenes"] = [{"nodes": [i for i in range(len(nodes)) if i not in children]}]
        self.buffer = bytearray()

    def add(self, values, dtype: str = "<f4", *, stride: int = 0, **about) -> int:
        """An accessor of these values, rows `stride` bytes apart if that is not 0."""
        values = np.asarray(values, np.float64)
        values = values.reshape(len(values), -1)
        if about.get("normalized"):
            values = (values * np.iinfo(dtype).max).round()
        rows = values.astype(dtype)
        bytes_ = b"".join(row.tobytes().ljust(stride, b"\xff") for row in rows)
        view = self.view(bytes_, **({"byteStride": stride} if stride else {}))
        about |= {"bufferView": view, "componentType": DTYPES[dtype], "count": len(rows)}
        bounds = {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        self.json["accessors"].append({"type": TYPES[rows.shape[1]], **bounds, **about})
        return len(self.json["accessors"]) - 1

    def view(self, bytes_: bytes, **about) -> int:
        self.buffer += bytes(-len(self.buffer) % 4)
        about |= {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(bytes_)}
        self.json["bufferViews"].append(about)
        self.buffer += bytes_
        return len(self.json["bufferViews"]) - 1

    def animate(self, moves: dict, name: str | None = None, **how) -> None:
        """An animation; moves : by (node, path) times, values, and "LINEAR" or another way."""
        samplers = [
            {"input": self.add(times), "output": self.add(values, **how), "interpolation": way}
            for times, values, way in moves.values()
        ]
        channels = [
            {"sampler": i, "target": {"node": node, "path": path}}
            for i, (node, path) in enumerate(moves)
        ]
        named = {} if name is None else {"name": name}
        self.json.setdefault("animations", []).append(
            {"channels": channels, "samplers": samplers, **named}
        )

    def glb(self) -> bytes:
        self.json["buffers"] = [{"byteLength": len(self.buffer)}]
        text = json.dumps(self.json).encode()
        parts = ((b"JSON", text + b" " * (-len(text) % 4)),
                 (b"BIN\0", bytes(self.buffer) + bytes(-len(self.buffer) % 4)))  # fmt: skip
        body = b"".join(struct.pack("<I4s", len(part), kind) + part for kind, part in parts)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def gltf(self, uri: str | None = None, kind: str = "application/octet-stream") -> bytes:
        """The text of a file; its numbers are in it, unless `uri` says where they are."""
        inside = f"data:{kind};base64,{base64.b64encode(self.buffer).decode()}"
        self.json["buffers"] = [{"byteLength": len(self.buffer), "uri": uri or inside}]
        return json.dumps(self.json).encode()

    def save(self, path: Path) -> Path:
        path.write_bytes(self.glb())
        return path


def skin(gltf: Gltf, joints: list[int], where: np.ndarray) -> None:
    """A mesh of one triangle that hangs on joints, whose matrices in the bind pose are `where`."""
    matrices = np.linalg.inv(where).swapaxes(1, 2)
    ones = {"POSITION": np.eye(3), "WEIGHTS_0": np.eye(4)[[0, 0, 0]]}
    attributes = {name: gltf.add(values) for name, values in ones.items()}
    attributes["JOINTS_0"] = gltf.add(np.zeros((3, 4)), "<u2")
    gltf.json.setdefault("meshes", []).append({"primitives": [{"attributes": attributes}]})
    gltf.json.setdefault("skins", []).append(
        {"joints": joints, "inverseBindMatrices": gltf.add(matrices)}
    )
    skins = len(gltf.json["skins"]) - 1
    gltf.json["scenes"][0]["nodes"].append(len(gltf.json["nodes"]))
    gltf.json["nodes"].append({"mesh": len(gltf.json["meshes"]) - 1, "skin": skins})


MIXAMO = {
    "Hips": "Hips", "Spine": "Spine", "Chest": "Spine2", "Neck": "Neck", "Head": "Head",
    "Shoulder": "Shoulder", "UpperArm": "Arm", "LowerArm": "ForeArm", "Hand": "Hand",
    "UpperLeg": "UpLeg", "LowerLeg": "Leg", "Foot": "Foot", "Toes": "ToeBase",
}  # fmt: skip


def mixamo(motion: Motion, *, turn: float = -90, scale: float = 0.01) -> Gltf:
    """A canonical body as a character in Mixamo's manner: an armature turned and scaled above it,
    its bones in centimetres with axes of their own, names with a prefix, a skin, a mesh beside, a
    sword in a hand, and keys at every frame."""
    skeleton = motion.skeleton
    axes = roma.random_rotmat(skeleton.joints, generator=torch.Generator().manual_seed(2))
    above = torch.stack([axes[p] if p >= 0 else torch.eye(3) for p in skeleton.parents])
    turned = lambda offsets, by: ((by.mT @ offsets[..., None])[..., 0] / scale).double().numpy()
    offsets = turned(skeleton.offsets, above)
    ends = turned(skeleton.end_offsets, axes[list(skeleton.end_parents)])
    armature = Rotation.from_euler("X", turn, degrees=True)
    turns = (above.mT @ motion.rotations @ axes).double().numpy()
    turns[:, 0] = armature.inv().as_matrix() @ turns[:, 0]
    places = armature.inv().apply(motion.root_positions.double().numpy()) / scale
    nodes: list[dict] = [
        {"name": "Armature", "scale": [scale] * 3, "rotation": armature.as_quat().tolist()}
    ]
    quats = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(*turns.shape[:2], 4)
    quats[1:] *= np.where((quats[1:] * quats[:-1]).sum(-1) < 0, -1, 1).cumprod(0)[..., None]
    for joint, name in enumerate(skeleton.names):
        side = next((side for side in ("Left", "Right") if name.startswith(side)), "")
        nodes.append(
            {
                "name": f"mixamorig:{side}{MIXAMO[name.removeprefix(side)]}",
                "translation": (offsets[joint] if joint else places[0]).tolist(),
                "rotation": quats[0, joint].tolist(),
            }
        )
    for parent, offset in zip(skeleton.end_parents, ends, strict=True):
        nodes.append({"name": f"{nodes[parent + 1]['name']}_End", "translation": offset.tolist()})
    nodes.append({"name": "Sword", "mesh": 1})
    parents = [-1, *(p + 1 for p in skeleton.point_parents), skeleton.index("RightHand") + 1]
    for node, parent in enumerate(parents):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(node)
    gltf = Gltf(nodes)
    times = np.arange(len(motion)) / motion.fps
    moves = {(1, "translation"): (times, places, "LINEAR")}
    for joint in range(skeleton.joints):
        moves[joint + 1, "rotation"] = times, quats[:, joint], "LINEAR"
    gltf.animate(moves, "mixamo.com")
    joints = list(range(1, 1 + skeleton.joints))
    skin(gltf, joints, worlds(gltf, [0.0])[0, joints])
    blade = {"attributes": {"POSITION": gltf.add(np.eye(3))}}
    gltf.json["meshes"].append({"primitives": [blade]})
    return gltf


# -- the oracle -----------------------------------------------------------------------------------


def worlds(gltf: Gltf, times, animation: int | None = None) -> np.ndarray:
    """Matrices (times, nodes, 4, 4) at these times, of an animation, or as the nodes stand."""
    nodes = gltf.json["nodes"]
    parents = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    found = np.empty((len(times), len(nodes), 4, 4))
    for frame, time in enumerate(times):
        moved = {} if animation is None else values(gltf, time, animation)
        local = [matrix(node | moved.get(i, {})) for i, node in enumerate(nodes)]
        for i in range(len(nodes)):
            found[frame, i], above = local[i], i
            while (above := parents.get(above, -1)) >= 0:
                found[frame, i] = local[above] @ found[frame, i]
    return found


def matrix(node: dict) -> np.ndarray:
    if "matrix" in node:
        return np.reshape(node["matrix"], (4, 4)).T
    shift, turn, size = np.eye(4), np.eye(4), np.eye(4)
    shift[:3, 3] = node.get("translation", (0, 0, 0))
    turn[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
    size[:3, :3] = np.diag(node.get("scale", (1, 1, 1)))
    return shift @ turn @ size


def values(gltf: Gltf, time: float, animation: int) -> dict[int, dict]:
    """What an animation makes of nodes at a time."""
    found: dict[int, dict] = {}
    about = gltf.json["animations"][animation]
    for channel in about["channels"]:
        sampler, target = about["samplers"][channel["sampler"]], channel["target"]
        keys, out = plain(gltf, sampler["input"])[:, 0], plain(gltf, sampler["output"])
        found.setdefault(target["node"], {})[target["path"]] = between(
            keys, out, sampler["interpolation"], time
        )
    return found


def between(keys: np.ndarray, out: np.ndarray, way: str, time: float) -> np.ndarray:
    if way == "CUBICSPLINE":
        out = out.reshape(len(keys), 3, -1)
    flat = out[:, 1] if way == "CUBICSPLINE" else out
    if time <= keys[0]:
        return flat[0]
    if time >= keys[-1]:
        return flat[-1]
    k = int(np.nonzero(keys <= time)[0][-1])
    span = keys[k + 1] - keys[k]
    t = (time - keys[k]) / span
    a, b = flat[k], flat[k + 1]
    if way == "STEP":
        return a
    if way == "CUBICSPLINE":
        basis = (2 * t**3 - 3 * t**2 + 1, span * (t**3 - 2 * t**2 + t),
                 -2 * t**3 + 3 * t**2, span * (t**3 - t**2))  # fmt: skip
        return basis[0] * a + basis[1] * out[k, 2] + basis[2] * b + basis[3] * out[k + 1, 0]
    if len(a) < 4:
        return (1 - t) * a + t * b
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    cosine = a @ b
    angle = np.arccos(min(abs(cosine), 1))
    if angle < 1e-6:
        return a
    return (np.sin((1 - t) * angle) * a + np.sign(cosine) * np.sin(t * angle) * b) / np.sin(angle)


def plain(gltf: Gltf, accessor: int) -> np.ndarray:
    """The numbers of an accessor as `Gltf.add` lays them down."""
    about = gltf.json["accessors"][accessor]
    view = gltf.json["bufferViews"][about["bufferView"]]
    dtype = next(np.dtype(name) for name, code in DTYPES.items() if code == about["componentType"])
    width = next(width for width, kind in TYPES.items() if kind == about["type"])
    stride = view.get("byteStride", width * dtype.itemsize)
    rows = [
        np.frombuffer(gltf.buffer, dtype, width, view["byteOffset"] + i * stride)
        for i in range(about["count"])
    ]
    return np.array(rows, float) / (np.iinfo(dtype).max if about.get("normalized") else 1)
