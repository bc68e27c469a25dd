"""An Acclaim motion file, ``.amc``: for every frame its number, then a row of values for each bone."""

from __future__ import annotations

import re
from typing import NoReturn

import numpy as np

from ..errors import AmcError
from .acclaim_skeleton import ROOT, AcclaimSkeleton
from .bvh_text import decode, hint, is_number, last_line

# How many frames a second, if nobody says so: as nearly all of CMU's recordings have.
USUAL = 120.0
_OTHER = "name the .asf file that belongs to it, as skeleton="
_NUMBERS = re.compile(r"[0-9eE+\-. ]*")
_LARGEST = 1e12
_Row = tuple[int, int, list[str]]  # frame, line, the bone's name and its values


class AcclaimFrames:
    """What a motion file says.

    Attributes
    ----------
    values : of each bone by its name in lower case (frames, degrees of freedom), angles in degrees.
    dof : of each of these bones what its columns are.
    frames : how many there are.
    rate : frames per second, as the file says or as is usual.
    doubts : what to say of what is not as it should be.
    """

    def __init__(self, text: str, where, skeleton: AcclaimSkeleton) -> None:
        self.where, self.skeleton = where, skeleton
        self.doubts: dict[str, str] = {}
        self.dof = {name: bone.dof for name, bone in skeleton.bones.items()}
        self.rate = 0.0
        self._radians = skeleton.radians
        self._starts: list[tuple[int, int]] = []  # number and line of each frame
        rows = self._rows(text)
        if not self._starts:
            self.fail(last_line(text), "there is no frame", "it is cut off, or no .amc file")
        self.frames = len(self._starts)
        self._check_whole(rows)
        self._rate()
        self.values = {name: self._values(name, rows[name]) for name in rows if rows[name]}

    def fail(self, number: int, what: str, remedy: str) -> NoReturn:
        raise AmcError(f"{self.where}, line {number}: {what}; {remedy}.")

    def _rows(self, text: str) -> dict[str, list[_Row]]:
        """The rows of each bone, in the order of the file."""
        rows: dict[str, list[_Row]] = {name: [] for name in self.skeleton.bones}
        known = dict(rows)  # by all spellings of a name
        frame = -1
        for number, line in enumerate(text.split("\n"), start=1):
            words = line.split()
            if not words:
                continue
            if "#" in line:
                words = line.partition("#")[0].split()
            key = words[0] if words else "#"
            if key in known and frame >= 0:
                known[key].append((frame, number, words))
            elif len(words) == 1 and key.isdecimal() and key.isascii() and len(key) < 10:
                frame += 1
                self._starts.append((int(key), number))
            elif key.startswith(":"):
                self._header(number, key.upper(), words[1:])
            elif key != "#":
                known[key] = rows[self._named(number, key, frame)]
                known[key].append((frame, number, words))
        return rows

    def _header(self, number: int, key: str, words: list[str]) -> None:
        if self._starts:
            self.fail(number, f"{key[:30]!r} stands among the frames", "move it before the first")
        if key in (":DEGREES", ":RADIANS"):
            self._radians = key == ":RADIANS"
        elif key == ":FORCE-ALL-JOINTS-BE-3DOF":  # as a well-known player writes
            self.dof |= {name: ["rx", "ry", "rz"] for name in self.dof if name != ROOT}
        elif key == ":SAMPLES-PER-SECOND":
            word = words[0] if words else ""
            if not (is_number(word) and float(word) > 0):
                self.fail(number, f"{word[:20]!r} is no number of frames per second", hint(word))
            self.rate = float(word)

    def _named(self, number: int, key: str, frame: int) -> str:
        """The bone that a name means which is not spelt as in the skeleton file."""
        if is_number(key):
            self.fail(number, "there are values without a bone", "put each bone's in one line")
        if key.lower() not in self.skeleton.bones:
            file = self.skeleton.where
            self.fail(number, f"{key[:80]!r} is no bone of {file}", f"mend the line, or {_OTHER}")
        if frame < 0:
            self.fail(number, "a row stands before the first frame's number", "write 1 before it")
        return key.lower()

    def _check_whole(self, rows: dict[str, list[_Row]]) -> None:
        """That each bone has one row a frame, and what to say where it has none."""
        last, line = self.frames - 1, self._starts[-1][1]
        silent, holes = [], []
        for name, its in rows.items():
            where = [frame for frame, *_ in its]
            for (frame, number, _), before in zip(its[1:], where, strict=False):
                if frame == before:
                    self.fail(
                        number, f"{name!r} is there twice in a frame", "remove one of the two"
                    )
            if not its:
                silent += [name] if self.skeleton.bones[name].dof else []
            elif len(its) == last and where[-1] < last:
                what = f"the last frame, {self._starts[-1][0]}, has no row for {name!r}"
                self.fail(line, what, "the file is cut off: copy it again, or remove the frame")
            elif len(its) < self.frames:
                holes.append(name)
        if ROOT in silent:
            self.fail(line, "no frame has a row for 'root'", "export the motion with its root")
        if len(silent) > len(rows) // 2:
            self.fail(line, f"most bones of {self.skeleton.where} have no row", _OTHER)
        if silent:
            self.doubts["silent"] = f"no frame has a row for {', '.join(silent)}; they do not turn."
        if holes:
            self.doubts["holes"] = (
                f"some frames have no row for {', '.join(holes)[:200]}; there these bones keep the "
                "angles of the frame before."
            )

    def _rate(self) -> None:
        """Frames per second, from what the file says and how it numbers its frames."""
        said = bool(self.rate)
        self.rate = self.rate or USUAL
        numbers = np.array([number for number, _ in self._starts])
        steps = np.diff(numbers)
        if (steps <= 0).any():
            at = int(np.flatnonzero(steps <= 0)[0])
            what = f"frame {numbers[at + 1]} comes after frame {numbers[at]}"
            self.fail(self._starts[at + 1][1], what, "frames must ascend; put clips in files apart")
        if len(steps) and (steps == steps[0]).all() and steps[0] > 1:
            self.rate /= float(steps[0])
            self.doubts["rate"] = (
                f"frame numbers go up by {steps[0]}, so that it is read with {self.rate:g} frames "
                "per second; pass fps= to say so, or what is right."
            )
            return
        if not said:
            self.doubts["rate"] = (
                f"an .amc file does not say its frame rate; it is read with {USUAL:g} frames per "
                "second, as most of CMU's have: pass fps= to say so, or what is right."
            )
        if (steps == 1).all():
            return
        at = int(np.flatnonzero(steps > 1)[0])
        self.doubts["gaps"] = (
            f"line {self._starts[at + 1][1]}: frame {numbers[at + 1]} follows frame {numbers[at]}; "
            f"{int((steps - 1).sum())} frames are not there in all, and the motion jumps over them."
        )

    def _values(self, name: str, rows: list[_Row]) -> np.ndarray:
        """The values of a bone, (frames, degrees of freedom)."""
        dof = self.dof[name]
        for _, number, words in rows:
            if len(words) != len(dof) + 1:
                what = f"{len(words) - 1} values for {words[0][:80]!r}, which has {len(dof)}"
                file = f"{' '.join(dof) or 'no degree of freedom'} in {self.skeleton.where}"
                self.fail(number, f"{what} ({file})", f"the line is cut off, or {_OTHER}")
        flat = [word for *_, words in rows for word in words[1:]]
        try:
            if not _NUMBERS.fullmatch(" ".join(flat)):
                raise ValueError
            values = np.array(list(map(float, flat))).reshape(len(rows), len(dof))
            if not (np.abs(values) <= _LARGEST).all():
                raise ValueError
        except ValueError:
            self._explain(rows)
        if len(rows) < self.frames:
            frames = np.array([frame for frame, *_ in rows])
            values = values[np.maximum(frames.searchsorted(range(self.frames), "right") - 1, 0)]
        if self._radians:
            values[:, [kind[0] == "r" for kind in dof]] *= 180 / np.pi
        return values

    def _explain(self, rows: list[_Row]) -> NoReturn:
        """Raise an AmcError for the first value that is no number."""
        for _, number, words in rows:
            for place, word in enumerate(words[1:], start=1):
                if not is_number(word):
                    what = f"value {place} of {words[0][:80]!r}, {word[:20]!r}, is not a number or "
                    self.fail(number, what + "too large for one", hint(word))
        raise AssertionError("every value is a number")


def parse_frames(data: bytes, where, skeleton: AcclaimSkeleton) -> AcclaimFrames:
    """The frames in the bytes of an ``.amc`` file; `where` is what errors call it."""
    return AcclaimFrames(decode(data, where, "Acclaim", AmcError), where, skeleton)
