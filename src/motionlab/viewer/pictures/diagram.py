"""A network, or how a thing is done, as boxes and arrows: legible on a phone, on black and on white."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.path import Path

from ...errors import ViewerError
from .palette import check_color
from .plot_style import INK, check_named, styled

BOX = 1.3, 0.46  # inches
STEP = 1.6, 0.82  # from one column, one row, to the next
LOOP = 0.2  # how far the arrow of a memory stands out
AROUND = 0.5  # and one that goes around other boxes
BESIDE = 1.15  # room for both, and for what is written beside them


@styled
def diagram(
    boxes: Mapping[str, Sequence], arrows: Sequence[Sequence[str]], colors: Mapping[str, str] = {}
) -> Figure:
    """Boxes in a grid, and arrows between them.

    Three columns are as wide as a phone can show at the size of its text.

    Parameters
    ----------
    boxes : ``{name: (column, row)}``; row 0 is on top, halves are allowed, and a name may have several
        lines.
    arrows : (from, to) or (from, to, what goes along). From a box to itself: what it remembers. From a
        box to one that is two rows away or more, in its column, it goes around on the right.
    colors : of some boxes, names of methods or hex codes; the others are empty.

    Raises
    ------
    ViewerError : no box, two in one place, or an arrow or a colour of a box that there is not.
    """
    check_named("diagram", boxes)
    _check(boxes, arrows, colors)
    columns, rows = ([place[axis] for place in boxes.values()] for axis in (0, 1))
    left, right = (min(columns) - 0.5) * STEP[0], (max(columns) + 0.5) * STEP[0]
    if any(boxes[begin][0] == boxes[end][0] == max(columns) for begin, end, *_ in arrows):
        right += BESIDE
    top, bottom = -(min(rows) - 0.5) * STEP[1], -(max(rows) + 0.5) * STEP[1]
    figure = plt.figure(figsize=(right - left, top - bottom), layout="none")
    axes = figure.add_axes((0, 0, 1, 1), xlim=(left, right), ylim=(bottom, top))
    axes.axis("off")
    places = {name: (x * STEP[0], -y * STEP[1]) for name, (x, y) in boxes.items()}
    for name, place in places.items():
        _box(axes, name, place, colors.get(name))
    for begin, end, *what in arrows:
        _arrow(axes, places[begin], places[end], *what)
    return figure


def _check(boxes, arrows, colors) -> None:
    if len({tuple(place) for place in boxes.values()}) < len(boxes):
        raise ViewerError(
            "diagram: two boxes stand in one place; give each a column and row of its own."
        )
    named = [name for arrow in arrows for name in arrow[:2]] + list(colors)
    for name in named:
        if name not in boxes:
            raise ViewerError(f"diagram: there is no box {name!r}; boxes: {', '.join(boxes)}.")


def _box(axes, name: str, place: tuple[float, float], color: str | None) -> None:
    (x, y), (wide, high) = place, BOX
    axes.add_patch(
        FancyBboxPatch(
            (x - wide / 2, y - high / 2), wide, high, boxstyle="round,pad=0,rounding_size=0.08",
            facecolor=(*plt.matplotlib.colors.to_rgb(check_color(color)), 0.16) if color else "none",
            edgecolor=check_color(color) if color else INK, linewidth=1.2,
        )
    )  # fmt: skip
    axes.text(x, y, name, ha="center", va="center", fontsize=9.5, linespacing=1.1)


def _arrow(axes, begin, end, what: str = "") -> None:
    (x0, y0), (x1, y1), (wide, high) = begin, end, BOX
    side, sign = wide / 2, 1 if (x1, y1) > (x0, y0) else -1
    if begin == end:  # a memory
        out = x0 + side + LOOP
        way = (
            (x0 + side, y0 - high / 4),
            (out, y0 - high / 4),
            (out, y0 + high / 4),
            (x0 + side, y0 + high / 4),
        )
        label, align = (out + 0.05, y0), "left"
    elif x0 == x1 and abs(y1 - y0) > 1.5 * STEP[1]:  # around what is between
        out = x0 + side + AROUND
        way = (x0 + side, y0), (out, y0), (out, y1), (x1 + side, y1)
        label, align = (out + 0.05, (y0 + y1) / 2), "left"
    elif y0 == y1:
        way = (x0 + sign * side, y0), (x1 - sign * side, y1)
        label, align = ((x0 + x1) / 2, y0 + 0.12), "center"
    else:
        sign = 1 if y1 > y0 else -1
        way = (x0, y0 + sign * high / 2), (x1, y1 - sign * high / 2)
        left = x1 > x0  # a slanted arrow leaves more room on the side that it comes from
        aside = 0.06 if x0 == x1 else -0.15 if left else 0.15
        label = (x0 + x1) / 2 + aside, (y0 + y1) / 2
        align = "right" if left else "left"
    axes.add_patch(
        FancyArrowPatch(
            path=Path(way), arrowstyle="-|>", mutation_scale=9, facecolor=INK, edgecolor=INK,
            linewidth=1.2, joinstyle="round",
        )
    )  # fmt: skip
    if what:
        axes.text(
            *label, what, ha=align, va="center", fontsize=8.5, style="italic", linespacing=1.1
        )
