"""Knobs that act on a motion in a running kernel: the kernel's form of `motionlab.viewer.knobs`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import ipywidgets

from ...errors import MotionLabError
from .dream_kernel import LAYOUT, STYLE
from .player import Player, Track, payload
from .show import trail_points

Value = float | str  # of a knob: a number, yes or no, or a word


def box(
    shown: Callable[[Mapping[str, Value]], tuple[Track, float, str]],
    values: Mapping[str, Sequence[Value]],
    start: Mapping[str, Value],
    called: Mapping[str, str],
    caption: str | None,
    trail: Any,
    height: int,
) -> ipywidgets.VBox:
    """A player with a field for each knob; parameters as of `knobs`, `called` its labels.

    shown : of the knobs' values: a track, its rate, and a line of text.
    """
    fields = {name: knob_field(called[name], some, start[name]) for name, some in values.items()}
    said = ipywidgets.Label()

    def content() -> dict[str, Any]:
        wanted = {name: field.value for name, field in fields.items()}
        track, fps, said.value = shown(wanted)
        look = {"height": height, "overlay": False, "follow": True, "autoplay": True}
        return payload([track], fps, trail=trail_points(trail, [track]), **look)

    player = Player(content(), caption=caption or "")

    def turned(_change: Any) -> None:
        try:
            now = content()
        except MotionLabError as error:
            said.value = str(error)
            return
        with player.hold_sync():  # its clock goes on, so that one sees what the knob does
            player.frame, player.payload = min(player.frame, now["frames"] - 1), now

    for field in fields.values():
        field.observe(turned, names="value")
    needs = ipywidgets.HTML("<small>Needs a kernel: computed anew for every setting.</small>")
    return ipywidgets.VBox([player, ipywidgets.VBox(list(fields.values())), said, needs])


def is_box(some: Sequence[Value]) -> bool:
    """Is a knob a box to tick?"""
    return all(isinstance(value, bool) for value in some)


def is_list(some: Sequence[Value]) -> bool:
    """Is a knob a list of words to choose from?"""
    return all(isinstance(value, str) for value in some)


def knob_field(label: str, some: Sequence[Value], value: Value) -> ipywidgets.DOMWidget:
    """A box to tick, a list of words, or a slider, which counts when it is let go."""
    common = {"description": label, "style": STYLE, "layout": LAYOUT}
    if is_box(some):
        return ipywidgets.Checkbox(value=value, **common)
    if is_list(some):
        return ipywidgets.Dropdown(value=value, options=some, **common)
    step = 10.0 ** math.floor(math.log10((some[-1] - some[0]) / 20))
    return ipywidgets.FloatSlider(
        value=value, min=some[0], max=some[-1], step=step, continuous_update=False, **common
    )
