"""One leg in one frame, in plain numbers: what `lock` does to all legs and frames at once.

Between two frames of a stream there is one leg at a time to bend. numpy and torch take a microsecond
and more for the smallest product; Python's own numbers take a tenth of one. Vectors are lists of
three.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .lock import BACKWARDS, NEAR, REACH, STRAIGHT
from .planting import TIP

Vector = Sequence[float]
Matrix = Sequence[Vector]
_LEAST = 1e-12


def knee(knee_was: Vector, shin_was: Vector, reach: Vector, front: Vector) -> list[float]:
    """Where a knee is, seen from the hip, once its ankle is at `reach`: as `lock._knee`."""
    thigh, shank, distance = norm(knee_was), norm(shin_was), max(norm(reach), 1e-9)
    along = (thigh * thigh + distance * distance - shank * shank) / (2 * distance)
    along = min(max(along, -thigh), thigh)
    beside = math.sqrt(max(thigh * thigh - along * along, 0.0))
    line_was, line = unit(plus(knee_was, 1, shin_was)), unit(reach)
    aside = plus(knee_was, -dot(knee_was, line_was), line_was)
    # the smallest turn of the line, of what is at right angles to it
    middle = unit(plus(line_was, 1, line))
    aside = plus(aside, -2 * dot(middle, aside), middle)
    out = norm(aside)
    front = unit(plus(front, -dot(front, line), line))
    trusted = BACKWARDS if dot(aside, front) < 0 else STRAIGHT
    share = min(max(2 - out / trusted, 0.0), 1.0)
    way = unit(plus(aside, share * 3 * max(beside - out, 1e-7), front))
    return [along * a + beside * b for a, b in zip(line, way, strict=True)]


def turn(start: Vector, end: Vector) -> list[list[float]]:
    """Smallest rotation, as rows, that turns one direction into another: `ik.turns.shortest_turn`."""
    (sx, sy, sz) = s = unit(start)
    (mx, my, mz) = middle = unit(plus(s, 1, unit(end)))
    cosine = 4 * dot(middle, s)
    ax, ay, az = cosine * sx - 2 * mx, cosine * sy - 2 * my, cosine * sz - 2 * mz
    return [
        [mx * ax - 2 * sx * sx + 1, mx * ay - 2 * sx * sy, mx * az - 2 * sx * sz],
        [my * ax - 2 * sy * sx, my * ay - 2 * sy * sy + 1, my * az - 2 * sy * sz],
        [mz * ax - 2 * sz * sx, mz * ay - 2 * sz * sy, mz * az - 2 * sz * sz + 1],
    ]


def needed(hip: Vector, ankle: Vector, shift: Vector, longest: float) -> float:
    """Metres that a hip must come down for its ankle to go where it shall: as in `lock._sink`.

    longest : metres of the leg when it is stretched.
    """
    x, y, z = (
        hip[0] - ankle[0] - shift[0],
        hip[1] - ankle[1] - shift[1],
        hip[2] - ankle[2] - shift[2],
    )
    reach = REACH * longest
    if x * x + y * y + z * z <= reach * reach:
        return 0.0
    reach = max(reach, min(math.dist(hip, ankle), longest) - max(norm(shift) - NEAR, 0.0))
    down = y - math.sqrt(max(reach * reach - x * x - z * z, 1e-4))
    return down if down > 1e-4 else 0.0


def toes_up(tip: Vector, height: float) -> list[list[float]] | None:
    """The turn that lifts toes' tip out of the floor, None if it is not in it: `off_the_floor`.

    tip : metres from the toe joint, in the world; height : of the toe joint above the floor.
    """
    long = norm(tip)
    least = min(max(TIP - height, -long), 0.0)
    if long < TIP or tip[1] >= least:
        return None
    level = math.sqrt(long * long - least * least) / max(math.hypot(tip[0], tip[2]), 1e-6 * long)
    return turn(tip, [tip[0] * level, least, tip[2] * level])


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def norm(a: Vector) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def plus(a: Vector, share: float, b: Vector) -> list[float]:
    """a + share b."""
    return [a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]]


def unit(a: Vector) -> list[float]:
    """One long; zero stays zero."""
    x, y, z = a
    long = math.sqrt(x * x + y * y + z * z) or _LEAST
    return [x / long, y / long, z / long]
