"""From answers to what they say: tables by gait, tests, agreement, and how many raters it would take."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from ..errors import StudyError
from .answers import Answers
from .pairs import Strength, bradley_terry
from .ratings import Difference, Mean, agreement, by_rater, differences, means, raters_needed
from .study import PAIRS, RATINGS, Study

ALL = "all gaits"


@dataclass(frozen=True)
class Table:
    """Of one gait, or of all: a row a method, and every two methods compared (Holm within the table)."""

    gait: str
    rows: tuple[Mean | Strength, ...]
    compared: tuple[Difference, ...]
    spread: float  # over raters, of the difference of two methods: root mean square over all pairs


@dataclass(frozen=True)
class Analysis:
    """What a study's answers say. `simulated`: a program answered, not people."""

    study: Study
    simulated: bool
    raters: int
    orders: dict[int, int]  # how many raters had which order
    seconds: float  # median from seeing an item to its answer
    tables: tuple[Table, ...]
    agreement: float
    needed: dict[str, int] = field(
        default_factory=dict
    )  # raters, by gait, for the wished difference
    difference: float | None = None

    def to_json(self) -> str:
        """Everything, with the study's hash; NaN becomes null."""
        from dataclasses import asdict

        tables = [
            {
                "gait": t.gait,
                "methods": {m: row._asdict() for m, row in zip(self.study.methods, t.rows, strict=True)},
                "compared": [
                    {**d._asdict(), "first": self.study.methods[d.first],
                     "second": self.study.methods[d.second]} for d in t.compared
                ],
                "spread": t.spread,
            }
            for t in self.tables
        ]  # fmt: skip
        whole = {
            "who": "simulated" if self.simulated else "people", "study": self.study.id,
            "hash": self.study.hash, "design": self.study.design, "rules": asdict(self.study.rules),
            "raters": self.raters, "orders": self.orders, "median_seconds": self.seconds,
            "agreement": self.agreement, "tables": tables, "difference": self.difference,
            "raters_needed": self.needed,
        }  # fmt: skip
        return json.dumps(_finite(whole), indent=1)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def analyse(
    study: Study, answers: Sequence[Answers], *, difference: float | None = None, seed: int = 0
) -> Analysis:
    """Analyse whole answers, as `read_answers` gives them.

    difference : that is to be told, for `needed`: points of the scale for ratings; for pairs by how
        much more than half of the time one method is taken, as 0.1 for six in ten.

    Raises
    ------
    StudyError : there are no answers, or people's and simulated ones are mixed.
    """
    if not answers:
        raise StudyError("there are no answers to analyse.")
    if len({one.simulated for one in answers}) > 1:
        raise StudyError("people's answers and simulated ones can't be analysed together.")
    tables = _ratings(study, answers, seed) if study.design == RATINGS else _pairs(study, answers)
    pairs = max(1, len(study.methods) * (len(study.methods) - 1) // 2)
    needed = {}
    if difference is not None:
        needed = {
            t.gait: raters_needed(t.spread, difference, comparisons=pairs)
            for t in tables if t.spread > 0
        }  # fmt: skip
    taken = np.array([list(one.seconds.values()) for one in answers])
    return Analysis(
        study=study, simulated=answers[0].simulated, raters=len(answers),
        orders=dict(sorted(Counter(one.order for one in answers).items())),
        seconds=float(np.median(taken)), tables=tuple(tables),
        agreement=_agreement(study, answers), needed=needed, difference=difference,
    )  # fmt: skip


def _gaits(study: Study) -> list[str]:
    return [*study.gaits, *([ALL] if len(study.gaits) > 1 else [])]


def _judged(study: Study) -> list[tuple[str, tuple[str, ...], str]]:
    """Items that are no checks: name, methods as they stand in even orders, gait."""
    by = {clip.id: clip for clip in study.clips}
    return [
        (item.id, tuple(by[c].method for c in item.clips), by[item.clips[0]].gait)
        for item in study.items if item.asks is None
    ]  # fmt: skip


def _ratings(study: Study, answers: Sequence[Answers], seed: int) -> list[Table]:
    judged = _judged(study)
    values = np.array([[one.values[name] for name, *_ in judged] for one in answers], dtype=float)
    number = {method: i for i, method in enumerate(study.methods)}
    method = np.array([number[methods[0]] for _, methods, _ in judged])
    gaits = np.array([gait for *_, gait in judged])
    tables = []
    for gait in _gaits(study):
        chosen = (gaits == gait) | (gait == ALL)
        part, of = values[:, chosen], method[chosen]
        scores = by_rater(part, of, len(number))
        compared = differences(scores, seed=seed)
        rows = means(part, of, len(number), seed=seed)
        tables.append(Table(gait, tuple(rows), tuple(compared), _spread(scores)))
    return tables


def _spread(scores: np.ndarray) -> float:
    """Standard deviation over raters of the difference of two columns, root mean square over pairs."""
    if len(scores) < 2 or scores.shape[1] < 2:
        return float("nan")
    apart = [scores[:, a] - scores[:, b] for a, b in combinations(range(scores.shape[1]), 2)]
    return float(np.sqrt(np.mean([np.var(one, ddof=1) for one in apart])))


def _taken(study: Study, one: Answers, name: str) -> float:
    """1 if the item's first clip, as even orders see it on the left, was taken; 0, or 0.5 for neither."""
    value = one.values[name]
    if value == 0:
        return 0.5
    return float((value == 1) != (one.order % 2 == 1))


def _pairs(study: Study, answers: Sequence[Answers]) -> list[Table]:
    judged = _judged(study)
    number = {method: i for i, method in enumerate(study.methods)}
    won = np.array([[_taken(study, one, name) for name, *_ in judged] for one in answers])
    first, second = (np.array([number[methods[i]] for _, methods, _ in judged]) for i in (0, 1))
    gaits = np.array([gait for *_, gait in judged])
    rater = np.arange(len(answers))
    tables = []
    for gait in _gaits(study):
        chosen = (gaits == gait) | (gait == ALL)
        a, b, part = first[chosen], second[chosen], won[:, chosen]
        long = (np.tile(a, len(answers)), np.tile(b, len(answers)), part.ravel())
        rows, compared = bradley_terry(*long, np.repeat(rater, len(a)), len(number))
        # for each two methods: how often each rater takes the one with the smaller number
        up = np.where(a < b, part, 1 - part)
        which = np.minimum(a, b) * len(number) + np.maximum(a, b)
        shares = np.stack([up[:, which == w].mean(1) for w in np.unique(which)], axis=1)
        spread = float(np.sqrt(shares.var(0, ddof=1).mean())) if len(shares) > 1 else float("nan")
        tables.append(Table(gait, tuple(rows), tuple(compared), spread))
    return tables


def _agreement(study: Study, answers: Sequence[Answers]) -> float:
    """Krippendorff's alpha over all items but checks."""
    names = [name for name, *_ in _judged(study)]
    if study.design == PAIRS:
        values = np.array([[_taken(study, one, name) for name in names] for one in answers])
        return agreement(values, ordinal=False)
    values = np.array([[one.values[name] for name in names] for one in answers], dtype=float)
    return agreement(values)
