"""Let a network dream under sliders: in a kernel, or in a page with the reader's browser."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from torch import nn

from ..pictures import palette
from .dream_kernel import controls
from .dream_page import page_figure


def dream(
    model: nn.Module,
    *,
    seconds: float = 10.0,
    characters: int = 1,
    start: int = 0,
    trail: str | int | Sequence[str | int] | None = None,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 380,
    refiner: nn.Module | None = None,
) -> Any:
    """Let a trained network go on from one of its starts, under sliders.

    In a running kernel Python samples, and ipywidgets act on it; see `dream_kernel`. In a built page
    the network itself runs, without end: see `page_figure`.

    Parameters
    ----------
    model : as `motionlab.load` gives it.
    seconds : how long the motion is at first, in a kernel; a page goes on without end.
    characters : how many futures of a start there are at first.
    start : number of the start that is seen first, among the model's `starts`.
    trail : joints (names, roles or point indices) that leave a trail; by default hips and toes.
    color : a method's name or a colour.
    caption : a text below the figure.
    height : of the picture, pixels.
    refiner : a `Refiner` of what the model makes; what is shown is refined, unless the reader ticks
        that off, and the model goes on from what it made itself.

    Raises
    ------
    ViewerError : another kind of model, one without starts or without that one, or a refiner of
        other features.
    """
    look = {"trail": trail, "color": palette.check_color(color), "height": height}
    look["refiner"] = refiner
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return page_figure(model, characters, caption, start=start, **look)
    return controls(model, seconds, characters, start, caption, **look)
