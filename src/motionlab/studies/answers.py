"""What raters saved, read and checked: what can't be counted is named with the reason, and left out.

The checksum tells what was damaged or edited in passing. It is no seal: who knows how it is made can
make another, so take files from raters themselves.
"""

from __future__ import annotations

import json
import zlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import StudyError
from .study import FORMAT as STUDY_FORMAT
from .study import Study

FORMAT, VERSION = "motionlab-answers", 1
BIGGEST = 5_000_000  # bytes of a file of answers


@dataclass(frozen=True)
class Answers:
    """One rater's whole answers: a value for each item, and how each was come by."""

    rater: str
    order: int
    values: dict[str, int]
    plays: dict[str, int]
    seconds: dict[str, float]
    finished: int
    simulated: bool
    file: Path


@dataclass(frozen=True)
class LeftOut:
    """A file that does not count, and why; `rule`: by a rule of the study, though nothing is wrong with it."""

    file: Path
    why: str
    rule: bool = False


def to_text(body: dict[str, Any]) -> str:
    """A file of answers, as the page writes it but for its line breaks."""
    whole = {"format": FORMAT, "version": VERSION, "checksum": checksum(body), "body": body}
    return json.dumps(whole, ensure_ascii=False)


def checksum(body: Any) -> str:
    """CRC-32 of the body as JavaScript's JSON.stringify writes it, in eight hexadecimal digits."""
    text = json.dumps(body, separators=(",", ":"), ensure_ascii=False)
    return f"{zlib.crc32(text.encode()):08x}"


def read_answers(
    folder: Path, study: Study, *, simulated: bool = False
) -> tuple[list[Answers], list[LeftOut]]:
    """The answers in a folder that count, in the order of the names of their files, and what is left out.

    simulated : take the answers that a program made, and none of people; else the other way round.
        Both are never mixed.

    Raises
    ------
    StudyError : there is no such folder, or it can't be read.
    """
    try:
        files = sorted(file for file in folder.iterdir() if file.is_file())
    except OSError as error:
        raise StudyError(f"{folder}: is no folder that can be read ({error.strerror}).") from error
    found: list[Answers] = []
    out: list[LeftOut] = []
    for file in files:
        if file.name.startswith(".") or file.suffix.lower() in (".html", ".htm"):
            continue
        try:
            body = _body(file)
            if body is None:  # the study itself
                continue
            answers = _checked(body, study, file)
        except _Bad as why:
            out.append(LeftOut(file, str(why)))
            continue
        if answers.simulated != simulated:
            made = (
                "was made by a program, no person answered"
                if answers.simulated
                else "is a person's"
            )
            out.append(LeftOut(file, made))
        else:
            found.append(answers)
    kept, twice = _once(found)
    out += twice
    counted = []
    for answers in kept:
        broken = broken_rule(answers, study)
        if broken:
            out.append(LeftOut(answers.file, broken, rule=True))
        else:
            counted.append(answers)
    return counted, sorted(out, key=lambda left: left.file.name)


def broken_rule(answers: Answers, study: Study) -> str | None:
    """Which rule of the study leaves out these answers, in words."""
    asked = {item.id: item.asks for item in study.items if item.asks is not None}
    failed = sum(answers.values[name] != value for name, value in asked.items())
    if failed > study.rules.failed_checks:
        return f"{failed} of {len(asked)} attention checks answered otherwise than asked"
    judged = [value for name, value in answers.values.items() if name not in asked]
    value, most = Counter(judged).most_common(1)[0]
    if len(judged) > 2 and most > study.rules.same_answer * len(judged):
        return f"the same answer, {value}, to {most} of {len(judged)} clips"
    unseen = sum(plays < 1 for plays in answers.plays.values())
    return f"{unseen} clips were never played" if unseen else None


class _Bad(Exception):
    """Why a file can't be counted."""


def _body(file: Path) -> dict[str, Any] | None:
    """What a file of answers says, its checksum checked; None for a study's own file."""
    if file.suffix.lower() != ".json":
        raise _Bad("is no .json file")
    try:
        if file.stat().st_size > BIGGEST:
            raise _Bad("is larger than any file of answers")
        raw = file.read_bytes()
    except OSError as error:
        raise _Bad(f"can't be read ({error.strerror})") from error
    if not raw.strip():
        raise _Bad("is empty")
    try:
        whole = json.loads(raw.decode("utf-8"))
    except (ValueError, RecursionError):
        raise _Bad("is cut or damaged: it is not whole JSON") from None
    if isinstance(whole, dict) and whole.get("format") == STUDY_FORMAT:
        return None
    if not isinstance(whole, dict) or whole.get("format") != FORMAT:
        raise _Bad("is no file of answers")
    if whole.get("version") != VERSION:
        raise _Bad(f"is of version {whole.get('version')!r}; this reads {VERSION}")
    body = whole.get("body")
    try:
        right = isinstance(body, dict) and whole.get("checksum") == checksum(body)
    except (UnicodeEncodeError, ValueError, RecursionError):
        right = False
    if not right:
        raise _Bad("was changed after it was saved: its checksum is another one")
    return body


def _checked(body: dict[str, Any], study: Study, file: Path) -> Answers:
    """Answers that are whole and could have been given in this study."""
    if body.get("hash") != study.hash:
        raise _Bad(f"belongs to another study, {str(body.get('study'))[:40]!r}, not {study.id!r}")
    simulated, order, rater = body.get("simulated"), body.get("order"), body.get("rater")
    given = body.get("answers")
    if not isinstance(simulated, bool):
        raise _Bad("does not say whether a person answered")
    if not isinstance(rater, str) or not rater:
        raise _Bad("does not name its rater")
    if not _whole(order) or not 0 <= order < len(study.orders):
        raise _Bad(f"has the order {order!r}, which the study does not know")
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        raise _Bad("holds no list of answers")
    sequence = [study.items[number].id for number in study.orders[order]]
    names = [one.get("item") for one in given]
    if names != sequence[: len(names)]:
        raise _Bad("has answers in another order than its number says")
    if len(given) < len(sequence):
        raise _Bad(f"is not whole: {len(given)} of {len(sequence)} items are answered")
    for one in given:
        numbers = [one.get(name) for name in ("value", "plays", "shown", "answered")]
        if not all(map(_whole, numbers)) or one["value"] not in study.values:
            raise _Bad(f"has an answer to {one['item']} that nobody could give")
    return Answers(
        rater=rater,
        order=order,
        values={one["item"]: one["value"] for one in given},
        plays={one["item"]: one["plays"] for one in given},
        seconds={one["item"]: (one["answered"] - one["shown"]) / 1000 for one in given},
        finished=given[-1]["answered"],
        simulated=simulated,
        file=file,
    )


def _whole(number: Any) -> bool:
    return isinstance(number, int) and not isinstance(number, bool)


def _once(found: Iterable[Answers]) -> tuple[list[Answers], list[LeftOut]]:
    """Each rater once, by the file that was finished first."""
    first: dict[str, Answers] = {}
    out = []
    for answers in sorted(found, key=lambda one: (one.finished, one.file.name)):
        kept = first.setdefault(answers.rater, answers)
        if kept is not answers:
            alike = kept.values == answers.values
            what = "the same answers" if alike else "other answers"
            out.append(LeftOut(answers.file, f"has {what} of the same rater as {kept.file.name}"))
    return sorted(first.values(), key=lambda one: one.file.name), out
