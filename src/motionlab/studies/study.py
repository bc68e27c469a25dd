"""What a study is: its clips, its questions, its orders, and the rules by which answers count.

All of it stands in one file, the key, which whoever runs the study keeps. The page that raters see
holds everything but which clip is of which method; names and places in its lists are drawn.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import StudyError
from .order import orders

FORMAT, VERSION = "motionlab-study", 1
RATINGS, PAIRS = "ratings", "pairs"
VALUES = {RATINGS: (1, 2, 3, 4, 5), PAIRS: (0, 1, 2)}  # of pairs: no difference, left, right
BIGGEST = 200_000_000  # bytes of a study's file


@dataclass(frozen=True)
class Clip:
    """One motion: its name in the page tells nothing; `sha256` is of what the page plays."""

    id: str
    method: str
    gait: str
    file: str
    sha256: str


@dataclass(frozen=True)
class Item:
    """One thing to judge: a clip, a pair of clips (as they stand left and right in even orders), or an
    attention check, which asks for one answer."""

    id: str
    clips: tuple[str, ...] = ()
    asks: int | None = None


@dataclass(frozen=True)
class Rules:
    """When a rater's answers count; fixed when the study is built, and so before anybody answers."""

    failed_checks: int = 0
    """Most attention checks that may be answered otherwise than asked."""
    same_answer: float = 0.95
    """Largest share of clips that may have got one and the same answer."""

    @property
    def _checks(self) -> str:
        if not self.failed_checks:
            return "an attention check"
        return f"more than {self.failed_checks} attention check{'s' * (self.failed_checks > 1)}"

    def in_words(self) -> list[str]:
        """Each rule as a sentence."""
        return [
            "Only whole answers count: every item judged, each after it was seen to its end.",
            f"Left out is who answers {self._checks} otherwise than asked.",
            f"Left out is who gives one and the same answer to more than {self.same_answer:.0%} of the "
            "clips.",
            "Of several files of one rater the first that is whole counts.",
        ]


