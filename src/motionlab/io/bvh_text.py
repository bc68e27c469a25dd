"""The text of a BVH file: decoding, the header's layout, the rows of numbers.

What can be wrong with the text is found here, with its line number. The tree itself is read by
pybvh from the header that `Layout` prepares.
"""

from __future__ import annotations

import csv
import io
import math
import re
from typing import NoReturn

import numpy as np
import pandas as pd

from ..errors import BvhError

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# No position or angle is larger; beyond 3e38 float32 overflows.
_LARGEST = 1e12
_FRAME_TIMES = (1e-6, 1e3)


def decode(data: bytes, where) -> str:
    """Text of a file in UTF-8, UTF-16 with its mark, or Latin-1; line ends as \\n."""
    if not data.strip():
        raise BvhError(f"{where}, line 1: the file is empty; copy or download it again.")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise BvhError(f"{where}, line {line}: binary data, not BVH text; export or copy it again.")
    return text


def split(text: str, where) -> tuple[list[str], int]:
    """Header lines up to and with ``Frame Time:``, and the offset of the first row of numbers."""
    if not text.lstrip().startswith("HIERARCHY"):
        raise BvhError(
            f"{where}, line 1: a BVH file starts with HIERARCHY, this one with "
            f"{text.lstrip()[:20]!r}; export it as BVH."
        )
    motion = re.search(r"^[ \t]*MOTION\b", text, re.MULTILINE)
    if motion is None:
        raise BvhError(
            f"{where}, line {text.count(chr(10)) + 1}: ends before a MOTION section; "
            "the file is cut off, copy or export it again."
        )
    time = re.compile(r"^[ \t]*Frame[ \t]+Time:[^\n]*(?:\n|\Z)", re.MULTILINE).search(
        text, motion.end()
    )
    if time is None:
        raise BvhError(
            f"{where}, line {text.count(chr(10), 0, motion.start()) + 1}: the MOTION section has "
            "no 'Frame Time:' line; add one, for example 'Frame Time: 0.0333333'."
        )
    return text[: time.end()].rstrip("\n").split("\n"), time.end()


