"""From a glTF file to a Motion, step by step, and what is doubtful about it on the way."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BvhError, GltfError, SkeletonError
from ..motion import Motion
from . import rigid
from .bvh_reading import Doubts, Reading, frames_to_skip
from .bvh_text import opened
from .bvh_units import doubt_units, in_metres
from .bvh_up import doubt_up, turn_up
from .first_pose import doubt_first
from .gltf_file import LARGEST, File, brief
from .gltf_keys import Track, frames, moved, tracks
from .gltf_nodes import Nodes, Place

_SCALED = 1e-3  # of its size, by which a joint may change it
_MOVED = 1e-4  # in a rotation's matrix, that is no longer the pose at rest


def read(path: str | os.PathLike, how: Reading, source: str = "") -> tuple[Motion, Doubts]:
    """The motion in a file, and what to warn of."""
    return parse(opened(path, GltfError), Path(path), how, source, Path(path).parent)


def parse(
    data: bytes, where, how: Reading, source: str = "", folder: Path | None = None
) -> tuple[Motion, Doubts]:
    """`read` for the bytes of a file; `where` is what errors call it, and its other files are in
    `folder`."""
    file = File(data, where, folder)
    nodes = Nodes(file)
    doubts: dict[str, str | None] = {}
    skinned = nodes.skinned()
    animation = _animation(nodes, skinned, how)
    moving = set() if animation is None else moved(file, animation)
    tips = nodes.tips(skinned)
    skinned, moving = skinned - tips, moving - tips
    known = _known(nodes, skinned, moving)
    root, doubts["beside"] = nodes.root(known, moving, how.root)
    known |= {node for node in moving.intersection(nodes.below(root)) if nodes.is_bare(node)}
    joints = nodes.joints(root, known, more=not skinned)
    chain = [*nodes.above(root)[::-1], *joints]
    moves = {} if animation is None else tracks(file, animation, chain)
    if animation is None:
        doubts["animation"] = "holds no animation; what is read is one frame, the pose at rest."
    when, fps, doubts["rate"] = frames(file, moves.values(), how.fps)
    doubts["scale"] = _doubt_scale(nodes, joints, moves)
    units = "m" if how.units is None else how.units
    body = _Body(nodes, joints, in_metres(units))
    motion = body.motion(nodes.places([*chain, *body.ends], moves, when), when, fps, how)
    motion = turn_up(_named(motion, how, where, source), how.up)  # which asks where the trunk is
    doubts |= body.tree.doubts
    doubts["units"] = doubt_units(motion.skeleton, units)
    still = turn_up(body.motion(body.still, np.zeros(1), fps, Reading()), how.up)
    if doubt_up(still, how.up):
        doubts["up"] = doubt_up(motion, how.up)  # of one who crouches the pose at rest is upright
    doubts["first"] = doubt_first(motion, how.tpose_first or how.drop_zeros)
    return motion, {about: said for about, said in doubts.items() if said}


def _named(motion: Motion, how: Reading, where, source: str) -> Motion:
    try:
        skeleton = replace(motion.skeleton, roles=how.roles)
    except SkeletonError as error:
        raise GltfError(f"{where}: {error}") from error
    return replace(motion, skeleton=skeleton, name=Path(where).stem, source=source)


# -- what moves -----------------------------------------------------------------------------------


def _known(nodes: Nodes, skinned: set[int], moving: set[int]) -> set[int]:
    """Nodes that are joints for sure: those that carry a skin, and what moves below them; without
    skin what moves."""
    if not skinned:
        return {node for node in moving if "camera" not in nodes.nodes[node]} or moving
    return skinned | {
        n for n in moving if nodes.is_bare(n) and skinned.intersection(nodes.above(n))
    }


def _animation(nodes: Nodes, skinned: set[int], how: Reading) -> dict | None:
    """The one animation that moves a body, or the one that was asked for."""
    file = nodes.file
    every = file.items("animations")
    names = [str(each.get("name", "")) for each in every]
    about = {node for joint in skinned for node in (joint, *nodes.above(joint))}
    if how.root in nodes.names:
        root = nodes.names.index(how.root)
        about = {*nodes.below(root), *nodes.above(root)} & (about or {*nodes.order})
    of_body = [
        i for i, each in enumerate(every) if moved(file, each).intersection(about or nodes.order)
    ]
    listed = ", ".join(f"{names[i]!r} ({i})" for i in of_body[:40])
    if not of_body and not skinned:
        file.fail(
            "has neither skin nor animation, so nothing tells which of its nodes are joints",
            "export it with its armature and the animation",
        )
    if how.animation is not None:
        return every[_asked(file, how.animation, {i: names[i] for i in of_body}, listed)]
    if len(of_body) > 1:
        first = names[of_body[0]] or of_body[0]
        file.fail(
            f"holds {len(of_body)} animations: {listed}",
            f"say which to read by name or number, as animation={first!r}",
        )
    return every[of_body[0]] if of_body else None


def _asked(file: File, asked: str | int, names: Mapping[int, str], listed: str) -> int:
    """The number of the animation that is meant by a name or number."""
    found = [i for i, name in names.items() if name == asked]
    if not found and str(asked).isdecimal():
        found = [i for i in names if i == int(asked)]
    if len(found) > 1:
        file.fail(f"several animations are called {asked!r}: {listed}", "say which by its number")
    if not found:
        file.fail(
            f"no animation of a body is {brief(asked)}",
            f"animation= may be one of {listed}" if listed else "leave animation= out",
        )
    return found[0]


def _doubt_scale(
    nodes: Nodes, joints: list[int], moves: Mapping[tuple[int, str], Track]
) -> str | None:
    """What to say if a joint changes its size."""
    for (node, what), track in moves.items():
        sizes = track.values[:, 1] if track.way == "CUBICSPLINE" else track.values
        if what == "scale" and node in joints and np.ptp(sizes, axis=0).max() > _SCALED:
            return (
                f"joint {nodes.names[node]!r} changes its size, from {sizes.min():.3g} to "
                f"{sizes.max():.3g}; that is left out, places are kept as far as bones are rigid."
            )
    return None


class _Body:
    """Joints and end sites, and the motion that they make."""

    def __init__(self, nodes: Nodes, joints: list[int], metres: float) -> None:
        self.nodes, self.joints, self.metres = nodes, joints, metres
        self.ends = nodes.ends(joints)
        index = {node: joint for joint, node in enumerate(joints)}
        self.still = still = nodes.places([*nodes.above(joints[0])[::-1], *joints, *self.ends])
        names = [nodes.names[node] for node in joints]
        self.tree = rigid.Tree(
            names,
            [-1, *(index[nodes.parents[node]] for node in joints[1:])],
            np.concatenate([self._shift(node, still) for node in joints]),
            [index[nodes.parents[node]] for node in self.ends],
            np.concatenate([np.zeros((0, 3)), *(self._shift(node, still) for node in self.ends)]),
            lambda name, said: GltfError(f"{nodes.file.where}: {said}"),
        )

    def motion(self, places: Mapping[int, Place], when, fps: float, how: Reading) -> Motion:
        """The motion of rigid bones that are in these places at these times."""
        rotations = np.empty((len(when), len(self.joints), 3, 3), np.float32)
        shifts = {}
        for joint, node in enumerate(self.joints):
            rotations[:, joint] = self._turn(node, places)
            shifts[joint] = np.broadcast_to(self._shift(node, places), (len(when), 3))
        rest = np.concatenate([self._turn(node, self.still) for node in self.joints])
        moved = (np.abs(rotations - rest) > _MOVED).reshape(len(when), -1, 9)
        try:
            skip = frames_to_skip(moved, how, self.nodes.file.where)
        except BvhError as error:
            raise GltfError(str(error)) from error
        shifts = {joint: shift[skip:] for joint, shift in shifts.items()}
        return self.tree.motion(rotations[skip:], shifts, fps, mean=how.rigid == "mean")

    def _turn(self, node: int, places: Mapping[int, Place]) -> np.ndarray:
        """How a node is turned against its parent (frames, 3, 3), the root in the world."""
        if node == self.joints[0]:
            return places[node].turn
        return places[self.nodes.parents[node]].turn.swapaxes(1, 2) @ places[node].turn

    def _shift(self, node: int, places: Mapping[int, Place]) -> np.ndarray:
        """Where a node is against its parent (frames, 3), the root in the world, metres."""
        if node == self.joints[0]:
            shift = places[node].at
        else:
            above = places[self.nodes.parents[node]]
            away = places[node].at - above.at
            shift = (above.turn.swapaxes(1, 2) @ away[..., None])[..., 0]
        if not (np.abs(shift) <= LARGEST).all():
            self.nodes.file.fail(f"node {self.nodes.names[node]!r} is beyond all measure")
        return shift * self.metres
