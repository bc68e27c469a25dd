"""When a foot is held, told frame by frame from what is known some frames ahead.

`lock` looks at whole contacts; here a contact is over before all of it has been seen. So its place is
where toes are while it begins, and a contact counts as soon as it is too long for a flicker.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from .lock import FARTHEST, FASTEST, RESTS
from .marks import GAP, SHORTEST
from .one_leg import Vector, plus

# m/s; of a contact's first frames those so much slower than the others tell its place
_SLOW = 0.05
_FALLS = 0.015  # metres; toes that come down farther are not down yet


class Rules:
    """What holds for both feet of a stream, in frames.

    Parameters
    ----------
    fps : frames a second.
    ahead : frames that are known ahead.
    blend : seconds in which a foot that is let go eases back.
    """

    def __init__(self, fps: float, ahead: int, blend: float) -> None:
        self.blend = max(blend * fps, 1e-9)
        self.gap = min(max(1, round(GAP * fps)), ahead)  # the longest in a contact
        self.shortest = min(max(1, round(SHORTEST * fps)), (ahead + 1) // 2)  # contact
        self.sure = ahead + 1 - self.shortest  # ahead of a contact it is known to be none too short


@dataclass
class Foot:
    """Where one foot is between two frames."""

    on: bool = True  # in contact, gaps filled; what is down at first may have been so for long
    away: float = math.inf  # frames since its label last said so
    seen: int = 0  # frames of this contact
    rests: int = 0  # of these, how many its toes were still in
    barred: int = 0  # frames in which it may not begin to be held, within this contact
    place: Vector | None = None  # metres, while it is held
    since: float = math.inf  # frames since it was held
    last: Vector = field(default_factory=lambda: [0.0, 0.0, 0.0])  # metres, its shift then
    near: float = 0.0  # share of its way onto its next place that it has eased
    given: Vector = field(default_factory=lambda: [0.0, 0.0, 0.0])  # metres, its last shift
    easing: int = 0  # frames ahead in which it eases onto its next place

    def shifts(
        self, rules: Rules, labels: Sequence[bool], speeds: Sequence[float],
        toes: Sequence[Vector], height: float | None,
    ) -> list[Vector]:  # fmt: skip
        """How far the foot is to be moved now and, as it looks, in the next frames.

        Called once a frame. Each argument but `height` has one entry a frame, this one first.

        Parameters
        ----------
        labels : whether the toes are labelled as down.
        speeds : of the toes, metres a second.
        toes : where they are, metres.
        height : of resting toes, metres. None: as they come down.
        """
        on = self._clean(rules, [a and v < FASTEST for a, v in zip(labels, speeds, strict=True)])
        still = [a and v < RESTS for a, v in zip(on, speeds, strict=True)]
        self._count(on, still)
        begin, place = 0, self.place
        if place is None:
            begin = self._begin(toes, on, still)
            place = _place(toes, speeds, on, still, begin, height)
            if begin == 0 and math.dist(place, toes[0]) < FARTHEST:
                self.place = place
            elif begin == 0:
                self.barred = begin = rules.sure + 1
        if self.place is not None:
            if end := self._end(toes, on, still):
                return self._held(rules, toes, end)
            self.place, self.barred = None, math.ceil(rules.blend) + rules.sure
            begin = len(on)
        return self._free(rules, toes, begin, place)

    def _clean(self, rules: Rules, labels: list[bool]) -> list[bool]:
        """Labels without gaps and flickers; a contact that may be a flicker does not count yet."""
        on, away = list(labels), self.away if self.on else math.inf
        self.away = 0 if labels[0] else self.away + 1
        if not any(labels) or (self.on and all(labels)):
            self.on = labels[0]
            return on
        for k, down in enumerate(labels):
            if down and 0 < away <= rules.gap:
                on[max(k - away, 0) : k] = [True] * min(away, k)
            away = 0 if down else away + 1
        start = 0
        for k in range(len(on) + 1):
            if k == len(on) or not on[k]:
                if k - start < rules.shortest and not (start == 0 and self.on):
                    on[start:k] = [False] * (k - start)
                start = k + 1
        self.on = on[0]
        return on

    def _count(self, on: list[bool], still: list[bool]) -> None:
        """Keep count of the frames of a contact, and of those in which toes are still."""
        if on[0]:
            self.seen, self.rests = self.seen + 1, self.rests + still[0]
            self.barred = max(self.barred - 1, 0)
        else:
            self.seen = self.rests = self.barred = 0

    def _begin(self, toes: Sequence[Vector], on: list[bool], still: list[bool]) -> int:
        """In which frame ahead the foot will begin to be held; the number of frames if in none.

        Where toes come to rest, if they do, or else have come down: labels by speed begin in the
        air. A foot that was let go within this contact is not taken up again before its shift is
        gone.
        """
        first = max(_next(on, True), self.barred if self.on else 0)
        contact = range(first, _next(on, False, first))
        if not contact:
            return len(on)
        lowest = min(toes[k][1] for k in contact) + _FALLS
        return next(
            (k for k in contact if still[k]), next(k for k in contact if toes[k][1] < lowest)
        )

    def _end(self, toes: Sequence[Vector], on: list[bool], still: list[bool]) -> int:
        """In which frame ahead a held foot is let go; the number of frames if in none."""
        stop = _next(on, False)
        if 2 * self.rests > self.seen and not any(still[:stop]):
            return 0  # what was at rest moves, and the contact goes on by its label alone
        far = (k for k in range(stop) if math.dist(toes[k], self.place) >= FARTHEST)
        return next(far, stop)

    def _held(self, rules: Rules, toes: Sequence[Vector], end: int) -> list[Vector]:
        """Shifts of a foot that is held, and let go in frame `end`."""
        onto = [plus(self.place, -1, toe) for toe in toes[:end]]
        self.since, self.last, self.near, self.easing = 0, list(onto[0]), 0.0, 0
        after = range(1, len(toes) - end + 1)
        return onto + [_times(_fade(k / rules.blend), onto[-1]) for k in after]

    def _free(
        self, rules: Rules, toes: Sequence[Vector], begin: int, place: Vector
    ) -> list[Vector]:
        """Shifts of a foot that is not held: the last one fades out, and the next one, from frame
        `begin`, fades in."""
        comes = begin < len(toes) and math.dist(place, toes[begin]) < FARTHEST
        near = [comes * _fade((begin - k) / (rules.sure + 1)) for k in range(begin)]
        now = near[0] if comes else 0.0
        if now < self.near:  # it comes down later than it seemed: eased so far, it eases back
            self.since, self.last = 0, self.given
        self.since, self.near, self.easing = self.since + 1, now, begin if comes else 0
        old = [_fade((self.since + k) / rules.blend) for k in range(len(toes))]
        if not comes:
            shifts = [_times(share, self.last) if share else [0.0, 0.0, 0.0] for share in old]
        else:
            onto = [plus(place, -1, toe) for toe in toes[begin:]]
            shifts = [
                plus(_times(share * (1 - part), self.last), part, onto[0])
                for share, part in zip(old, near, strict=False)
            ] + onto
        self.given = list(shifts[0])
        return shifts


def _place(
    toes: Sequence[Vector], speeds: Sequence[float], on: list[bool], still: list[bool],
    begin: int, height: float | None,
) -> Vector:  # fmt: skip
    """Where toes come to rest in a contact: their mean in all of it that is known, slow frames
    first."""
    stop = _next(on, False, begin)
    if begin >= stop:
        return toes[0]
    place = list(toes[begin])
    if not still[begin]:
        shares = [1 / (v * v + _SLOW * _SLOW) for v in speeds[begin:stop]]
        for axis in range(3):
            moved = sum(
                share * toe[axis] for share, toe in zip(shares, toes[begin:stop], strict=True)
            )
            place[axis] = moved / sum(shares)
    if height is not None:
        place[1] = height
    return place


def _next(marks: list[bool], wanted: bool, start: int = 0) -> int:
    """The first frame from `start` whose mark is as wanted; the number of frames if there is none."""
    return next((k for k in range(start, len(marks)) if marks[k] is wanted), len(marks))


def _times(share: float, a: Vector) -> Vector:
    return [share * a[0], share * a[1], share * a[2]]


def _fade(away: float) -> float:
    """From 1 at 0 to 0 at 1, level at both ends."""
    if away >= 1:
        return 0.0
    left = 1 - away
    return left * left * (3 - 2 * left)
