"""Raters made by a program, of whom the truth is known: to try an analysis before anybody is asked.

What they answer is marked in every file, and `read_answers` never takes it for people's.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.special import expit
from scipy.stats import norm

from ..errors import StudyError
from .answers import to_text
from .study import PAIRS, Study

CUTS = np.array([1.5, 2.5, 3.5, 4.5])  # between ratings, on the scale of what is felt
RATER, TASTE, NOISE = (
    0.5,
    0.3,
    0.8,
)  # standard deviations: of raters, of their tastes, of each answer
TIES = 0.3  # share of "no difference" where two methods are equal


def ratings(
    felt: np.ndarray, method: np.ndarray, raters: int, rng: np.random.Generator
) -> np.ndarray:
    """Ratings (raters, clips) from 1 to 5 of clips that are `felt` (clips,) so, on the scale of ratings.

    A rater is milder or stricter than others, likes a method more or less, and wavers.
    """
    mild = rng.normal(0, RATER, (raters, 1))
    taste = rng.normal(0, TASTE, (raters, int(method.max()) + 1))[:, method]
    seen = felt + mild + taste + rng.normal(0, NOISE, (raters, len(felt)))
    return 1 + np.searchsorted(CUTS, seen)


def expected(felt: np.ndarray) -> np.ndarray:
    """The mean rating, over all raters there could be, of what is `felt` so: the truth of `ratings`."""
    sd = np.sqrt(RATER**2 + TASTE**2 + NOISE**2)
    return 1 + norm.cdf((np.asarray(felt)[..., None] - CUTS) / sd).sum(-1)


def choices(
    apart: np.ndarray, raters: int, rng: np.random.Generator, ties: float = TIES
) -> np.ndarray:
    """Answers (raters, items) to pairs whose strengths lie `apart` (items,): 1 first, 0 second, 0.5 neither.

    They are taken so that wins and half of the ties add up to logistic(apart), as Bradley-Terry has it.
    """
    chance = expit(apart)
    neither = 4 * ties * chance * (1 - chance)
    drawn = rng.random((raters, len(apart)))
    first = chance - neither / 2
    return np.where(drawn < first, 1.0, np.where(drawn < first + neither, 0.5, 0.0))


def write_answers(
    study: Study,
    folder: Path,
    felt: Mapping[str, float],
    *,
    raters: int = 25,
    careless: float = 0.1,
    seed: int = 0,
) -> list[Path]:
    """Write files of simulated answers to a study.

    felt : how good each method is: on the scale of ratings, or as a strength for pairs.
    careless : share of raters who answer anything, and so fail checks.

    Raises
    ------
    StudyError : a method has no value, or a number makes no sense.
    """
    if set(felt) != set(study.methods):
        raise StudyError(f"felt must have a value for each of {', '.join(study.methods)}.")
    if raters < 1 or not 0 <= careless <= 1:
        raise StudyError("raters must be 1 or more, careless a share from 0 to 1.")
    rng = np.random.default_rng([seed, 1])
    of = study.method_of()
    judged = [item for item in study.items if item.asks is None]
    number = {method: i for i, method in enumerate(study.methods)}
    good = [[felt[of[clip]] for clip in item.clips] for item in judged]
    if study.design == PAIRS:
        won = choices(np.array([a - b for a, b in good]), raters, rng)
    else:
        method = np.array([number[of[item.clips[0]]] for item in judged])
        won = ratings(np.array([g[0] for g in good]), method, raters, rng)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for rater in range(raters):
        order = rater % len(study.orders)
        values = {i.id: _value(study, order, v) for i, v in zip(judged, won[rater], strict=True)}
        values |= {i.id: i.asks for i in study.items if i.asks is not None}
        if rng.random() < careless:
            values = {name: int(rng.choice(study.values)) for name in values}
        files.append(folder / f"simulated_{rater:05d}.json")
        body = _body(study, f"simulated-{seed}-{rater}", order, values, seed)
        files[-1].write_text(to_text(body), encoding="utf-8")
    return files


def _value(study: Study, order: int, won: float) -> int:
    """What is pressed: a rating, or the side on which what was taken stands in this order."""
    if study.design != PAIRS:
        return int(won)
    return 0 if won == 0.5 else 1 + int((won == 0) != (order % 2 == 1))


def _body(study: Study, rater: str, order: int, values: dict[str, int], seed: int) -> dict:
    step = round(1000 * (study.seconds + 2))  # milliseconds an item
    names = [study.items[number].id for number in study.orders[order]]
    answers = [
        {
            "item": name,
            "value": values[name],
            "plays": 1,
            "shown": k * step,
            "answered": (k + 1) * step,
        }
        for k, name in enumerate(names)
    ]
    return {
        "study": study.id, "hash": study.hash, "rater": rater, "order": order, "simulated": True,
        "generator": {"by": "motionlab.studies.simulate", "seed": seed}, "agreed": 0,
        "saved": len(names) * step, "answers": answers,
    }  # fmt: skip


def spaced(study: Study) -> dict[str, float]:
    """Values for `felt`, evenly apart in the order of the methods' names: something to be found."""
    low, high = (-0.6, 0.6) if study.design == PAIRS else (2.6, 3.8)
    return dict(
        zip(study.methods, np.linspace(low, high, len(study.methods)).tolist(), strict=True)
    )


def differences_of(felt: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """The truth of every two methods compared: of ratings, in points."""
    true = {method: float(expected(np.array(value))) for method, value in felt.items()}
    return {(a, b): true[a] - true[b] for a, b in combinations(sorted(true), 2)}


def in_order(
    felt: np.ndarray,
    orders: np.ndarray,
    rng: np.random.Generator,
    *,
    contrast: float = 0.0,
    tired: float = 0.0,
    hoped: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Ratings (raters, clips) from 1 to 5 by people whom the order moves, as it does move people.

    Parameters
    ----------
    felt : (clips,) how good each is, on the scale of ratings.
    orders : (raters, clips) numbers of the clips as each rater sees them.
    contrast : share of how much better than the mean the clip before was, that is taken off.
    tired : points that are taken off the last clip, and of those between a part.
    hoped : (clips,) points added because a rater knows who made it: 0 if the study is blind.
    """
    raters, clips = orders.shape
    before = np.concatenate([np.zeros((raters, 1)), felt[orders[:, :-1]] - felt.mean()], axis=1)
    late = np.linspace(0, 1, clips) if clips > 1 else np.zeros(1)
    moved = np.empty((raters, clips))
    np.put_along_axis(moved, orders, -contrast * before - tired * late, axis=1)
    mild = rng.normal(0, RATER, (raters, 1))
    seen = felt + hoped + moved + mild + rng.normal(0, NOISE, (raters, clips))
    return 1 + np.searchsorted(CUTS, seen)
