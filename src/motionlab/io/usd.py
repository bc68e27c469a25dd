"""Motion as a USD file, ``.usda``: a skeleton, its animation, and the mannequin as a mesh that it carries.

UsdSkel plays no animation without scales, so that they are written, all of them one. y points up,
lengths are metres, a time code is a frame. The format:
https://openusd.org/release/api/_usd_skel__schemas.html.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from ..errors import MotionFileError
from ..motion import Motion
from ..skeleton import Skeleton
from .free_names import safe_names
from .gltf import quaternions
from .gltf_mesh import Skin, bind_pose, mannequin
from .whole_file import put_whole

_FILE = """#usda 1.0
(
    defaultPrim = "{name}"
    startTimeCode = 0
    endTimeCode = {last}
    timeCodesPerSecond = {fps}
    framesPerSecond = {fps}
    metersPerUnit = 1
    upAxis = "Y"
)

def SkelRoot "{name}" (
    prepend apiSchemas = ["SkelBindingAPI"]
)
{{
    rel skel:animationSource = </{name}/Animation>
    rel skel:skeleton = </{name}/Skeleton>

    def Skeleton "Skeleton"
    {{
        uniform token[] joints = {joints}
        uniform matrix4d[] bindTransforms = {bind}
        uniform matrix4d[] restTransforms = {rest}
    }}

    def SkelAnimation "Animation"
    {{
        uniform token[] joints = {joints}
        half3[] scales = {scales}
        float3[] translations.timeSamples = {{
{translations}
        }}
        quatf[] rotations.timeSamples = {{
{rotations}
        }}
    }}
{mesh}}}
"""
_MESH = """
    def Mesh "Body" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {{
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {corners}
        point3f[] points = {points}
        normal3f[] normals = {normals} (
            interpolation = "vertex"
        )
        int[] primvars:skel:jointIndices = {carriers} (
            elementSize = 4
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = {weights} (
            elementSize = 4
            interpolation = "vertex"
        )
        matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    }}
"""


def write_usd(motion: Motion, path: str | os.PathLike) -> None:
    """Write a motion as ``.usda``: the file appears whole or not at all, and replaces one of that name.

    Joints are called as identifiers of USD may be, of letters without marks, digits and _. End sites
    are joints, too, as in `write_gltf`.

    Raises
    ------
    MotionFileError : the motion has no frames, or the path can't be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".usda":
        raise MotionFileError(f"{path}: the name must end in .usda, for example {path.stem}.usda.")
    if len(motion) == 0:
        raise MotionFileError(f"{path}: the motion has no frames; there is nothing to write.")
    skeleton, bound = motion.skeleton, bind_pose(motion)
    skin = mannequin(bound)
    (name,) = safe_names([motion.name or "motion"], ascii_only=True)
    joints = _joint_paths(skeleton)
    turns, places = _samples(motion)
    bind, rest = _bind_and_rest(bound)
    text = _FILE.format(
        name=name,
        last=len(motion) - 1,
        fps=f"{motion.fps:.10g}",
        joints="[" + ", ".join(f'"{joint}"' for joint in joints) + "]",
        bind=_rows(bind, _matrix),
        rest=_rows(rest, _matrix),
        scales=_rows(np.ones((len(joints), 3)), _tuple),
        translations=_timed(places),
        rotations=_timed(turns),
        mesh="" if skin is None else _mesh(skin),
    )
    put_whole(path, text.encode())


def joint_names(skeleton: Skeleton) -> list[str]:
    """What joints and, behind them, end sites are called in the file."""
    return safe_names(skeleton.point_names, ascii_only=True)


def _joint_paths(skeleton: Skeleton) -> list[str]:
    """Hips, Hips/Spine, ...: a joint with all that it hangs on; end sites behind the joints."""
    names = joint_names(skeleton)
    paths: list[str] = []
    for name, parent in zip(names, skeleton.point_parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    return paths


def _samples(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Quaternions (frames, points, 4), w first, and places (frames, points, 3) against the parents."""
    skeleton, frames = motion.skeleton, len(motion)
    turns = quaternions(motion.rotations)[..., [3, 0, 1, 2]].numpy()
    still = np.broadcast_to([1.0, 0, 0, 0], (frames, len(skeleton.end_parents), 4))
    places = torch.cat([skeleton.offsets, skeleton.end_offsets]).repeat(frames, 1, 1)
    places[:, 0] = motion.root_positions.detach().cpu()
    return np.concatenate([turns, still], axis=1), places.numpy()


def _bind_and_rest(bound: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (points, 4, 4) of the bind pose in the world, and against the parents."""
    skeleton = bound.skeleton
    ends = list(skeleton.end_parents)
    world, local = bound.orientations()[0], bound.rotations[0]
    turns = (
        torch.cat([world, world[ends]]),
        torch.cat([local, torch.eye(3).repeat(len(ends), 1, 1)]),
    )
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
    offsets[0] = bound.root_positions[0]
    matrices = torch.eye(4).repeat(2, skeleton.points, 1, 1)
    for matrix, turn, place in zip(matrices, turns, (bound.positions()[0], offsets), strict=True):
        matrix[:, :3, :3], matrix[:, 3, :3] = turn.mT, place  # USD multiplies rows by matrices
    return matrices[0].numpy(), matrices[1].numpy()


def _mesh(skin: Skin) -> str:
    return _MESH.format(
        counts=_rows(np.full(len(skin.triangles), 3), str),
        corners=_rows(skin.triangles.ravel(), str),
        points=_rows(skin.vertices, _tuple),
        normals=_rows(skin.normals, _tuple),
        carriers=_rows(skin.joints.ravel(), str),
        weights=_rows(skin.weights.ravel(), _number),
    )


def _timed(values: np.ndarray) -> str:
    rows = (f"            {frame}: {_rows(row, _tuple)}," for frame, row in enumerate(values))
    return "\n".join(rows)


def _rows(values: np.ndarray, word: Callable) -> str:
    return "[" + ", ".join(map(word, values.tolist())) + "]"


def _tuple(row: list[float]) -> str:
    return "(" + ", ".join(map(_number, row)) + ")"


def _matrix(rows: list[list[float]]) -> str:
    return "(" + ", ".join(map(_tuple, rows)) + ")"


def _number(value: float) -> str:
    return f"{value:.7g}"
