"""A motion under knobs: what becomes of it for each setting of a function's arguments.

    viewer.knobs(make, {"threshold": (0.1, 0.45, 1.0), "locked": (False, True)})

In a kernel `make` runs whenever a knob is let go. A page has no kernel: there all settings are made
beforehand, and its knobs choose among them.
"""

from __future__ import annotations

import html
import itertools
import json
import math
import os
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...errors import ViewerError
from ...motion import Motion
from ..pictures.palette import check_color
from .figure import PageFigure
from .knobs_kernel import Value, box, is_box, is_list
from .player import Track, page_html, payload
from .show import still_picture, trail_points

MOST = 60  # settings of a page
# What pages under knobs share: how settings look, and the script around what each draws
STYLE = """#{key} .turn {{ display: flex; flex-wrap: wrap; gap: .3em 1.5em; align-items: center; }}
#{key} .turn label {{ display: inline-flex; align-items: center; gap: .5em; }}
#{key} .turn output {{ min-width: 2.5em; font-variant-numeric: tabular-nums; }}
#{key} figcaption {{ margin: .5rem 0; font-size: .95em; }}
"""
SETTINGS = """<div class="turn">{inputs}</div>
<p><output class="said" aria-live="polite">{said}</output><br>
<small>Computed beforehand: these settings, and no others.</small></p>
{caption}
<script>
(() => {{
  const box = document.getElementById("{key}");
  const [names, made] = {made};
  const inputs = [...box.querySelectorAll(".turn :is(input, select)")];
  const place = (i) => i.type === "checkbox" ? Number(i.checked) : Number(i.value);
  const draw = () => {{
    const at = inputs.map(place);
"""
FOLLOWED = """    inputs.forEach((input, i) => {{
      if (input.type === "range") input.nextElementSibling.textContent = names[i][at[i]];
    }});
  }};
  inputs.forEach((input) => input.addEventListener("input", draw));
}})();
</script>
"""
_PAGE = (
    """
<div class="motionlab-knobs" id="{key}">
<style>
#{key} .ml-choose {{ display: none; }}
"""
    + STYLE
    + """</style>
{player}
"""
    + SETTINGS
    + """    const [track, said] = made[at.join()];
    box.querySelector(".motionlab-player").motionlab?.set("chosen", track);
    box.querySelector(".said").textContent = said;
"""
    + FOLLOWED
    + """</div>
"""
)


def knobs(
    make: Callable[..., tuple[Motion, str]],
    values: Mapping[str, Sequence[Value]],
    *,
    start: Mapping[str, Value] | None = None,
    labels: Mapping[str, str] | None = None,
    trail: str | int | Sequence[str | int] | None = None,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 380,
) -> Any:
    """Play what a function makes of its arguments, under a slider for each.

    Parameters
    ----------
    make : takes one value of each name in `values`; gives a Motion, whose contacts are marked if it
        has any, and a line of text to say below it. All its motions have one rate.
    values : {argument: values in rising order}; (False, True) is a box to tick, words a list to
        choose from. In a kernel a slider has any value from the first to the last, in a page these.
    start : where knobs stand at first; else at the first value.
    labels : what knobs are called, with units; else as the arguments.
    trail : joints (names, roles or point indices) that leave a trail.
    color : a method's name or a colour.
    caption : a text below.
    height : of the picture, pixels.

    Raises
    ------
    ViewerError : a knob without two rising numbers or two different words, a start that is not among them, more than 60
        settings in a page, or a `make` that gives something else.
    """
    values, start, called = check_knobs(values, start, labels)
    look = {"trail": trail, "color": check_color(color), "height": height}
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return _page(make, values, start, called, caption, **look)
    shown = lambda wanted: made_of(make, wanted, look["color"])
    return box(shown, values, start, called, caption, trail, height)


