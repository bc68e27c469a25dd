"""A study made of motions: clips drawn, brought to one length and one rate, and laid out."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from ..datasets import gaits
from ..errors import StudyError
from ..motion import Motion
from ..viewer.live.player import Track, floor_height, payload
from .study import PAIRS, RATINGS, VALUES, Clip, Rules, Study, plan

CLIPS = {RATINGS: 7, PAIRS: 3}  # of a method in a gait; RNN-GAN's study had seven to rate
SHORTEST = 1.0  # seconds
MOST_ITEMS = 400
SHADE = "#7d8894"  # of every body: colours stand for methods elsewhere
PRACTICE, CHECK = "practice", "check"  # clips that belong to no method


@dataclass(frozen=True)
class Source:
    """A motion that may become a clip: who made it, in which gait, and the file it came from."""

    motion: Motion
    method: str
    gait: str = "all"
    file: str = ""


@dataclass(frozen=True)
class Built:
    """A study, what its page plays, and what whoever builds it should know."""

    study: Study
    content: dict[str, Any]
    notes: tuple[str, ...]


def build(
    sources: Sequence[Source],
    *,
    title: str = "How do these motions look?",
    design: str = RATINGS,
    clips: int | None = None,
    seconds: float | None = None,
    replays: int = 2,
    checks: int = 2,
    contact: str = "",
    rules: Rules | None = None,
    seed: int = 0,
) -> Built:
    """Lay out a study: the same motions, seed and settings make the same study.

    Parameters
    ----------
    sources : motions, as many of each method in each gait as are to be drawn from.
    design : "ratings" from 1 to 5 of one clip at a time, or "pairs", side by side.
    clips : of each method in each gait; 7 for ratings, 3 for pairs, or as many as all have.
    seconds : length to which clips are cut; that of the shortest if left out.
    replays : how often a clip may be seen again.
    checks : items that ask for one answer, to find who does not look.
    contact : in words, to whom raters send their file and questions.

    Raises
    ------
    StudyError : there is nothing to compare, a method lacks a gait, or a number makes no sense.
    """
    if design not in VALUES:
        raise StudyError(f"design is {design!r}; it is one of {', '.join(VALUES)}.")
    for name, number, low in (("replays", replays, 0), ("checks", checks, 0), ("seed", seed, 0)):
        if number < low:
            raise StudyError(f"{name} is {number}; it must be {low} or more.")
    notes: list[str] = []
    drawn = _draw(sources, design, clips, seed, notes)
    drawn = _alike(drawn, seconds, notes)
    motions = [_on_floor(source.motion) for source in drawn]
    fps, length = motions[0].fps, len(motions[0])
    for seed_of in (1, 2):  # a walk made by a formula, to practise on and to check with
        walk = gaits.make(seconds=max(length / fps, 1), speed=1.2, fps=fps, seed=seed_of)
        motions.append(_on_floor(walk)[:length])
    names = [f"c{number:03d}" for number in range(len(drawn))]
    data = payload([Track(m.positions(), m.skeleton, color=SHADE, motion=m) for m in motions], fps)
    tracks = dict(zip([*names, PRACTICE, CHECK], data.pop("tracks"), strict=True))
    made = tuple(
        Clip(name, s.method, s.gait, s.file, _digest(tracks[name], data["bodies"]))
        for name, s in zip(names, drawn, strict=True)
    )
    items, orders = plan(made, design, seed, checks)
    if len(items) > MOST_ITEMS:
        raise StudyError(
            f"{len(items)} clips to judge are more than anybody does ({MOST_ITEMS}); take fewer "
            "methods, gaits or clips."
        )
    study = Study(
        title=title, design=design, methods=tuple(sorted({c.method for c in made})),
        gaits=tuple(sorted({c.gait for c in made})), clips=made, items=items, orders=orders,
        seed=seed, fps=fps, seconds=round(length / fps, 3), replays=replays, rules=rules or Rules(),
    )  # fmt: skip
    content = {
        "study": study.for_raters(), "contact": contact, "player": data, "tracks": tracks,
        "rules": study.rules.in_words(),
    }  # fmt: skip
    return Built(study, content, tuple(notes))


def _draw(
    sources: Sequence[Source], design: str, clips: int | None, seed: int, notes: list[str]
) -> list[Source]:
    """As many motions of each method in each gait, in an order that tells nothing."""
    if clips is not None and clips < 1:
        raise StudyError(f"clips is {clips}; at least one of each method is needed.")
    cells: dict[tuple[str, str], list[Source]] = defaultdict(list)
    for source in sources:
        cells[source.method, source.gait].append(source)
    methods, kinds = (sorted({cell[i] for cell in cells}) for i in (0, 1))
    if not methods:
        raise StudyError("there are no motions; a study needs some of two methods or more.")
    if len(methods) < 2:
        if design == PAIRS:
            raise StudyError(
                f"all motions are of one method, {methods[0]}; pairs need two or more to compare."
            )
        notes.append(f"one method, {methods[0]}: there is nothing to compare it with.")
    for method in methods:
        for gait in kinds:
            if not cells[method, gait]:
                raise StudyError(
                    f"{method} has no motion of {gait}, which others have: all methods must be "
                    f"judged in the same gaits ({', '.join(kinds)})."
                )
    fewest = min(cells, key=lambda cell: len(cells[cell]))
    wanted = clips or CLIPS[design]
    count = min(wanted, len(cells[fewest]))
    if count < wanted:
        notes.append(
            f"{count} clips of each method in each gait, not {wanted}: {fewest[0]} has no more "
            f"of {fewest[1]}."
        )
    if len(sources) == 1:
        notes.append("one motion: its mean can be told, how clips differ can't.")
    draw = np.random.default_rng([seed, 0])
    chosen = [
        cells[m, g][i] for m in methods for g in kinds
        for i in sorted(draw.permutation(len(cells[m, g]))[:count])
    ]  # fmt: skip
    return [chosen[i] for i in draw.permutation(len(chosen))]


def _alike(drawn: list[Source], seconds: float | None, notes: list[str]) -> list[Source]:
    """All at one rate and of one length, as either tells who made a clip."""
    rates = sorted({round(s.motion.fps, 3) for s in drawn})
    if len(rates) > 1:
        notes.append(
            f"rates differ ({', '.join(f'{r:g}' for r in rates)} fps), so that all were brought to "
            f"{rates[0]:g}."
        )
        slow = min(s.motion.fps for s in drawn)
        drawn = [replace(s, motion=s.motion.resample(slow)) for s in drawn]
    lengths = [s.motion.seconds for s in drawn]
    if seconds is not None and seconds > min(lengths) + 0.5 / drawn[0].motion.fps:
        short = drawn[int(np.argmin(lengths))]
        raise StudyError(
            f"seconds is {seconds:g}, but {short.file or short.method} lasts {min(lengths):.2f} s; ask "
            "for no more than that, or leave the file out."
        )
    if min(lengths) < SHORTEST:
        short = drawn[int(np.argmin(lengths))]
        raise StudyError(
            f"{short.file or short.method} lasts {min(lengths):.2f} s; nobody can judge less than "
            f"{SHORTEST:g} s. Leave it out."
        )
    fps = drawn[0].motion.fps
    frames = min(len(s.motion) for s in drawn) if seconds is None else round(seconds * fps)
    if seconds is None and max(lengths) - min(lengths) > 0.5 / fps:
        notes.append(
            f"lengths differ ({min(lengths):.2f} to {max(lengths):.2f} s), so that all were cut to the "
            f"first {frames / fps:.2f} s."
        )
    if bodies := _telling(drawn):
        notes.append(
            f"{bodies} different bodies, and not the same ones in each method: raters may tell methods by "
            "them; `motionlab retarget` brings all to one."
        )
    return [replace(s, motion=s.motion[:frames]) for s in drawn]


def _telling(drawn: Iterable[Source]) -> int:
    """How many bodies there are, if a method can be told by its bodies; else 0."""
    of_method: dict[str, set] = {}
    for source in drawn:
        body = tuple(source.motion.skeleton.offsets.flatten().round(decimals=3).tolist())
        of_method.setdefault(source.method, set()).add(body)
    told = any(its != next(iter(of_method.values())) for its in of_method.values())
    return len(set().union(*of_method.values())) if told else 0


def _on_floor(motion: Motion) -> Motion:
    """The motion with its soles at height 0 and its first frame above the origin."""
    track = Track(motion.positions(), motion.skeleton)
    x, z = motion.root_positions[0, [0, 2]].tolist()
    return replace(
        motion,
        root_positions=motion.root_positions - torch.tensor([x, floor_height(track), z]),
        contacts=None,
    )


def _digest(track: dict[str, Any], bodies: list[dict[str, Any]]) -> str:
    played = {**track, "body": bodies[track["body"]]}
    return hashlib.sha256(json.dumps(played, sort_keys=True).encode()).hexdigest()
