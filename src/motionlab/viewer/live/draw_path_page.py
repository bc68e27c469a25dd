"""A path drawn in a built page: the page's own network walks along it, by guided sampling.

A page has no kernel, so nothing can be searched there. But the network can be led (see
`motionlab.solvers.guided`; web/src/network/guided.js is the same), which keeps the gait and costs
nothing, though it does not keep to the path by the centimetre: how far off it was is printed beside.
Paths that were solved beforehand show what the search makes of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from torch import nn

from ..pictures.palette import check_color
from .draw_path_settings import check_model, content_of, sampled
from .dream_settings import name_of
from .network_figure import NetworkFigure, live_of, provenance
from .network_weights import check_known, weights_script
from .show import still_picture

PLAIN = {"temperature": 1.0, "component_temperature": 1.0, "memory": 0.0, "noise": 0.0}
ROOM = 900  # pixels for board, settings and what is said


def page_figure(
    model: nn.Module,
    solved: Sequence[Sequence] = (),
    speed: float = 1.2,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 380,
    refiner: nn.Module | None = None,
) -> NetworkFigure:
    """What `draw_path` is in a built page: no kernel, no server, also from disk. Parameters as there."""
    check_model(model)
    check_known(model)
    color = check_color(color)
    weights = weights_script(model, name_of(model), refiner=refiner)
    tracks = sampled(model, color)
    live = live_of(model, weights, tracks, color)
    live |= {"height": height, "settings": PLAIN | getattr(model, "sampling", {})}
    content = content_of(model, solved, speed, height, live["floor"], refiner)
    content |= {"live": live, "facts": provenance(model, weights, refiner)}
    return NetworkFigure(content, weights, still_picture(tracks[0]), caption, "path", ROOM)
