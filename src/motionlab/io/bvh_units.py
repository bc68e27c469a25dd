"""The unit of length of a BVH file: its names, and which one the body's size speaks for."""

from __future__ import annotations

import math
from numbers import Real

from ..errors import BvhError
from ..skeleton import Skeleton

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# CMU's skeletons say in how many inches they measure: 1 / 0.45. Their BVH files, made of these, have
# lost that, and no program has a name for it. Rounded, so that it can be typed as it is read.
CMU = 0.056444
# Metres along the bones from ankle to head joint. The bodies of our data sets measure 1.34 to 1.80,
# a small child 0.72. Adults in inches that are read as centimetres measure 0.53 to 0.71.
HEIGHTS = (0.715, 2.2)
_USUAL = 1.5
# The same between the two joints that are farthest from each other, such as hand and foot of a
# person. Wide: it may be an arm alone, or half a horse.
SPANS = (0.1, 10.0)
_USUAL_SPAN = 2.0


class Doubt(str):
    """What is doubtful about how a file was read, and the argument that fits, as "units='m'"."""

    fits: str

    def __new__(cls, said: str, fits: str) -> Doubt:
        doubt = super().__new__(cls, said)
        doubt.fits = fits
        return doubt


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


def doubt_units(skeleton: Skeleton, units: str | float) -> Doubt | str | None:
    """What to say if the body is not of the size of a person, read in these units.

    Where some of its joints are known, but foot or head is not, only what can be no body is told.
    """
    length, (least, most), usual = foot_to_head(skeleton), HEIGHTS, _USUAL
    said = "from foot to head the body measures"
    if length is None and skeleton.roles:
        length, (least, most), usual = longest_way(skeleton), SPANS, _USUAL_SPAN
        said = "the longest way along the body's bones, from joint to joint, measures"
    if length is None or least <= length <= most:
        return None
    raw = length / in_metres(units)
    said += f" {float(f'{length:.3g}'):g} m in units={units!r}"
    if raw < 1e-9:
        return f"{said}; its bones have no length, export it with its offsets."
    known = {repr(unit): metres for unit, metres in UNITS.items()}
    if usual == _USUAL:  # of a whole body; too little is known of others
        known[str(CMU)] = CMU
    makes = {unit: raw * metres for unit, metres in known.items() if least <= raw * metres <= most}
    if makes:
        best = min(makes, key=lambda unit: abs(math.log(makes[unit] / usual)))
        fits = f"units={best}"
        named = ", CMU's unit (inches / 0.45)," if best == str(CMU) else ""
        better = f"{fits}{named} makes it {makes[best]:.2f} m"
    else:
        fits = f"units={usual / raw:.2g}"
        better = f"of {', '.join(UNITS)} none fits, metres per unit do, about {fits}"
    return Doubt(f"{said}, as no person does; pass another unit: {better}.", fits)


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


def longest_way(skeleton: Skeleton) -> float:
    """Metres along the bones between the two joints that are farthest from each other."""
    lengths = skeleton.offsets.norm(dim=-1).tolist()
    longest, deepest = 0.0, [0.0] * skeleton.joints
    for joint in reversed(range(1, skeleton.joints)):  # parents come before their children
        parent, below = skeleton.parents[joint], deepest[joint] + lengths[joint]
        longest = max(longest, deepest[parent] + below)
        deepest[parent] = max(deepest[parent], below)
    return longest


def ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    """A joint and those it hangs on, up to the root."""
    way = [joint]
    while skeleton.parents[way[-1]] >= 0:
        way.append(skeleton.parents[way[-1]])
    return way
