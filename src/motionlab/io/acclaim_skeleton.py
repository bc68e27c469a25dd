"""An Acclaim skeleton file, ``.asf``: bones, how they hang together, and what turns each of them.

After the format's definition, version 1.10 (M. Schafer, Acclaim, 1994), and Vicon's remarks on it.
A bone begins where its parent ends and goes on along `direction` for `length`. Its angles turn it
about axes of its own, which `axis` turns against the world, and in whose order they are applied;
`dof` lists those that the motion has, as its rows list them. Of the root, `order` says both.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from ..errors import AmcError
from .bvh_text import decode, hint, is_number
from .euler import from_euler

ROOT = "root"
_DOF = ("rx", "ry", "rz", "tx", "ty", "tz", "l")
_AXES = re.compile(r"[xyz]{3}", re.IGNORECASE)
_UNIT = 0.01  # by how much a direction's length may differ from 1


@dataclass
class Bone:
    """A bone as the file has it, the root included, which is a point.

    Attributes
    ----------
    name, line : what it is called, and the line it begins in.
    direction : (3,) of any length, and `length` in the file's unit.
    axis : three angles about x, y, z, applied in the order of `axes`, as "xyz". Of the root, its
        pose before all motion.
    dof : what the rows of the motion hold: "rx", "ry", "rz", "tx", "ty", "tz", "l".
    """

    name: str = ""
    line: int = 1
    direction: list[float] | None = None
    length: float | None = None
    axis: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    axes: str = "xyz"
    dof: list[str] = field(default_factory=list)

    @property
    def vector(self) -> np.ndarray:
        """From its beginning to its end, (3,), in the file's unit."""
        norm = np.linalg.norm(self.direction)
        return np.array(self.direction) * (self.length / norm if norm else 0.0)

    def applied(self, dof: list[str]) -> list[str]:
        """The angles among degrees of freedom, first that which is applied first about fixed axes."""
        listed = [kind for kind in dof if kind[0] == "r"]
        if self.name == ROOT:
            return listed
        return sorted(listed, key=lambda kind: self.axes.index(kind[1]))