def check_knobs(
    values: Mapping[str, Sequence[Value]],
    start: Mapping[str, Value] | None,
    labels: Mapping[str, str] | None,
) -> tuple[dict[str, tuple], dict[str, Value], dict[str, str]]:
    """Values, starts and labels of knobs, whole; raises ViewerError."""
    values = {name: tuple(some) for name, some in values.items()}
    start = {name: some[0] for name, some in values.items() if some} | dict(start or {})
    for name, some in values.items():
        words = {isinstance(value, str) for value in some}
        rising = words == {True} or (words == {False} and list(some) == sorted(some))
        if len(set(some)) < max(2, len(some)) or not rising or start[name] not in some:
            raise ViewerError(
                f"knobs: {name} has the values {some} and starts at {start.get(name)}; give two or "
                "more numbers in rising order, or different words, and start at one of them."
            )
    if not values or set(start) != set(values):
        raise ViewerError(f"knobs: values for {list(values)}, start for {list(start)}.")
    return values, start, {name: (labels or {}).get(name, name) for name in values}


def _page(make, values, start, called, caption, trail, color, height) -> PageFigure:
    counts = [range(len(some)) for some in values.values()]
    if (settings := math.prod(map(len, counts))) > MOST:
        raise ViewerError(f"knobs: {settings} settings are too many for a page ({MOST}).")
    tracks, made, fps, packed = [], {}, 30.0, {}
    for at in itertools.product(*counts):
        wanted = {name: some[i] for (name, some), i in zip(values.items(), at, strict=True)}
        track, fps, said = made_of(make, wanted, color)
        seen = (track.positions.numpy().tobytes(), None if track.contacts is None
                else track.contacts.numpy().tobytes())  # fmt: skip
        if seen not in packed:  # many a knob does nothing while another is off
            packed[seen] = len(tracks)
            tracks.append(track)
        made[",".join(map(str, at))] = packed[seen], said
    first = [some.index(start[name]) for name, some in values.items()]
    chosen, said = made[",".join(map(str, first))]
    content = payload(
        tracks, fps, trail=trail_points(trail, tracks), height=height, overlay=False, follow=True,
        autoplay=True, choose="setting", chosen=chosen,
    )  # fmt: skip
    names = named(values)
    return PageFigure(
        _PAGE.format(
            key=f"knobs-{uuid.uuid4().hex[:8]}",
            player=page_html(content, still_picture(tracks[chosen])),
            inputs="".join(map(page_input, called.values(), values.values(), first, names)),
            said=html.escape(said),
            made=json.dumps([names, made], separators=(",", ":")).replace("<", "\\u003c"),
            caption=f"<figcaption>{html.escape(caption)}</figcaption>" if caption else "",
        )
    )


def named(values: Mapping[str, Sequence[Value]]) -> list[list[str]]:
    """What a page calls the values of each knob."""
    call = lambda value: value if isinstance(value, str) else f"{value:g}"
    return [[call(value) for value in some] for some in values.values()]


def page_input(label: str, some: Sequence[Value], at: int, names: Sequence[str]) -> str:
    """A knob of a page: a box, a list of words, or a slider over the numbers of its values."""
    if is_box(some):
        ticked = " checked" if at else ""
        return f'<label><input type="checkbox" autocomplete="off"{ticked}> {html.escape(label)}</label>'
    if is_list(some):
        options = "".join(
            f'<option value="{i}"{" selected" if i == at else ""}>{html.escape(name)}</option>'
            for i, name in enumerate(names)
        )
        return f'<label>{html.escape(label)} <select autocomplete="off">{options}</select></label>'
    return (
        f'<label>{html.escape(label)} <input type="range" autocomplete="off" min="0" '
        f'max="{len(some) - 1}" value="{at}"><output>{names[at]}</output></label>'
    )


def made_of(make: Callable, wanted: Mapping[str, Value], color: str) -> tuple[Track, float, str]:
    """What is shown of one setting: a track, its rate, and a line of text."""
    found = make(**wanted)
    match found:
        case (Motion() as motion, str(said)):
            positions = motion.positions().detach().cpu()
            skeleton, name = motion.skeleton, motion.name
            track = Track(positions, skeleton, "", color, motion.contacts, name, motion)
            return track, float(motion.fps), said
    raise ViewerError(f"knobs: make gave {found!r}; it must give a Motion and a line of text.")
