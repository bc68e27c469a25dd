"""The nodes of a glTF file: how they hang together, which are a body's joints, where they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import roma
import torch
from scipy.spatial.transform import Rotation

from ..skeleton import Skeleton
from .gltf_file import LARGEST, File, brief
from .gltf_keys import Track

_FLAT = 1e-18  # of a scale's product over three axes; less leaves no axes to see a turn by
_SKEW = 1e-6  # by which axes may miss right angles and equal lengths, as rounding leaves them


@dataclass(frozen=True)
class Place:
    """Where a node is in the world.

    Attributes
    ----------
    at : (frames, 3), in the file's unit, one frame if it never moves.
    turn : (frames, 3, 3), a rotation.
    axes : (frames, 3, 3), turned and scaled as what hangs on it.
    """

    at: np.ndarray
    turn: np.ndarray
    axes: np.ndarray


_WORLD = Place(np.zeros((1, 3)), np.eye(3)[None], np.eye(3)[None])


class Nodes:
    """The nodes of a file.

    Attributes
    ----------
    names : each its own.
    parents : -1 for those at the top.
    children : of each node.
    """

    def __init__(self, file: File) -> None:
        self.file = file
        self.nodes = file.items("nodes")
        count = len(self.nodes)
        self.names = _names(self.nodes)
        self.parents = [-1] * count
        self.children: list[list[int]] = []
        for node, about in enumerate(self.nodes):
            self.children.append(file.listed(about.get("children"), f"the children of node {node}"))
            for child in self.children[-1]:
                file.item("nodes", child)
                if self.parents[child] >= 0:
                    file.fail(f"node {self.names[child]!r} hangs on two others")
                self.parents[child] = node
        tops = [node for node in range(count) if self.parents[node] < 0]
        self.order = [node for top in tops for node in self.below(top)]
        if len(self.order) < count:
            file.fail("its nodes hang on each other in a circle")

    def above(self, node: int) -> list[int]:
        """What a node hangs on, the nearest first."""
        found = []
        while (node := self.parents[node]) >= 0:
            found.append(node)
        return found

    def below(self, node: int) -> list[int]:
        """A node and what hangs on it at any depth, each with what hangs on it right behind it."""
        found, waiting = [], [node]
        while waiting:
            found.append(waiting.pop())
            waiting += reversed(self.children[found[-1]])
        return found

    def skinned(self) -> set[int]:
        """The nodes that carry a skin."""
        found = set()
        for skin in self.file.items("skins"):
            joints = self.file.listed(skin.get("joints"), "the joints of a skin")
            for joint in joints:
                self.file.item("nodes", joint)
            found.update(joints)
        return found

    def tips(self, skinned: set[int]) -> set[int]:
        """Those of the joints of a skin that are end sites, as `write_gltf` names them: HeadEnd, which
        hangs on Head and carries no other, also if a program has put a number behind the name."""
        end = lambda node: re.escape(self.names[self.parents[node]]) + r"End(\.\d+)?"
        return {
            node
            for node in skinned
            if self.parents[node] in skinned and not self.children[node] and self.is_bare(node)
            and re.fullmatch(end(node), self.names[node])
        }  # fmt: skip

    def is_bare(self, node: int) -> bool:
        """Whether there is nothing to see of a node, nor to see by."""
        about = self.nodes[node]
        return not {"mesh", "camera", "extensions"}.intersection(about)

    # -- which are joints -------------------------------------------------------------------------

    def root(self, known: set[int], moving: set[int], name: str | None) -> tuple[int, str | None]:
        """The root of a body out of nodes that are known as joints, and what to say if others are
        left out. moving : nodes that are animated; name : the root's, if it was said; else there
        must be one body."""
        tops = [n for n in self.order if n in known and not known.intersection(self.above(n))]
        listed = ", ".join(repr(self.names[top]) for top in tops[:20])
        if name is not None:
            found = [node for node in self.order if self.names[node] == name]
            if not found or not known.intersection(self.below(found[0])):
                self.file.fail(f"there is no joint {name!r}", f"root= may be one of {listed}")
            return found[0], None
        if len(tops) == 1:
            return tops[0], None
        shared = [n for n in self.above(tops[0]) if known.issubset(self.below(n))][:1]
        whole = [top for top in tops if self._is_whole(top, known)]
        if not whole and shared and (shared[0] in moving or self._is_whole(shared[0], known)):
            return shared[0], None
        # beside targets of legs, sockets of tools and the like, which carry nothing
        carrying = [top for top in tops if len(known.intersection(self.below(top))) > 1]
        for body in (whole, carrying if not whole else []):
            if len(body) == 1:
                others = ", ".join(self.names[top] for top in tops if top not in body)[:200]
                return body[0], (
                    f"the body hangs on {self.names[body[0]]!r}; joints beside it are left out: "
                    f"{others}."
                )
        all_ = f", or root={self.names[shared[0]]!r} for all of them" if shared else ""
        self.file.fail(
            f"holds {len(tops)} bodies, or joints that do not hang together: {listed}",
            f"say which to read, as root={self.names[(whole or tops)[0]]!r}{all_}",
        )

    def joints(self, root: int, known: set[int], *, more: bool) -> list[int]:
        """The joints of a body: those that are known, and what lies between them and the root.

        more : what hangs on these and carries others, too, if there is nothing to see of it.
        """
        kept = {root} | known
        for node in known.intersection(self.below(root)):
            kept.update(self.above(node))
        found: set[int] = set()
        for node in self.below(root):
            inner = more and self.children[node] and self.is_bare(node)
            if node == root or (self.parents[node] in found and (node in kept or inner)):
                found.add(node)
        return [node for node in self.below(root) if node in found]

    def ends(self, joints: list[int]) -> list[int]:
        """What hangs on joints, carries nothing and shows nothing: the tips of fingers, of toes."""
        leaves = (node for joint in joints for node in self.children[joint])
        taken = set(joints)
        return [n for n in leaves if n not in taken and not self.children[n] and self.is_bare(n)]

    def _is_whole(self, root: int, known: set[int]) -> bool:
        """Whether both legs and a head, or neck, hang there, as far as names tell."""
        joints = self.joints(root, known, more=False)
        parents = [-1, *(joints.index(self.parents[joint]) for joint in joints[1:])]
        names = [self.names[joint] for joint in joints]
        roles = Skeleton(names, parents, torch.zeros(len(joints), 3)).roles
        return {"left_upper_leg", "right_upper_leg"} <= {*roles} and bool(
            {"neck", "head"} & {*roles}
        )

    # -- where they are ---------------------------------------------------------------------------

    def places(
        self,
        nodes: Iterable[int],
        tracks: Mapping[tuple[int, str], Track] | None = None,
        when: np.ndarray | None = None,
    ) -> dict[int, Place]:
        """Where nodes are, parents before children and with all that they hang on, at the times of
        frames; as they stand in the file without an animation."""
        found = {-1: _WORLD}
        for node in nodes:
            shift, turn, axes = self._local(node, tracks or {}, when)
            above = found[self.parents[node]]
            at = above.at + (above.axes @ shift[..., None])[..., 0]
            axes = above.axes @ axes
            found[node] = Place(at, self._turn(node, axes, above.turn @ turn), axes)
        return found

    def _local(self, node: int, tracks: Mapping[tuple[int, str], Track], when) -> tuple:
        """Shift (frames, 3), rotation and scaled axes (frames, 3, 3) of a node against its parent."""
        about = self.nodes[node]
        if "matrix" in about:
            matrix = self._numbers(node, "matrix", 16).reshape(4, 4).T  # glTF goes down the columns
            return matrix[None, :3, 3], np.eye(3)[None], matrix[None, :3, :3]
        values = {
            what: tracks[node, what].at(when)
            if (node, what) in tracks
            else self._numbers(node, what, count)[None]
            for what, count in (("translation", 3), ("rotation", 4), ("scale", 3))
        }
        length = np.linalg.norm(values["rotation"], axis=-1, keepdims=True)
        if length.min() < 1e-6:
            self.file.fail(f"node {self.names[node]!r} is turned by no rotation (0, 0, 0, 0)")
        turn = Rotation.from_quat(values["rotation"]).as_matrix()
        return values["translation"], turn, turn * values["scale"][:, None]

    def _numbers(self, node: int, what: str, count: int) -> np.ndarray:
        """A node's own "translation", "rotation", "scale" or "matrix"."""
        given = self.nodes[node].get(what)
        if given is None:
            return {"translation": np.zeros(3), "rotation": np.eye(4)[3], "scale": np.ones(3)}[what]
        try:
            values = np.array(given, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if values.shape != (count,) or not (np.abs(values) <= LARGEST).all():
            self.file.fail(
                f"the {what} of node {self.names[node]!r} is {brief(given)}, not {count} numbers"
            )
        return values

    def _turn(self, node: int, axes: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """The rotation in scaled axes (frames, 3, 3); `turn` where a scale of zero hides it."""
        size = np.linalg.det(axes)[:, None, None]
        if size.min() < -_FLAT:
            self.file.fail(
                f"node {self.names[node]!r} is mirrored by a negative scale",
                "apply scale in the program it comes from",
            )
        flat = size < _FLAT
        found = np.where(flat, turn, axes / np.cbrt(np.where(flat, 1, size)))
        skewed = np.abs(found @ found.swapaxes(1, 2) - np.eye(3)).max((1, 2)) > _SKEW
        if skewed.any():
            found[skewed] = roma.special_procrustes(torch.from_numpy(found[skewed])).numpy()
        return found


def _names(nodes: list[dict]) -> list[str]:
    """A name for each node, all different: as Blender does, the second Hips is Hips.001."""
    found: dict[str, int] = {}
    for i, node in enumerate(nodes):
        name = node.get("name")
        given = name = name if isinstance(name, str) and name.strip() else f"node{i}"
        while name in found:
            found[given] += 1
            name = f"{given}.{found[given]:03d}"
        found[name] = 0
    return list(found)
