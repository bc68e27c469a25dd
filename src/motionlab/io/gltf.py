"""Motion as glTF 2.0, from and for Blender, game engines, three.js and the viewers of many systems.

The ``.glb`` file that is written holds the skeleton, the animation, and a mannequin that the joints
carry, so that there is something to see. End sites are joints of the skin, too, those of hands and
toes with the tip to carry: the format has none, and a node that carries nothing is cleared away. Read is the skeleton of
any file that has a skin or an animation. glTF's world is ours: metres, seconds, y up, z ahead,
right-handed. The format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
"""

from __future__ import annotations

import json
import os
import struct
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import roma
import torch
from torch import Tensor

from ..errors import BvhError, GltfError
from ..motion import Motion
from ..version import __version__
from .bvh_reading import Reading
from .free_names import free_name
from .gltf_mesh import Skin, bind_pose, mannequin
from .gltf_reading import read
from .root_motion import Parts, check_kind, root_name, split
from .whole_file import put_whole

# Codes that glTF took from OpenGL.
_COMPONENT = {"<f4": 5126, "<u2": 5123, "<u4": 5125}
_WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_VERTICES, _TRIANGLES = {"target": 34962}, {"target": 34963}
_ROUGHNESS = 0.55  # as in the player


def read_gltf(
    path: str | os.PathLike,
    *,
    animation: str | int | None = None,
    units: str | float = "m",
    up: str | None = None,
    fps: float | None = None,
    root: str | None = None,
    rigid: str | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    source: str = "",
    roles: Mapping[str, str] | None = None,
) -> Motion:
    """Read the skeleton and an animation of a glTF file, ``.glb`` or ``.gltf``.

    Parameters
    ----------
    path : the file. Others that a ``.gltf`` names must lie in its folder, or below it.
    animation : the one to read, by name or number from 0; needed where several move the body.
    units, up : as of `read_bvh`, for files that are not in metres with y up, as glTF asks for.
    fps : frames per second of the motion. None takes the rate at which the keys come, 5 if they do
        evenly. It takes 30, with a warning, where they come at none, and where they are poses:
        fewer than 10 a second, joined by curves or not even 10 in all.
    root : the node to begin with, by its name, of a file that holds several bodies.
    rigid : "mean" reads joints that slide against their parents, or are moved by a scale that
        changes, at their mean offset, and says how much that moves them; None refuses them if they
        slide by more than 1 mm.
    tpose_first, source, roles : as of `read_bvh`.
    drop_zeros : leave out leading frames in which every joint is turned as at rest.

    Joints are the nodes that carry a skin, what the animation moves below them, and what lies
    between; without skin, the nodes that the animation moves and those between and below them. What
    hangs on them with nothing to see becomes an end site, and so does a last joint that is called
    after the one it hangs on, as HeadEnd on Head. What is above, such as an armature's
    scale and quarter turn, goes into the joints' places. Offsets and rotations are the nodes' own,
    as bones are drawn there: the rest pose, all rotations zero, need not be a person's. A root that
    does nothing but carry the body is folded into it, as in `read_bvh`. Two nodes of one name are
    Hips and Hips.001. Meshes, morph targets and cameras are left out. A rig without animation makes
    one frame, the pose at rest, with a warning.

    Between keys rotations go along the shorter arc, all else in lines, or as the file says, in
    steps or cubic splines.

    Returns
    -------
    Motion : metres, y up, from the first key to the last.

    Raises
    ------
    GltfError : the file can't be read; the message names file, fault and remedy.
    """
    try:
        how = Reading(units, fps, tpose_first, drop_zeros, up, root, rigid, roles, animation)
    except BvhError as error:
        raise GltfError(str(error)) from error
    motion, doubts = read(path, how, source)
    for said in doubts.values():
        warnings.warn(f"{path}: {said}", stacklevel=2)
    return motion