@dataclass(frozen=True)
class Study:
    """A study of how motions look. `hash` commits to all of it, and stands in the page and in answers."""

    title: str
    design: str
    methods: tuple[str, ...]
    gaits: tuple[str, ...]
    clips: tuple[Clip, ...]
    items: tuple[Item, ...]
    orders: tuple[tuple[int, ...], ...]
    seed: int
    fps: float
    seconds: float
    replays: int
    rules: Rules = field(default_factory=Rules)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the study's content, 64 hexadecimal digits."""
        text = json.dumps(self._content(), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def id(self) -> str:
        """A short name of this very study: the beginning of its hash."""
        return self.hash[:12]

    @property
    def values(self) -> tuple[int, ...]:
        """What may be answered."""
        return VALUES[self.design]

    def method_of(self) -> dict[str, str]:
        """Which method made a clip, by the clip's name."""
        return {clip.id: clip.method for clip in self.clips}

    def sides(self, order: int, item: Item) -> tuple[str, ...]:
        """The clips of an item as rater `order` sees them, left first: odd orders see them exchanged."""
        return item.clips[::-1] if order % 2 else item.clips

    def _content(self) -> dict[str, Any]:
        return json.loads(json.dumps(asdict(self)))

    def to_json(self) -> str:
        """The key: the whole study, for whoever runs it."""
        whole = {"format": FORMAT, "version": VERSION, "hash": self.hash, **self._content()}
        return json.dumps(whole, indent=1, ensure_ascii=False)

    def for_raters(self) -> dict[str, Any]:
        """What the page may know: neither methods nor gaits, nor files."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "id": self.id,
            "hash": self.hash,
            "title": self.title,
            "design": self.design,
            "items": [{"id": i.id, "clips": list(i.clips), "asks": i.asks} for i in self.items],
            "orders": [list(order) for order in self.orders],
            "seconds": self.seconds,
            "replays": self.replays,
        }


def read_study(path: Path) -> Study:
    """The study in a key file that `Study.to_json` wrote.

    Raises
    ------
    StudyError : the file is absent, damaged, none of a study, or was changed since it was built.
    """
    whole = _json_of(path)
    if not isinstance(whole, dict) or whole.get("format") != FORMAT:
        raise StudyError(f"{path}: is no study; name the .json that `motionlab study build` wrote.")
    if whole.get("version") != VERSION:
        raise StudyError(f"{path}: is of version {whole.get('version')!r}; this reads {VERSION}.")
    try:
        study = _study_of(whole)
    except (KeyError, TypeError, ValueError) as error:
        raise StudyError(f"{path}: the study is damaged ({error!r}); take a copy of it.") from error
    if study.hash != whole.get("hash"):
        raise StudyError(
            f"{path}: was changed after it was built, as its hash tells; what was fixed before "
            "anybody answered must stay as it was. Take the file as it was written."
        )
    return study


def _json_of(path: Path) -> Any:
    if path.suffix.lower() in (".html", ".htm"):
        raise StudyError(
            f"{path}: is the page that raters see, which does not know which clip is of which method; "
            f"name the key that was written beside it, {path.with_suffix('.json')}."
        )
    try:
        if path.stat().st_size > BIGGEST:
            raise StudyError(f"{path}: is larger than any study.")
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StudyError(
            f"{path}: can't be read ({error.strerror}); name a study's .json."
        ) from error
    except (ValueError, RecursionError) as error:
        raise StudyError(f"{path}: is cut or damaged ({error}); take a copy of it.") from error


def _study_of(whole: dict[str, Any]) -> Study:
    fields = {name: whole[name] for name in Study.__dataclass_fields__}
    fields["methods"], fields["gaits"] = tuple(whole["methods"]), tuple(whole["gaits"])
    fields["clips"] = tuple(Clip(**clip) for clip in whole["clips"])
    fields["items"] = tuple(
        Item(item["id"], tuple(item["clips"]), item["asks"]) for item in whole["items"]
    )
    fields["orders"] = tuple(tuple(order) for order in whole["orders"])
    fields["rules"] = Rules(**whole["rules"])
    if fields["design"] not in VALUES:
        raise ValueError(f"design {fields['design']!r}")
    return Study(**fields)


def plan(
    clips: Sequence[Clip], design: str, seed: int, checks: int
) -> tuple[tuple[Item, ...], tuple[tuple[int, ...], ...]]:
    """The items of a study and the orders in which raters see them.

    clips : as many of each method in each gait.
    design : "ratings" takes each clip by itself; "pairs" puts the n-th clip of each method beside the
        n-th of each other one, in the same gait.
    """
    methods = sorted({clip.method for clip in clips})
    items: list[tuple[str, ...]] = []
    groups = []
    for gait in sorted({clip.gait for clip in clips}):
        by = [[c.id for c in clips if (c.method, c.gait) == (m, gait)] for m in methods]
        rows = []
        for nth in zip(*by, strict=True):
            # which method stands left at first changes from clip to clip
            pairs = [p[:: 1 - 2 * (len(rows) % 2)] for p in combinations(nth, 2)]
            units = [(clip,) for clip in nth] if design == RATINGS else pairs
            rows.append(range(len(items), len(items) + len(units)))
            items += units
        groups.append(np.array([list(row) for row in rows]))
    draw = np.random.default_rng([seed, 2**32])
    place = draw.permutation(len(items))  # where an item stands in the list tells nothing either
    found = [Item(f"i{place[number]:04d}", unit) for number, unit in enumerate(items)]
    found.sort(key=lambda item: item.id)
    asks = [VALUES[design][int(draw.integers(len(VALUES[design])))] for _ in range(checks)]
    found += [Item(f"check{k + 1}", asks=value) for k, value in enumerate(asks)]
    place = [*place.tolist(), *range(len(items), len(found))]
    sequences = orders(groups, range(len(items), len(found)), seed)
    return tuple(found), tuple(tuple(place[i] for i in order) for order in sequences)
