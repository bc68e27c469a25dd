"""A steered character in a built page: the page's own network makes the frames, in the browser.

web/src/steering/ is the other side; weights are the script that dreams and drawn paths of the same network
load, so that a reader gets them once.
"""

from __future__ import annotations

from collections.abc import Sequence

from torch import nn

from .dream_settings import name_of, sampled_tracks
from .network_figure import NetworkFigure, live_of, provenance
from .network_weights import WeightsScript, check_known, weights_script
from .player import Track, payload
from .show import still_picture
from .steer_settings import ONWARD, Look, body_of, cast_of, check_model, choice_of, controls_of

ROOM = 760  # pixels for settings and what is told
CLIP = 2.0  # seconds of a clip that is seen until the network is loaded
KEPT = 120  # seconds that can be saved, as web/src/steering/steered.js keeps them


def page_figure(
    networks: Sequence[tuple[nn.Module, nn.Module | None]],
    beside: Sequence[int],
    look: Look,
    caption: str | None = None,
    at_once: bool = False,
) -> NetworkFigure:
    """What `steer` is in a built page: no kernel, no server, also from disk.

    networks : (model, refiner) of those that the reader may take; the first is taken at first.
    beside, caption, at_once : as of `steer`; look : the rest of it.
    """
    made = [_network(model, refiner, look) for model, refiner in networks]
    scripts, (tracks, *_) = [script for _, script, _ in made], [tracks for *_, tracks in made]
    content = {
        "networks": [network for network, *_ in made],
        "live": made[0][0]["live"],
        "beside": cast_of(beside, look.color),
        "height": look.height,
        "kept": KEPT,
        "at_once": at_once,
        "restarts": ["start", "seed"],  # settings that can't change in the middle of a motion
    }
    if at_once:
        _walking(content["networks"])
    still = still_picture(tracks[0])
    return NetworkFigure(content, scripts[0], still, caption, "steer", ROOM, scripts[1:])


def _walking(networks: Sequence[dict]) -> None:
    """Nobody asked for them: so they walk until somebody steers."""
    for network in networks:
        next(each for each in network["controls"] if each["name"] == ONWARD.name)["value"] = 1


def _network(
    model: nn.Module, refiner: nn.Module | None, look: Look
) -> tuple[dict, WeightsScript, list[Track]]:
    """What the page knows of a network, its weights, and a little of its motion."""
    check_model(model)
    check_known(model)
    controls = [*controls_of(model, look, refiner), *choice_of()]
    weights = weights_script(model, name_of(model), refiner=refiner)
    start = next(int(each["value"]) for each in controls if each["name"] == "start")
    tracks = sampled_tracks(
        model, model.starts[[start]], round(CLIP * model.fps), seed=0, color=look.color,
        refiner=refiner, **getattr(model, "sampling", {}),
    )  # fmt: skip
    return {
        "name": name_of(model),
        "live": live_of(model, weights, tracks, look.color) | {"height": look.height},
        "body": body_of(model),
        "starts": list(model.start_names),
        "controls": controls,
        "clip": payload(tracks, model.fps, follow=True, autoplay=True, height=look.height),
        "facts": provenance(model, weights, refiner),
    }, weights, tracks  # fmt: skip