def write_gltf(
    motion: Motion,
    path: str | os.PathLike,
    *,
    color: str = "mocap",
    name: str | None = None,
    root_motion: str | None = None,
) -> None:
    """Write a motion as a ``.glb`` file: skeleton, animation, and a mannequin that moves with it.

    The file appears whole or not at all, and replaces one of that name. Between the frames programs
    interpolate as `Motion.resample` does. Contacts are not written: glTF has no place for them.
    There is a key at every frame, the last at (frames - 1) / fps and the least bit more, so that a
    player that begins anew once that time has come still shows the last frame. Who loops a cycle
    gives it its first frame again at its end. An end site is a joint called after the one it hangs
    on, as HeadEnd on Head; `read_gltf` makes end sites of these.

    Parameters
    ----------
    motion : any skeleton; the mannequin is fitted to it as in the player.
    path : must end in ``.glb``; a ``.gltf`` would be a third larger, or two files that get lost.
    color : a hex code, a name matplotlib knows, or a method's name ("mocap", "acLSTM", ...).
    name : what the animation is called in the file, and, with _body behind it, the mesh; None: as the
        motion. assimp exports no file in which animation and node have one name.
    root_motion : "in-place" leaves way and heading out; "ground" puts them on a root joint on the
        floor, in whose frame the body moves (`motionlab.io.root_motion`).

    Raises
    ------
    GltfError : the motion has no frames, or the path can't be written.
    MotionError : there is no such root motion.
    ViewerError : the colour is none.
    """
    if not isinstance(motion, Motion) or not isinstance(path, str | os.PathLike):
        raise GltfError(
            f"write_gltf: got {motion!r} and {path!r}; give the motion first, then the path, as in "
            "write_gltf(motion, 'walk.glb')."
        )
    if not isinstance(name, str | None):
        raise GltfError(f"write_gltf: name={name!r} is not a word; give one, as in name='walk'.")
    path = Path(path)
    if len(motion) == 0:
        raise GltfError(f"{path}: the motion has no frames; there is nothing to write.")
    if path.suffix.lower() != ".glb":
        raise GltfError(f"{path}: the name must end in .glb, for example {path.stem}.glb.")
    check_kind(root_motion)
    parts = None if root_motion is None else split(motion)
    motion = motion if parts is None else parts.body
    scene = _Scene(motion, name or motion.name or "motion", on_root=root_motion == "ground")
    scene.add_animation(parts)
    scene.add_mannequin(color)
    put_whole(path, scene.content(), GltfError)


