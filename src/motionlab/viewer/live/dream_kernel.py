"""Sliders that act on a network in a running kernel: the kernel's form of `motionlab.viewer.dream`.

The page form steps the network in the browser, without end. Here Python samples a few seconds as
soon as a slider is let go, and the player plays them.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import ipywidgets
from torch import nn

from ...errors import MotionLabError
from .dream_settings import Control, check_starts, controls_of, sampled_tracks, trail_of
from .player import Player, payload

SECONDS = Control("seconds", "Seconds", "How long the motion is", 1, 60, 1, 10)
# Room for the longest label in JupyterLab's letters; else it is cut off.
STYLE = {"description_width": "170px"}
LAYOUT = ipywidgets.Layout(width="440px")


def controls(
    model: nn.Module, seconds: float, characters: int, start: int, caption: str | None, **look: Any
) -> ipywidgets.VBox:
    """A player with sliders for all that `generate` lets one choose; each change samples anew.

    Parameters as of `dream`. Sliders begin at the model's ``sampling``, if it has one.
    """
    check_starts(model, start)
    given = {"seconds": seconds, "characters": characters, "start": start}
    given |= getattr(model, "sampling", {})
    fields = {
        c.name: _field(c, given.get(c.name, c.value), model.start_names)
        for c in (*controls_of(model, look.get("refiner")), SECONDS)
    }
    said = ipywidgets.Label()
    player = Player(_sampled(model, _values(fields), look), caption=caption or "")

    def sample(_change: Any = None) -> None:
        begin = time.perf_counter()
        try:
            content = _sampled(model, _values(fields), look)
        except MotionLabError as error:
            said.value = str(error)
            return
        with player.hold_sync():
            player.frame, player.payload, player.overlay = 0, content, content["overlay"]
            player.playing = True
        said.value = f"{content['frames']} frames in {time.perf_counter() - begin:.2f} s"
        first, *others = content["tracks"]
        if others and all(track == first for track in others):
            said.value += ". Without noise a start has one future: all characters do the same."

    for field in fields.values():
        field.observe(sample, names="value")
    columns = ipywidgets.Layout(grid_template_columns="repeat(auto-fill, 450px)")
    return ipywidgets.VBox(
        [player, ipywidgets.GridBox(list(fields.values()), layout=columns), said]
    )


def _field(control: Control, value: float, starts: Sequence[str]) -> ipywidgets.DOMWidget:
    """The widget for one control. A slider counts when it is let go: in between it would only make
    the kernel sample what nobody looks at."""
    common = {"description": control.label, "tooltip": control.help, "style": STYLE,
              "layout": LAYOUT}  # fmt: skip
    if control.name == "start":
        options = [(name, index) for index, name in enumerate(starts)]
        return ipywidgets.Dropdown(options=options, value=int(value), **common)
    span = {"min": control.min, "max": control.max, "step": control.step}
    if control.name == "refined":
        return ipywidgets.Checkbox(value=bool(value), **common)
    if control.name == "seed":
        return ipywidgets.BoundedIntText(value=int(value), **span, **common)
    whole = all(float(number).is_integer() for number in (*span.values(), value))
    slider = ipywidgets.IntSlider if whole else ipywidgets.FloatSlider
    return slider(value=value, continuous_update=False, **span, **common)


def _values(fields: dict[str, ipywidgets.DOMWidget]) -> dict[str, Any]:
    return {name: field.value for name, field in fields.items()}


def _sampled(model: nn.Module, values: dict[str, Any], look: dict[str, Any]) -> dict[str, Any]:
    """What the player shows for settings: futures of one start, in one picture."""
    values = dict(values)
    frames = max(1, round(values.pop("seconds") * model.fps))
    start, count = values.pop("start"), values.pop("characters")
    refiner = look["refiner"] if values.pop("refined", True) else None
    state = model.starts[[start] * count]
    tracks = sampled_tracks(model, state, frames, color=look["color"], refiner=refiner, **values)
    return payload(
        tracks,
        model.fps,
        trail=trail_of(look["trail"], tracks),
        height=look["height"],
        overlay=count > 1,
        follow=True,
        autoplay=True,
    )