class AcclaimSkeleton:
    """What a skeleton file says.

    Attributes
    ----------
    bones : by their names in lower case, the root first, parents before children.
    parents : of each bone the index of its parent, -1 of the root.
    length : units in an inch; the file's lengths are inches divided by it.
    radians : whether its angles are radians; what does not say so has degrees.
    position : (3,), of the root before all motion, in the file's unit.
    doubts : what is said in a way that can be meant otherwise.
    """

    def __init__(self, text: str, where) -> None:
        self.where = where
        self.length = 1.0
        self._angle = ""
        self.position = [0.0, 0.0, 0.0]
        self.doubts: dict[str, str] = {}
        self._root = Bone(ROOT, direction=[0.0, 0.0, 0.0], length=0.0)
        self._bones: dict[str, Bone] = {ROOT: self._root}
        self._open: Bone | None = None  # the bone whose block is being read
        self._parent: dict[str, str] = {}
        self._children: dict[str, list[str]] = {}
        self._read(text)
        self.bones, self.parents = self._sorted()

    def fail(self, number: int, what: str, remedy: str) -> NoReturn:
        raise AmcError(f"{self.where}, line {number}: {what}; {remedy}.")

    @property
    def radians(self) -> bool:
        return self._angle.startswith("rad")

    def turns(self) -> np.ndarray:
        """How the axes of each bone lie in the world, (bones, 3, 3); of the root its first pose."""
        bones = list(self.bones.values())
        angles = [[bone.axis["xyz".index(axis)] for axis in bone.axes[::-1]] for bone in bones]
        angles = np.rad2deg(angles) if self.radians else np.array(angles)
        return from_euler(angles[None], [bone.axes[::-1].upper() for bone in bones])[0]

    def _read(self, text: str) -> None:
        sections = {
            ":units": self._units,
            ":root": self._of_root,
            ":bonedata": self._of_bone,
            ":hierarchy": self._of_hierarchy,
        }
        seen, section, number = set(), "", 1
        for number, line in enumerate(text.split("\n"), start=1):
            words = re.sub(r"#.*|[(),]", " ", line).split()
            if words and words[0].startswith(":"):
                self._end_bone(number)
                section = words.pop(0).lower()
                seen.add(section)
            if words and section in sections:
                sections[section](number, words[0].lower(), words[1:])
        self._end_bone(number)
        if not self._angle and any(any(bone.axis) for bone in self._bones.values()):
            self.doubts["angle"] = (
                f"{self.where} does not say in :units what its angles are; they are taken as degrees."
            )
        for bone in self._bones.values():
            self._doubt_order(bone)
        for section in (":bonedata", ":hierarchy"):
            if section not in seen:
                what = f"there is no {section} section before the file ends"
                self.fail(number, what, "it is cut off, or no .asf file; copy or export it again")

    # -- the sections -----------------------------------------------------------------------------

    def _units(self, number: int, key: str, words: list[str]) -> None:
        if key == "length":
            self.length = self._numbers(number, key, words, 1)[0]
            if not 1e-6 <= self.length <= 1e6:
                self.fail(number, f"{words[0]} is no unit of length", "write 'length 1.0'")
        elif key == "angle":
            word = "".join(words).lower()
            if word not in ("deg", "degree", "degrees", "rad", "radian", "radians"):
                self.fail(number, f"{word[:20]!r} is no unit of angles", "write 'deg' or 'rad'")
            self._angle = word

    def _of_root(self, number: int, key: str, words: list[str]) -> None:
        if key == "order":
            self._root.dof, self._root.line = self._dof(number, words), number
            if "l" in self._root.dof:
                self.fail(number, "the root has no length", "remove L from its order")
        elif key == "axis":
            self._root.axes = self._axes(number, "".join(words))
        elif key == "position":
            self.position = self._numbers(number, key, words, 3)
        elif key == "orientation":
            self._root.axis = self._numbers(number, key, words, 3)
            if any(self._root.axis):
                self.doubts["orientation"] = (
                    f"{self.where}, line {number}: the root is turned before all motion, which "
                    "programs read in different ways; here the motion is turned by it as a whole."
                )

    def _of_bone(self, number: int, key: str, words: list[str]) -> None:
        bone = self._open
        if key == "begin":
            self._end_bone(number)
            self._open = Bone(line=number)
        elif bone is None:
            self.fail(number, f"{key[:20]!r} stands outside of a bone", "write 'begin' before it")
        elif key == "end":
            self._close(number)
        elif key == "name":
            bone.name = "_".join(words)
        elif key == "direction":
            bone.direction = self._numbers(number, key, words, 3)
            norm = np.linalg.norm(bone.direction)
            if norm and abs(norm - 1) > _UNIT:
                self.doubts.setdefault(
                    "direction",
                    f"{self.where}, line {number}: a direction is {norm:.3g} long, not 1; bones are "
                    "as long as their length says.",
                )
        elif key == "length":
            bone.length = self._numbers(number, key, words, 1)[0]
            if bone.length < 0:
                self.fail(number, f"a bone's length is {words[0]}", "it must not be negative")
        elif key == "axis":
            self._axis(number, bone, words)
        elif key == "dof":
            bone.dof = self._dof(number, words)
        # all else, such as limits, id and mass, does not move a bone

    def _of_hierarchy(self, number: int, key: str, words: list[str]) -> None:
        if key in ("begin", "end") and not words:
            return
        for name in (key, *map(str.lower, words)):
            if name not in self._bones:
                self.fail(number, f"there is no bone {name[:80]!r}", "correct the name, or add it")
        for name in map(str.lower, words):
            if name == ROOT or name in self._parent:
                above = f"already hangs on {self._parent.get(name, 'nothing')!r}"
                self.fail(number, f"{name!r} {above}", "a bone has one parent, the root none")
            self._parent[name] = key
            self._children.setdefault(key, []).append(name)

    # -- bones ------------------------------------------------------------------------------------

    def _end_bone(self, number: int) -> None:
        if self._open is not None:
            remedy = "add 'end', or copy the file again if it is cut off"
            self.fail(number, f"the bone of line {self._open.line} does not end", remedy)

    def _close(self, number: int) -> None:
        bone, self._open = self._open, None
        lacking = [
            key
            for key, value in (
                ("name", bone.name or None),
                ("direction", bone.direction),
                ("length", bone.length),
            )
            if value is None
        ]
        if lacking:
            named = f"bone {bone.name[:80]!r}" if bone.name else "the bone"
            self.fail(number, f"{named} has no {' and no '.join(lacking)}", "add what is missing")
        if bone.length and not any(bone.direction):
            self.fail(number, f"bone {bone.name[:80]!r} has no direction but 0 0 0", "mend it")
        if other := self._bones.get(bone.name.lower()):
            what = f"bone {bone.name[:80]!r} is there twice (first in line {other.line})"
            self.fail(bone.line, what, "rename one of them")
        self._bones[bone.name.lower()] = bone

    def _doubt_order(self, bone: Bone) -> None:
        """Say so if the angles of a bone are listed in another order than its axes: the format's
        definition has examples of both, and programs apply them in the one or the other."""
        listed = [kind[1] for kind in bone.dof if kind[0] == "r"]
        if listed != sorted(listed, key=bone.axes.index):
            self.doubts.setdefault(
                "order",
                f"{self.where}, line {bone.line}: {bone.name!r} lists its angles in the order "
                f"{''.join(listed).upper()} and its axes as {bone.axes.upper()}; they are applied in "
                f"the order of the {'angles' if bone.name == ROOT else 'axes'}.",
            )

    def _axis(self, number: int, bone: Bone, words: list[str]) -> None:
        if words and _AXES.fullmatch(words[-1]):
            bone.axes = self._axes(number, words.pop())
        bone.axis = self._numbers(number, "axis", words, 3)
        if bone.axes != "xyz" and np.count_nonzero(bone.axis) > 1:
            self.doubts.setdefault(
                "axis",
                f"{self.where}, line {number}: the axes of {bone.name!r} are turned in the order "
                f"{bone.axes.upper()}; the numbers before it are taken as angles about x, y and z.",
            )

    def _axes(self, number: int, word: str) -> str:
        if sorted(word.lower()) != ["x", "y", "z"]:
            self.fail(number, f"{word[:20]!r} is no order of axes", "write one as XYZ")
        return word.lower()

    def _dof(self, number: int, words: list[str]) -> list[str]:
        listed = [word.lower() for word in words]
        for word in listed:
            if word not in _DOF:
                self.fail(number, f"{word[:20]!r} is no degree of freedom", f"use {' '.join(_DOF)}")
        if len(set(listed)) < len(listed):
            self.fail(number, "a degree of freedom is listed twice", "list each at most once")
        return listed

    def _numbers(self, number: int, key: str, words: list[str], count: int) -> list[float]:
        for word in words[:count]:
            if not is_number(word):
                self.fail(number, f"{word[:20]!r} is not a number", hint(word))
        if len(words) != count:
            needed = f"it needs {'one' if count == 1 else 'three'}"
            self.fail(number, f"{key!r} is followed by {len(words)} numbers", needed)
        return [float(word) for word in words]

    def _sorted(self) -> tuple[dict[str, Bone], list[int]]:
        """Bones, parents before children, and the indices of their parents."""
        if len(self._bones) == 1:
            self.fail(1, "there is no bone in :bonedata", "export the skeleton again")
        order, waiting = [], [ROOT]
        while waiting:
            order.append(waiting.pop())
            waiting += reversed(self._children.get(order[-1], []))
        for name, bone in self._bones.items():
            if name not in order:
                what = f"bone {bone.name[:80]!r} does not hang on the root"
                self.fail(bone.line, what, "name it in :hierarchy behind its parent")
        if not self._root.dof:
            self.fail(1, "the :root section has no 'order'", "add 'order TX TY TZ RX RY RZ'")
        parents = [order.index(self._parent[name]) if name != ROOT else -1 for name in order]
        return {name: self._bones[name] for name in order}, parents


def parse_skeleton(data: bytes, where) -> AcclaimSkeleton:
    """The skeleton in the bytes of an ``.asf`` file; `where` is what errors call it."""
    return AcclaimSkeleton(decode(data, where, "Acclaim", AmcError), where)