class _Scene:
    """The two halves of a file: `json`, a tree of objects that name each other by index, and
    `buffer`, the arrays that some of them are about."""

    def __init__(self, motion: Motion, name: str, *, on_root: bool):
        points = motion.skeleton.point_names
        taken = [*points, root_name(points)] if on_root else points
        self.motion, self.name = motion, free_name(taken, name)
        self.body = free_name(taken, f"{self.name}_body")
        self.root: int | None = None  # the node of a root joint on the floor, if there is one
        self.bound = bind_pose(motion)
        self.buffer = bytearray()
        self.json: dict = {
            "asset": {"version": "2.0", "generator": f"motionlab {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": self._nodes(),
            "bufferViews": [],
            "accessors": [],
        }
        if on_root:
            self._put_on_root()

    def _nodes(self) -> list[dict]:
        """A node per point, in the order of the points, in the bind pose."""
        skeleton = self.motion.skeleton
        offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
        offsets[0] = self.bound.root_positions[0]
        nodes = [
            {"name": name, "translation": offset}
            for name, offset in zip(skeleton.point_names, offsets.tolist(), strict=True)
        ]
        turns = quaternions(self.bound.rotations)[0].tolist()
        for node, turn in zip(nodes, turns, strict=False):  # end sites do not turn
            node["rotation"] = turn
        for point, parent in enumerate(skeleton.point_parents):
            if parent >= 0:
                nodes[parent].setdefault("children", []).append(point)
        return nodes

    def _put_on_root(self) -> None:
        """Hang the body on one more joint, which carries way and heading.

        It is in the skin, too, so that programs that look for bones there find it.
        """
        self.root = len(self.json["nodes"])
        name = root_name(self.motion.skeleton.point_names)
        self.json["nodes"].append({"name": name, "children": [0]})
        self.json["scenes"][0]["nodes"] = [self.root]

    def add_animation(self, parts: Parts | None) -> None:
        """Where the root is and how every joint is turned, each with a key at every frame."""
        times = (np.arange(len(self.motion)) / self.motion.fps).astype(np.float32)
        if (
            len(times) > 1
        ):  # three's mixer begins anew at the last key, which rounding may put earlier
            times[-1] = np.nextafter(times[-1], np.float32(np.inf))
        self.keys = self._add(times, "SCALAR", bounds=True)
        self.json["animations"] = [{"name": self.name, "channels": [], "samplers": []}]
        self._move(0, self.motion.root_positions)
        turns = quaternions(self.motion.rotations)
        for joint in range(self.motion.skeleton.joints):
            self._move(joint, turns[:, joint])
        if self.root is not None:
            self._move(self.root, parts.way)
            self._move(self.root, quaternions(parts.turn))

    def _move(self, node: int, values: Tensor) -> None:
        """Let a node go by translations (frames, 3), or turn by quaternions (frames, 4)."""
        path, kind = ("translation", "VEC3") if values.shape[1] == 3 else ("rotation", "VEC4")
        (animation,) = self.json["animations"]
        number, output = len(animation["samplers"]), self._add(values, kind)
        animation["samplers"].append(
            {"input": self.keys, "interpolation": "LINEAR", "output": output}
        )
        animation["channels"].append({"sampler": number, "target": {"node": node, "path": path}})

    def add_mannequin(self, color: str) -> None:
        """The mesh and its skin, on a node of its own: it is where its joints are."""
        skin = mannequin(self.bound)
        material = {
            "baseColorFactor": _linear(color),
            "metallicFactor": 0,
            "roughnessFactor": _ROUGHNESS,
        }
        if skin is None:  # nothing to see, but it moves
            return
        lift = self._stand_on_floor(skin)
        attributes = {
            "POSITION": self._add(skin.vertices + lift, "VEC3", bounds=True, **_VERTICES),
            "NORMAL": self._add(skin.normals, "VEC3", **_VERTICES),
            "JOINTS_0": self._add(skin.joints, "VEC4", dtype="<u2", **_VERTICES),
            "WEIGHTS_0": self._add(skin.weights, "VEC4", **_VERTICES),
        }
        indices = self._add(skin.triangles.ravel(), "SCALAR", dtype="<u4", **_TRIANGLES)
        primitive = {"attributes": attributes, "indices": indices, "material": 0}
        joints = list(range(self.motion.skeleton.points))
        joints += [] if self.root is None else [self.root]
        self.json["materials"] = [{"name": self.body, "pbrMetallicRoughness": material}]
        self.json["meshes"] = [{"name": self.body, "primitives": [primitive]}]
        self.json["skins"] = [
            {"joints": joints, "inverseBindMatrices": self._inverse_bind_matrices(lift)}
        ]
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]))
        self.json["nodes"].append({"name": self.body, "mesh": 0, "skin": 0})

    def _stand_on_floor(self, skin: Skin) -> np.ndarray:
        """Lift the bind pose, which programs show when nothing plays, and say by how much, (3,)."""
        lift = np.array([0.0, -skin.vertices[:, 1].min(), 0.0])
        self.json["nodes"][0]["translation"] = lift.tolist()
        return lift

    def _inverse_bind_matrices(self, lift: np.ndarray) -> int:
        """From the world in the bind pose to each joint's frame; an accessor's index."""
        turns = self.bound.orientations()[0].double().numpy().swapaxes(-1, -2)
        turns = np.concatenate([turns, turns[list(self.motion.skeleton.end_parents)]])
        places = self.bound.positions()[0].double().numpy() + lift
        matrices = np.tile(np.eye(4), (len(turns), 1, 1))
        matrices[:, :3, :3] = turns
        matrices[:, :3, 3] = -(turns @ places[..., None])[..., 0]
        if self.root is not None:  # bound at the origin
            matrices = np.concatenate([matrices, np.eye(4)[None]])
        return self._add(matrices.swapaxes(-1, -2), "MAT4")  # glTF goes down the columns

    def _add(self, values, kind: str, *, dtype="<f4", bounds=False, **view) -> int:
        """Put an array into the buffer; the index of the accessor that tells where and what."""
        if isinstance(values, Tensor):
            values = values.numpy(force=True)
        array = np.ascontiguousarray(values, dtype).reshape(-1, _WIDTH[kind])
        accessor = {
            "bufferView": len(self.json["bufferViews"]),
            "componentType": _COMPONENT[dtype],
            "count": len(array),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes, **view}
        )
        self.json["accessors"].append(accessor)
        self.buffer += array.tobytes()  # of rows of 4, 8, 12 ... bytes: aligned as it must be
        return len(self.json["accessors"]) - 1

    def content(self) -> bytes:
        """The file: a header, and each half as a chunk."""
        self.json["buffers"] = [{"byteLength": len(self.buffer)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = b"".join(
            struct.pack("<I4s", len(data), kind) + data
            for kind, data in ((b"JSON", text), (b"BIN\0", self.buffer))
        )
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def quaternions(rotations: Tensor) -> Tensor:
    """Unit quaternions (frames, ..., 4), w last, of matrices (frames, ..., 3, 3).

    q and -q are the same rotation; each has the sign nearer to the one before it, as programs
    interpolate the numbers.
    """
    turns = roma.rotmat_to_unitquat(rotations.detach().cpu().double())
    turns = turns / turns.norm(dim=-1, keepdim=True)
    turned_over = (turns[1:] * turns[:-1]).sum(-1) < 0
    turns[1:] *= torch.where(turned_over, -1.0, 1.0).cumprod(0)[..., None]
    return turns


def _linear(color: str) -> list[float]:
    """Red, green, blue and opacity, 0 to 1, as light adds up: colours as written (sRGB) do not."""
    from matplotlib.colors import to_rgb

    from ..viewer.pictures.palette import check_color

    rgb = np.array(to_rgb(check_color(color)))
    rgb = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return [*rgb.round(5).tolist(), 1.0]
