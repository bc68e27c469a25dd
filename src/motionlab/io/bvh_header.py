"""The header of a BVH file: which column holds what, and a hierarchy that pybvh accepts.

Exporters write keywords and channels in any case, leave channels out or add scale. All of it that
has one meaning is read; what is wrong is found here, with its line number. The tree itself is read
by pybvh, from the lines that `Tree` prepares.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from ..errors import BvhError
from .bvh_text import hint, is_number

_KEYWORDS = {"HIERARCHY", "MOTION", "ROOT", "JOINT", "END", "OFFSET", "CHANNELS"}
# Up to the first number a '#' or '//' that stands by itself starts a comment.
_COMMENT = re.compile(r"(^|\s)(#|//).*")
_SCALED = 1e-3  # a scale that is this near to one is one


@dataclass
class Tree:
    """One ROOT of a file and all that hangs on it.

    Attributes
    ----------
    joints : the line of each joint, by its name, in the order of the file.
    columns : pairs of a column's number in the rows, and what it holds: (joint, "position",
        "rotation" or "scale", axis 0 to 2).
    offsets : per joint its OFFSET, in the file's unit.
    orders : per joint the axes of its rotations, those that it has no channel for last.
    lines : pairs of line number in the file and line, one statement a line; each joint has three
        rotations, and the root alone positions.
    """

    joints: dict[str, int] = field(default_factory=dict)
    columns: list[tuple[int, tuple[int, str, int]]] = field(default_factory=list)
    offsets: list[list[float]] = field(default_factory=list)
    orders: list[str] = field(default_factory=list)
    lines: list[tuple[int, str]] = field(default_factory=list)

    @property
    def root(self) -> str:
        return next(iter(self.joints))

    def sort(self, values: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Columns to angles in the order of `orders`, and positions in x, y, z order.

        Returns angles (frames, joints, 3) in degrees, 0 about an axis without channel, and for each
        joint that has position channels its shifts (frames, 3) against its parent in the file's
        unit, OFFSET along an axis without channel.
        """
        where = {what: column for column, what in self.columns}
        turning = [
            where.get((joint, "rotation", "XYZ".index(axis)))
            for joint, order in enumerate(self.orders)
            for axis in order
        ]
        if None in turning:
            values = np.concatenate([values, np.zeros((len(values), 1))], axis=1)
            turning = [values.shape[1] - 1 if column is None else column for column in turning]
        angles = values[:, turning].reshape(len(values), -1, 3)
        shifts = {}
        for joint in sorted({joint for joint, kind, _ in where if kind == "position"}):
            xyz = [where.get((joint, "position", axis)) for axis in range(3)]
            shifts[joint] = values[:, [column or 0 for column in xyz]]
            for axis in (axis for axis in range(3) if xyz[axis] is None):
                shifts[joint][:, axis] = self.offsets[joint][axis]
        return angles, shifts

    def doubt_scale(self, values: np.ndarray) -> str | None:
        """What to say if joints are scaled: bones here have one length."""
        names = list(self.joints)
        for column, (joint, kind, _) in self.columns:
            if kind == "scale" and len(values):
                most = values[np.abs(values[:, column] - 1).argmax(), column]
                if abs(most - 1) > _SCALED:
                    return (
                        f"joint {names[joint]!r} is scaled, by {most:g} in one frame; scale is "
                        "left out: bake it in the program it comes from, if it matters."
                    )
        return None


