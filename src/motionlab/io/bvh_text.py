"""The text of a BVH file: decoding, where its parts are, the rows of numbers.

What can be wrong with the text is found here, with its line number. Opening and decoding serve
Acclaim's files, too.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from itertools import accumulate
from pathlib import Path

import numpy as np
import pandas as pd

from ..errors import BvhError, MotionFileError

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# No position or angle is larger; beyond 3e38 float32 overflows.
_LARGEST = 1e12
_START = re.compile(r"(\s|(#|//)[^\n]*\n)*HIERARCHY\b", re.IGNORECASE)
_MOTION = re.compile(r"^[ \t]*MOTION\b", re.MULTILINE | re.IGNORECASE)
_TIME = re.compile(r"^[ \t]*Frame[ \t]*Time\b[^\n]*(?:\n|\Z)", re.MULTILINE | re.IGNORECASE)
# What may follow the frame time before the first row: its count, and comments.
_MORE = re.compile(r"([ \t]*(Frames\b|#|//)[^\n]*(?:\n|\Z)|[ \t]*\n)*", re.IGNORECASE)


def opened(path: str | os.PathLike, error: type[MotionFileError] = BvhError) -> bytes:
    """What is in a file; an error of the kind given if that can't be told."""
    if not isinstance(path, str | os.PathLike):
        raise error(f"{path!r} is not a path; give the file to read.")
    try:
        return Path(path).read_bytes()
    except (OSError, ValueError) as fault:  # ValueError: a path with a zero byte
        reason = getattr(fault, "strerror", None) or fault
        raise error(f"{path}: can't be opened ({reason}); check path and rights.") from fault


def decode(data: bytes, where, kind: str = "BVH", error: type[MotionFileError] = BvhError) -> str:
    """Text of a file in UTF-8, UTF-16 with its mark, or Latin-1; line ends as \\n.

    kind, error : what the file should be, and the error if it is not.
    """
    if not data.strip():
        raise error(f"{where}, line 1: the file is empty; copy or download it again.")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if "\x1a" in text[-80:]:  # Ctrl-Z, how DOS ended its texts
        text = text.rstrip("\x1a \t\n") + "\n"
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise error(f"{where}, line {line}: binary data, not {kind} text; export or copy it again.")
    return text


def split(text: str, where) -> tuple[list[str], int]:
    """Header lines up to the first row of numbers, and the offset of that."""
    if not _START.match(text):
        remedy = (
            "read it with read_amc" if str(where).lower().endswith(".amc") else "export it as BVH"
        )
        raise BvhError(
            f"{where}, line 1: a BVH file starts with HIERARCHY, this one with "
            f"{text.lstrip()[:20]!r}; {remedy}."
        )
    motion = _MOTION.search(text)
    if motion is None:
        raise BvhError(
            f"{where}, line {text.count(chr(10)) + 1}: ends before a MOTION section; "
            "the file is cut off, copy or export it again."
        )
    time = _TIME.search(text, motion.end())
    if time is None:
        raise BvhError(
            f"{where}, line {text.count(chr(10), 0, motion.start()) + 1}: the MOTION section has "
            "no 'Frame Time:' line; add one, for example 'Frame Time: 0.0333333'."
        )
    end = _MORE.match(text, time.end()).end()
    return text[:end].rstrip("\n").split("\n"), end


def parse_rows(text: str, start: int, columns: int, frames: int, where) -> np.ndarray:
    """The MOTION section's numbers, (rows, columns), all rows that there are.

    frames : how many are declared; rows that are wrapped over several lines must be as many.
    """
    rows = text[start:]
    first = re.search(r"\S.*", rows)
    # pandas pads short rows, which a small file could have very many of, and it reads True and
    # False as 1 and 0: look before it does.
    too_short = rows.count("\n") * columns > len(rows)
    words = any(letter in rows for letter in "uUlL")
    comments = "/" in rows or "#" in rows  # one letter is found sooner than two
    if first and (len(_words(first[0])) != columns or too_short or words or comments):
        mended = _one_row_a_line(rows, columns, frames)
        if mended is None:
            _explain_rows(text, start, columns, where)
        rows = rows if mended is None else mended
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
    return values


def last_line(text: str) -> int:
    """Number of the last line that is not blank."""
    return text.count("\n", 0, len(text.rstrip())) + 1


def _one_row_a_line(rows: str, columns: int, frames: int) -> str | None:
    """The rows without comment lines, each in one line where exporters wrapped them.

    None if that does not make as many whole rows of numbers as are declared.
    """
    lines = [_words(line) for line in rows.split("\n") if not re.match(r"[ \t]*(#|//)", line)]
    lines = [line for line in lines if line]
    words = [word for line in lines for word in line]
    ends = set(accumulate(len(line) for line in lines))
    starts = range(0, len(words), columns)
    # a row that ends within a line is no wrapped one: a value is missing, or one too many
    if not ends.issuperset(start + columns for start in starts) or not all(map(is_number, words)):
        return None
    if len(starts) != frames and max(map(len, lines), default=columns) < columns:
        return None
    return "\n".join(" ".join(words[start : start + columns]) for start in starts)


def _explain_rows(text: str, start: int, columns: int, where) -> None:
    """Raise a BvhError for the first bad row."""
    first = text.count("\n", 0, start) + 1
    for number, line in enumerate(text[start:].split("\n"), start=first):
        words = _words(line)
        for column, word in enumerate(words, start=1):
            if not is_number(word):
                raise BvhError(
                    f"{where}, line {number}: value {column}, {word[:20]!r}, is not a number or "
                    f"too large for one; {hint(word)}, or remove the frame."
                )
        if words and len(words) != columns:
            raise BvhError(
                f"{where}, line {number}: {len(words)} values for {columns} channels; the row is "
                "cut off or CHANNELS is wrong: copy or export the file again."
            )


def _words(line: str) -> list[str]:
    return re.findall(r"[^ \t]+", line)


def is_number(word: str) -> bool:
    return bool(_NUMBER.fullmatch(word)) and math.fabs(float(word)) <= _LARGEST


def hint(word: str) -> str:
    return "write a decimal point" if "," in word else "put a number there"
