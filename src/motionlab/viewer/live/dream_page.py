"""A network that dreams in a built page: it runs in the reader's browser, without end.

A page has no kernel. So the weights travel as a script beside the page, rounded to a byte each, and
are loaded when the reader asks for them; web/src/network/ holds the network in JavaScript.
Until then, and where nothing can be loaded, the figure plays clips that were sampled beforehand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from torch import nn

from ..pictures import palette
from .dream_settings import check_starts, controls_of, name_of, sampled_tracks, trail_of
from .network_figure import NetworkFigure, live_of, provenance
from .network_weights import check_known, weights_script
from .player import payload
from .show import still_picture


def page_figure(
    model: nn.Module,
    characters: int = 1,
    caption: str | None = None,
    *,
    start: int = 0,
    seconds: float = 2.0,
    trail: str | int | Sequence[str | int] | None = None,
    color: str = "RNN",
    height: int = 380,
    refiner: nn.Module | None = None,
) -> NetworkFigure:
    """What `dream` is in a built page: no kernel, no server, also from disk.

    Parameters as of `dream`, but for `seconds`: how long the clips are, one from each start, that
    are sampled beforehand. The model must be an `LstmGmm` or an `AcLstm`, on `JointAngles` with
    rotation vectors or on `RootRelative` with absolute heights.
    """
    check_known(model)
    check_starts(model, start)
    color = palette.check_color(color)
    weights = weights_script(model, name_of(model), refiner=refiner)
    sampling = getattr(model, "sampling", {})
    frames = round(seconds * model.fps)
    tracks = sampled_tracks(
        model, model.starts, frames, seed=0, color=color, refiner=refiner, **sampling
    )
    common = {"height": height, "autoplay": True, "trail": trail_of(trail, tracks)}
    clips = [payload([track], model.fps, follow=True, overlay=False, **common) for track in tracks]
    live = {**common, **live_of(model, weights, tracks, color)}
    values = {"characters": characters, "start": start, **sampling}
    content = {
        "clips": clips,
        "live": live,
        "starts": list(model.start_names),
        "controls": [
            asdict(c) | {"value": values.get(c.name, c.value)} for c in controls_of(model, refiner)
        ],
        "facts": provenance(model, weights, refiner),
    }
    return NetworkFigure(content, weights, still_picture(tracks[start]), caption)