class Layout:
    """Which column holds what, and a hierarchy that pybvh accepts.

    Attributes
    ----------
    joints : the line of each joint, by its name, in the order of the file.
    columns : per column (joint, "position" or "rotation", axis 0 to 2).
    frames : the frame count that the header declares.
    hierarchy : pairs of line number in the file and line, one statement a line; inner joints have
        lost their position channels.
    """

    def __init__(self, header: list[str], where) -> None:
        self.where = where
        self.joints: dict[str, int] = {}
        self.columns: list[tuple[int, str, int]] = []
        self.frames: int | None = None
        self.hierarchy: list[tuple[int, str]] = []
        self._frame_time = (1, "")
        self._missing: set[str] = set()  # what the block being read has yet to declare
        self._depth = 0
        motion = False
        for number, line in enumerate(header, start=1):
            # Braces may share a line with other statements.
            for statement in re.findall(r"[{}]|[^{}]+", line):
                words = statement.split()
                if not words:
                    continue
                if words[0] == "MOTION":
                    self._end_hierarchy(number, motion)
                    motion = True
                elif motion:
                    self._motion(number, words)
                else:
                    self._hierarchy(number, words)
        if self.frames is None:
            self._fail(len(header), "there is no 'Frames:' line", "add one before 'Frame Time:'")

    def _fail(self, number: int, what: str, remedy: str) -> NoReturn:
        raise BvhError(f"{self.where}, line {number}: {what}; {remedy}.")

    def _hierarchy(self, number: int, words: list[str]) -> None:
        if self._missing and words[0] in ("ROOT", "JOINT", "End", "}"):
            lacking = " and no ".join(sorted(self._missing))
            self._fail(
                number, f"the block before this line has no {lacking}", "add what is missing"
            )
        match words:
            case ["HIERARCHY"]:
                pass
            case ["{"]:
                self._depth += 1
            case ["}"]:
                self._depth -= 1
                if self._depth < 0:
                    self._fail(number, "a '}' closes nothing", "remove it, or add the missing '{'")
            case ["ROOT" | "JOINT" as kind, *name]:
                words = [kind, self._name(number, "_".join(name))]
                self._missing = {"OFFSET", "CHANNELS"}
            case ["End", *_]:
                words = ["End", "Site"]
                self._missing = {"OFFSET"}
            case ["OFFSET" | "CHANNELS" as key, *_] if key not in self._missing:
                self._fail(
                    number, f"this {key} is one too many", "a joint has one, at its beginning"
                )
            case ["OFFSET", *numbers]:
                self._missing.discard("OFFSET")
                if len([self._number(number, word) for word in numbers]) != 3:
                    self._fail(number, f"OFFSET has {len(numbers)} numbers", "it needs three")
            case ["CHANNELS", *listed]:
                self._missing.discard("CHANNELS")
                words = self._channels(number, listed)
            case _:
                self._fail(
                    number, f"{words[0][:20]!r} is no keyword of BVH", "remove or correct the line"
                )
        self.hierarchy.append((number, " ".join(words)))

    def _name(self, number: int, name: str) -> str:
        if not name:
            self._fail(number, "a joint has no name", "give it one")
        if name in self.joints:
            self._fail(
                number,
                f"joint {name[:80]!r} is there twice (first in line {self.joints[name]})",
                "rename one of them",
            )
        self.joints[name] = number
        return name

    def _channels(self, number: int, listed: list[str]) -> list[str]:
        """Note the columns of the newest joint; return the statement as pybvh wants it."""
        declared, *names = listed or [""]
        if declared != str(len(names)):
            self._fail(
                number,
                f"CHANNELS says {declared[:20] or 'nothing'} and lists {len(names)} channels",
                "make the number match the list",
            )
        kinds = []
        for name in names:
            match = re.fullmatch(r"([XYZ])(position|rotation)", name)
            if match is None:
                self._fail(number, f"unknown channel {name[:20]!r}", "use Xposition … Zrotation")
            kinds.append((match[2], "XYZ".index(match[1])))
        if len(set(kinds)) < len(kinds):
            self._fail(number, "a channel is listed twice", "list each of the six at most once")
        positions = sum(kind == "position" for kind, _ in kinds)
        if positions not in (0, 3) or len(kinds) - positions != 3:
            self._fail(
                number,
                f"the joint has {positions} position and {len(kinds) - positions} rotation "
                "channels",
                "a joint needs three rotations, and either no positions or three",
            )
        joint = len(self.joints) - 1
        self.columns += [(joint, kind, axis) for kind, axis in kinds]
        # pybvh wants the root's positions first and as X, Y, Z, and none on inner joints.
        rotations = [name for name in names if name.endswith("rotation")]
        shift = [] if joint else ["Xposition", "Yposition", "Zposition"]
        return ["CHANNELS", str(len(shift) + 3), *shift, *rotations]

    def _end_hierarchy(self, number: int, again: bool) -> None:
        if again:
            self._fail(number, "there is a second MOTION", "remove one of the two")
        if self._depth:
            self._fail(number, f"{self._depth} '{{' are not closed", "close them before MOTION")
        if not self.joints:
            self._fail(number, "there is no ROOT", "the hierarchy needs one")

    def _motion(self, number: int, words: list[str]) -> None:
        match words:
            case ["Frames:", count] if re.fullmatch(r"[0-9]{1,9}", count):
                self.frames = int(count)
                if self.frames == 0:
                    self._fail(number, "the clip has no frames", "export it with at least one")
            case ["Frames:", *_]:
                self._fail(number, "'Frames:' is followed by no count", "write 'Frames: 120'")
            case ["Frame", "Time:", *rest]:
                self._frame_time = (number, " ".join(rest))
            case _:
                self._fail(
                    number,
                    f"{words[0][:20]!r} stands where 'Frames:' and 'Frame Time:' belong",
                    "the numbers follow 'Frame Time:', and joints come before MOTION",
                )

    def frame_time(self) -> float:
        """Seconds between two frames, as the header says."""
        number, word = self._frame_time
        value = self._number(number, word)
        if not _FRAME_TIMES[0] <= value <= _FRAME_TIMES[1]:
            self._fail(
                number,
                f"the frame time is {value:g} s",
                "put the seconds between two frames there, or read the file with fps=",
            )
        return value

    def _number(self, number: int, word: str) -> float:
        if not _is_number(word):
            self._fail(number, f"{word[:20]!r} is not a number", _hint(word))
        return float(word)

    def sort(self, values: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Columns to angles in file order and positions in x, y, z order.

        Returns angles (frames, joints, 3) in degrees, and for each joint that has position
        channels its shifts (frames, 3) against its parent in the file's unit.
        """
        turning = [i for i, (_, kind, _) in enumerate(self.columns) if kind == "rotation"]
        angles = values[:, turning].reshape(len(values), -1, 3)
        moving: dict[int, list[int]] = {}
        for i, (joint, kind, axis) in enumerate(self.columns):
            if kind == "position":
                moving.setdefault(joint, [0, 0, 0])[axis] = i
        return angles, {joint: values[:, xyz] for joint, xyz in moving.items()}


def parse_rows(text: str, start: int, columns: int, frames: int, where) -> np.ndarray:
    """The MOTION section's numbers, (frames, columns)."""
    rows = text[start:]
    first = re.search(r"\S.*", rows)
    # pandas pads short rows, which a small file could have very many of, and it reads True and
    # False as 1 and 0: look before it does.
    too_short = rows.count("\n") * columns > len(rows)
    words = any(letter in rows for letter in "uUlL")
    if first and (len(_words(first[0])) != columns or too_short or words):
        _explain_rows(text, start, columns, where)
    try:
        # reads numbers three times as fast as np.loadtxt
        values = pd.read_csv(
            io.StringIO(rows),
            sep=r"\s+",
            header=None,
            index_col=False,
            dtype=np.float64,
            engine="c",
            quoting=csv.QUOTE_NONE,
            na_filter=False,
            low_memory=False,
        ).to_numpy()
    except pd.errors.EmptyDataError:
        values = np.zeros((0, columns))
    except ValueError as error:
        _explain_rows(text, start, columns, where)
        line = text.count("\n", 0, start) + 1
        raise BvhError(f"{where}, line {line}: {error}; export the file again.") from error
    if not (np.abs(values) <= _LARGEST).all():
        _explain_rows(text, start, columns, where)
    if len(values) != frames:
        last = text.count("\n", 0, len(text.rstrip())) + 1
        raise BvhError(
            f"{where}, line {last}: the header declares {frames} frames and the file holds "
            f"{len(values)}; it is cut off or edited: copy it again, or correct 'Frames:'."
        )
    return values


def _explain_rows(text: str, start: int, columns: int, where) -> None:
    """Raise a BvhError for the first bad row."""
    first = text.count("\n", 0, start) + 1
    for number, line in enumerate(text[start:].split("\n"), start=first):
        words = _words(line)
        for column, word in enumerate(words, start=1):
            if not _is_number(word):
                raise BvhError(
                    f"{where}, line {number}: value {column}, {word[:20]!r}, is not a number or "
                    f"too large for one; {_hint(word)}, or remove the frame."
                )
        if words and len(words) != columns:
            raise BvhError(
                f"{where}, line {number}: {len(words)} values for {columns} channels; the row is "
                "cut off or CHANNELS is wrong: copy or export the file again."
            )


def _words(line: str) -> list[str]:
    return re.findall(r"[^ \t]+", line)


def _is_number(word: str) -> bool:
    return bool(_NUMBER.fullmatch(word)) and math.fabs(float(word)) <= _LARGEST


def _hint(word: str) -> str:
    return "write a decimal point" if "," in word else "put a number there"