class Layout:
    """What the header says.

    Attributes
    ----------
    trees : one for each ROOT.
    width : values in a row.
    frames : the frame count that the header declares, in line `frames_line`.
    time : line number and text of the frame time.
    """

    def __init__(self, header: list[str], where) -> None:
        self.where = where
        self.trees: list[Tree] = []
        self.width = 0
        self.frames: int | None = None
        self.frames_line = 0
        self.time = (1, "")
        self._missing: set[str] = set()  # what the block being read has yet to declare
        self._depth = 0
        motion = False
        for number, line in enumerate(header, start=1):
            if "#" in line or "//" in line:
                line = _COMMENT.sub("", line)
            # Braces may share a line with other statements.
            for statement in re.findall(r"[{}]|[^{}]+", line):
                words = statement.split()
                if not words:
                    continue
                key = words[0].upper()
                words[0] = key if key in _KEYWORDS else words[0]
                if key == "MOTION":
                    self._end_hierarchy(number, motion)
                    motion = True
                elif motion:
                    self._motion(number, words)
                else:
                    self._hierarchy(number, words)
        if self.frames is None:
            self.fail(len(header), "there is no 'Frames:' line", "add one before 'Frame Time:'")

    def fail(self, number: int, what: str, remedy: str) -> NoReturn:
        raise BvhError(f"{self.where}, line {number}: {what}; {remedy}.")

    def tree(self, root: str | None) -> Tree:
        """The tree of a ROOT, by its name; None if there is but one."""
        names = [tree.root for tree in self.trees]
        if root is None and len(names) == 1:
            return self.trees[0]
        line = self.trees[-1].joints[names[-1]]
        listed = ", ".join(name[:80] for name in names[:20])
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None and root in (None, twice):
            self.fail(
                line, f"several ROOTs are called {twice[:80]!r}", "rename all but one of them"
            )
        if root is None:
            self.fail(
                line,
                f"the file holds {len(names)} bodies, each with a ROOT: {listed}",
                f"say which to read, as root={names[0][:80]!r}",
            )
        if root not in names:
            self.fail(line, f"there is no ROOT {root!r}", f"root= must be one of: {listed}")
        return self.trees[names.index(root)]

    def _hierarchy(self, number: int, words: list[str]) -> None:
        if words[0] in (
            "ROOT",
            "JOINT",
            "END",
            "}",
        ):  # the block before is at its end, or goes deeper
            if "OFFSET" in self._missing:
                self.fail(number, "the block before this line has no OFFSET", "add what is missing")
            if "CHANNELS" in self._missing:  # a joint that stands still needs none
                self._missing.clear()
                still = " ".join(self._channels(number, ["0"]))
                self.trees[-1].lines.append((number, still))
        match words:
            case ["HIERARCHY"]:
                return
            case ["{"]:
                self._depth += 1
            case ["}"]:
                self._depth -= 1
                if self._depth < 0:
                    self.fail(number, "a '}' closes nothing", "remove it, or add the missing '{'")
            case ["ROOT" | "JOINT" as kind, *name]:
                words = [kind, self._name(number, kind, "_".join(name))]
                self._missing = {"OFFSET", "CHANNELS"}
            case ["END", *_]:
                words = ["End", "Site"]
                self._missing = {"OFFSET"}
            case ["OFFSET" | "CHANNELS" as key, *_] if key not in self._missing:
                self.fail(
                    number, f"this {key} is one too many", "a joint has one, at its beginning"
                )
            case ["OFFSET", *numbers]:
                self._missing.discard("OFFSET")
                self._offset(number, numbers)
            case ["CHANNELS", *listed]:
                self._missing.discard("CHANNELS")
                words = self._channels(number, listed)
            case _:
                self.fail(
                    number, f"{words[0][:20]!r} is no keyword of BVH", "remove or correct the line"
                )
        if not self.trees:
            self.fail(number, f"{words[0]!r} stands before ROOT", "the hierarchy starts with one")
        self.trees[-1].lines.append((number, " ".join(words)))

    def _name(self, number: int, kind: str, name: str) -> str:
        if not name:
            self.fail(number, "a joint has no name", "give it one")
        if kind == "JOINT" and self._depth == 0:
            self.fail(number, f"JOINT {name[:80]!r} hangs on no ROOT", "move it into its parent")
        if kind == "ROOT":
            if self._depth:
                self.fail(
                    number,
                    f"ROOT {name[:80]!r} hangs on a joint",
                    "make it a JOINT, or move it out",
                )
            self.trees.append(Tree())
        joints = self.trees[-1].joints
        if name in joints:
            self.fail(
                number,
                f"joint {name[:80]!r} is there twice (first in line {joints[name]})",
                "rename one of them",
            )
        joints[name] = number
        return name

    def _offset(self, number: int, words: list[str]) -> None:
        numbers = [self._number(number, word) for word in words]
        if len(numbers) != 3:
            self.fail(number, f"OFFSET has {len(numbers)} numbers", "it needs three")
        tree = self.trees[-1]
        if len(tree.offsets) < len(tree.joints):  # or it is an end site's
            tree.offsets.append(numbers)

    def _channels(self, number: int, listed: list[str]) -> list[str]:
        """Note the columns of the newest joint; return the statement as pybvh wants it."""
        declared, *names = listed or [""]
        if declared != str(len(names)):
            self.fail(
                number,
                f"CHANNELS says {declared[:20] or 'nothing'} and lists {len(names)} channels",
                "make the number match the list",
            )
        kinds = []
        for name in names:
            match = re.fullmatch(r"([xyz])(position|rotation|scale)", name.lower())
            if match is None:
                self.fail(number, f"unknown channel {name[:20]!r}", "use Xposition … Zrotation")
            kinds.append((match[2], "xyz".index(match[1])))
        if len(set(kinds)) < len(kinds):
            self.fail(number, "a channel is listed twice", "list each of them at most once")
        tree = self.trees[-1]
        joint = len(tree.joints) - 1
        tree.columns += [(self.width + i, (joint, *kind)) for i, kind in enumerate(kinds)]
        self.width += len(kinds)
        order = "".join("XYZ"[axis] for kind, axis in kinds if kind == "rotation")
        order += "".join(axis for axis in "ZXY" if axis not in order)
        tree.orders.append(order)
        # pybvh wants the root's positions first and as X, Y, Z, and none on inner joints.
        shift = [] if joint else ["Xposition", "Yposition", "Zposition"]
        return ["CHANNELS", str(len(shift) + 3), *shift, *(f"{axis}rotation" for axis in order)]

    def _end_hierarchy(self, number: int, again: bool) -> None:
        if again:
            self.fail(number, "there is a second MOTION", "remove one of the two")
        if self._depth:
            self.fail(number, f"{self._depth} '{{' are not closed", "close them before MOTION")
        if not self.trees:
            self.fail(number, "there is no ROOT", "the hierarchy needs one")

    def _motion(self, number: int, words: list[str]) -> None:
        line = " ".join(words)
        if time := re.fullmatch(r"frame ?time ?:? ?(.*)", line, re.IGNORECASE):
            self.time = (number, time[1])
        elif count := re.fullmatch(r"frames ?:? ?(.*)", line, re.IGNORECASE):
            if not re.fullmatch(r"[0-9]{1,9}", count[1]):
                self.fail(number, "'Frames:' is followed by no count", "write 'Frames: 120'")
            self.frames, self.frames_line = int(count[1]), number
        else:
            self.fail(
                number,
                f"{words[0][:20]!r} stands where 'Frames:' and 'Frame Time:' belong",
                "the numbers follow 'Frame Time:', and joints come before MOTION",
            )

    def _number(self, number: int, word: str) -> float:
        if not is_number(word):
            self.fail(number, f"{word[:20]!r} is not a number", hint(word))
        return float(word)
