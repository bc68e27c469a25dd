"""Numbers under knobs: means with intervals beside what is true, for each setting of a function's arguments.

As `knobs`, which plays motions: in a kernel a chart is drawn anew when a knob is let go; a page has no
kernel, there all are drawn beforehand.
"""

from __future__ import annotations

import html
import itertools
import json
import math
import os
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ...errors import ViewerError
from ..pictures.palette import color
from .figure import PageFigure
from .knobs import FOLLOWED, MOST, SETTINGS, STYLE, check_knobs, named, page_input
from .knobs_kernel import Value, knob_field

WIDE, ROW, LEFT = 440, 34, 84  # of the chart, in its own units
_PAGE = (
    """
<figure class="motionlab-chart" id="{key}" style="margin:1rem 0">
<style>
"""
    + STYLE
    + """</style>
<div class="chart">{chart}</div>
"""
    + SETTINGS
    + """    [box.querySelector(".chart").innerHTML, box.querySelector(".said").textContent] = made[at.join()];
"""
    + FOLLOWED
    + """</figure>
"""
)


class Bar(NamedTuple):
    """A row of the chart: what was found, its interval, and what is true (None: not known)."""

    name: str
    value: float
    low: float
    high: float
    true: float | None = None


def chart_knobs(
    make: Callable[..., tuple[Sequence[Bar], str]],
    values: Mapping[str, Sequence[Value]],
    *,
    ends: tuple[float, float],
    unit: str,
    start: Mapping[str, Value] | None = None,
    labels: Mapping[str, str] | None = None,
    caption: str | None = None,
) -> Any:
    """A chart of means under a slider, or a box, for each argument of a function.

    Parameters
    ----------
    make : takes one value of each name in `values`; gives bars and a line of text to say below them.
    values, start, labels, caption : as of `motionlab.viewer.knobs`.
    ends : the ends of the scale, in `unit`, in words.

    Raises
    ------
    ViewerError : as `motionlab.viewer.knobs`.
    """
    values, start, called = check_knobs(values, start, labels)
    shown = lambda wanted: _made(make, wanted, ends, unit)
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return _page(shown, values, start, called, caption)
    return _box(shown, values, start, called, caption)


def _made(make: Callable, wanted: Mapping[str, Value], ends, unit: str) -> tuple[str, str]:
    bars, said = make(**wanted)
    return chart(bars, ends, unit), said


def chart(bars: Sequence[Bar], ends: tuple[float, float], unit: str) -> str:
    """Bars as SVG, in both themes: a point with its interval, and a hollow diamond where the truth is."""
    low, high = ends
    across = lambda value: (
        LEFT + (WIDE - LEFT - 20) * (min(max(value, low), high) - low) / (high - low)
    )
    deep = ROW * len(bars)
    parts = []
    for tick in range(math.ceil(low), math.floor(high) + 1):
        x = across(tick)
        parts.append(
            f'<line x1="{x:.1f}" y1="0" x2="{x:.1f}" y2="{deep}" stroke="currentColor" opacity="0.2"/>'
            f'<text x="{x:.1f}" y="{deep + 16}" text-anchor="middle">{tick}</text>'
        )
    for i, bar in enumerate(bars):
        y, shade = ROW * (i + 0.5), color(bar.name, i)
        parts.append(f'<text x="0" y="{y + 4}">{html.escape(bar.name)}</text>')
        parts.append(
            f'<line x1="{across(bar.low):.1f}" y1="{y}" x2="{across(bar.high):.1f}" y2="{y}" '
            f'stroke="{shade}" stroke-width="5" stroke-linecap="round"/>'
            f'<circle cx="{across(bar.value):.1f}" cy="{y}" r="7" fill="{shade}"/>'
        )
        if bar.true is not None:
            x = across(bar.true)
            parts.append(
                f'<path d="M{x:.1f} {y - 12}l8 12-8 12-8-12z" fill="none" stroke="currentColor" '
                'stroke-width="1.8"/>'
            )
    told = "; ".join(f"{b.name} {b.value:.2f}" for b in bars)
    return (
        f'<svg viewBox="0 0 {WIDE} {deep + 38}" role="img" aria-label="{html.escape(told, quote=True)}" '
        f'style="width:100%;max-width:{1.2 * WIDE:.0f}px;height:auto;display:block;'
        'font:14px system-ui,sans-serif;fill:currentColor">'
        f'{"".join(parts)}<text x="{across((low + high) / 2):.1f}" y="{deep + 34}" '
        f'text-anchor="middle">{html.escape(unit)}</text></svg>'
    )


def _page(shown, values, start, called, caption) -> PageFigure:
    counts = [range(len(some)) for some in values.values()]
    if (settings := math.prod(map(len, counts))) > MOST:
        raise ViewerError(f"knobs: {settings} settings are too many for a page ({MOST}).")
    made = {
        ",".join(map(str, at)): shown(
            {name: some[i] for (name, some), i in zip(values.items(), at, strict=True)}
        )
        for at in itertools.product(*counts)
    }
    first = [some.index(start[name]) for name, some in values.items()]
    drawn, said = made[",".join(map(str, first))]
    names = named(values)
    return PageFigure(
        _PAGE.format(
            key=f"chart-{uuid.uuid4().hex[:8]}",
            chart=drawn,
            inputs="".join(map(page_input, called.values(), values.values(), first, names)),
            said=html.escape(said),
            made=json.dumps([names, made], separators=(",", ":")).replace("<", "\\u003c"),
            caption=f"<figcaption>{html.escape(caption)}</figcaption>" if caption else "",
        )
    )


def _box(shown, values, start, called, caption):
    import ipywidgets

    fields = {name: knob_field(called[name], some, start[name]) for name, some in values.items()}
    drawn, said = ipywidgets.HTML(), ipywidgets.Label()

    def turned(_change: Any = None) -> None:
        drawn.value, said.value = shown({name: field.value for name, field in fields.items()})

    for field in fields.values():
        field.observe(turned, names="value")
    turned()
    needs = ipywidgets.HTML("<small>Needs a kernel: computed anew for every setting.</small>")
    text = [ipywidgets.HTML(html.escape(caption))] if caption else []
    return ipywidgets.VBox([drawn, ipywidgets.VBox(list(fields.values())), said, needs, *text])
