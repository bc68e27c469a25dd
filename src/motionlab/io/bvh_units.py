"""The unit of length of a BVH file: its names, and which one the body's size speaks for."""

from __future__ import annotations

import math
from numbers import Real

from ..errors import BvhError
from ..skeleton import Skeleton

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# Metres along the bones from ankle to head joint. The bodies of our data sets measure 1.34 to 1.80,
# a child of two years 0.7. Of adults in inches that are read as centimetres it makes 0.53 to 0.71.
HEIGHTS = (0.7, 2.2)
_USUAL = 1.5


def in_metres(units: str | float) -> float:
    """Metres per unit."""
    metres = UNITS.get(units) if isinstance(units, str) else units
    if not is_positive(metres):
        raise BvhError(
            f"Unknown unit {units!r}; use one of {', '.join(UNITS)}, or metres per unit."
        )
    return float(metres)


def is_positive(value) -> bool:
    """Whether it is a number above zero, and neither NaN nor infinite."""
    try:
        return isinstance(value, Real) and math.isfinite(value) and value > 0
    except OverflowError:  # an integer beyond every float
        return False


def doubt_units(skeleton: Skeleton, units: str | float) -> str | None:
    """What to say if the body is not of the size of a person, read in these units."""
    height = foot_to_head(skeleton)
    if height is None or HEIGHTS[0] <= height <= HEIGHTS[1]:
        return None
    raw = height / in_metres(units)
    said = f"from foot to head the body measures {float(f'{height:.3g}'):g} m in units={units!r}"
    if raw < 1e-9:
        return f"{said}; its bones have no length, export it with its offsets."
    best = min(UNITS, key=lambda unit: abs(math.log(raw * UNITS[unit] / _USUAL)))
    if HEIGHTS[0] <= raw * UNITS[best] <= HEIGHTS[1]:
        better = f"units={best!r} makes it {raw * UNITS[best]:.2f} m"
    else:
        better = (
            f"of {', '.join(UNITS)} none fits, metres per unit do, about units={_USUAL / raw:.2g}"
        )
    return f"{said}, as no person does; pass another unit: {better}."


def foot_to_head(skeleton: Skeleton) -> float | None:
    """Metres along the bones from a foot to the head, by way of where both hang together; None if
    it is not known which joints these are."""
    roles = skeleton.roles
    foot = roles.get("left_foot", roles.get("right_foot"))
    if foot is None or "head" not in roles:
        return None
    ways = [set(ancestors(skeleton, joint)) for joint in (foot, roles["head"])]
    # what is above the hips, such as a root on the floor, is on both ways and on neither's own
    return float(skeleton.offsets[list(ways[0] ^ ways[1])].norm(dim=-1).sum())


def ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    """A joint and those it hangs on, up to the root."""
    way = [joint]
    while skeleton.parents[way[-1]] >= 0:
        way.append(skeleton.parents[way[-1]])
    return way
