"""Let a network dream under sliders; in a page it runs in the reader's browser.

A page has no kernel. So the weights travel as a script beside the page, rounded to a byte each, and
are loaded when the reader asks for them; web/src/network/ holds the network in plain JavaScript.
Until then, and where nothing can be loaded, the figure plays clips that were sampled beforehand.
"""

from __future__ import annotations

import html
import inspect
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ..errors import ViewerError
from . import palette
from .body import body
from .network_weights import WeightsScript, check_known, weights_script
from .player import Track, bundle_path, payload
from .show import still_picture, trail_points


@dataclass(frozen=True)
class Control:
    """A setting that the reader may change: the same in a page and in a notebook's widgets."""

    name: str  # as `generate` calls it, where it knows it
    label: str
    help: str
    min: float
    max: float
    step: float
    value: float


CONTROLS = (
    Control("start", "Start", "What the body was doing before the network took over", 0, 0, 1, 0),
    Control("temperature", "Temperature", "Factor on the standard deviations: 1 is what was "
            "learned, less is calmer", 0.05, 2, 0.01, 1),
    Control("component_temperature", "Component temperature", "Near 0 the likeliest component "
            "always wins; 1 is what was learned", 0.05, 2, 0.05, 1),
    Control("noise", "Input noise", "Standard deviation of what is added to all that the network "
            "sees", 0, 1, 0.01, 0),
    Control("characters", "Characters", "As many futures of the same start", 1, 6, 1, 1),
    Control("seed", "Seed", "The same seed gives the same motion", 0, 9999, 1, 0),
)  # fmt: skip
_OF_EVERY_MODEL = ("start", "characters", "seed")


def controls_of(model: nn.Module) -> list[Control]:
    """Those that a model has a use for: what its `generate` takes decides."""
    takes = inspect.signature(model.generate).parameters
    return [c for c in CONTROLS if c.name in _OF_EVERY_MODEL or c.name in takes]


def dream(
    model: nn.Module,
    *,
    seconds: float = 10.0,
    characters: int = 1,
    trail: str | int | Sequence[str | int] | None = None,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 380,
) -> Any:
    """Let a trained network go on from one of its starts, under sliders.

    In a running kernel Python samples, and ipywidgets act on it; see `dream_live`. In a built page
    the network itself runs, without end: see `page_figure`.

    Parameters
    ----------
    model : as `motionlab.load` gives it.
    seconds : how long the motion is at first, in a kernel; a page goes on without end.
    characters : how many futures of a start there are at first.
    trail : joints (names, roles or point indices) that leave a trail; by default hips and toes.
    color : a method's name or a colour.
    caption : a text below the figure.
    height : of the picture, pixels.

    Raises
    ------
    ViewerError : another kind of model, or one without starts.
    """
    look = {"trail": trail, "color": palette.check_color(color), "height": height}
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return page_figure(model, characters, caption, **look)
    from .dream_live import controls

    return controls(model, seconds, characters, caption, **look)


def page_figure(
    model: nn.Module,
    characters: int = 1,
    caption: str | None = None,
    *,
    seconds: float = 2.0,
    trail: str | int | Sequence[str | int] | None = None,
    color: str = "RNN",
    height: int = 380,
) -> Dream:
    """What `dream` is in a built page: no kernel, no server, also from disk.

    Parameters as of `dream`, but for `seconds`: how long the clips are, one from each start, that
    are sampled beforehand. The model must be an `LstmGmm` or an `AcLstm`, on `JointAngles` with
    rotation vectors or on `RootRelative` with absolute heights.
    """
    check_known(model)
    check_starts(model)
    color = palette.check_color(color)
    weights = weights_script(model, getattr(model, "about", {}).get("name", "network"))
    sampling = getattr(model, "sampling", {})
    frames = round(seconds * model.fps)
    tracks = sampled_tracks(model, model.starts, frames, seed=0, color=color, **sampling)
    common = {"height": height, "autoplay": True, "trail": trail_of(trail, tracks)}
    clips = [payload([track], model.fps, follow=True, overlay=False, **common) for track in tracks]
    dress = body(model.encoding.skeleton)
    live = {
        **common,
        "name": weights.name,
        "script": f"_static/{weights.file}",
        "megabytes": f"{len(weights.text) / 1e6:.1f}",
        "floor": float(np.median([clip["floor"] for clip in clips])),
        "look": {
            "label": "",
            "color": color,
            "bones": [list(bone) for bone in dress.bones],
            "extras": [list(extra) for extra in dress.extras],
            "contactPoints": list(dress.feet),
            "contacts": "contacts" in model.encoding.slices,
            "tall": max(float(track.positions[..., 1].max()) for track in tracks),
        },
    }
    values = {"characters": characters, **sampling}
    content = {
        "clips": clips,
        "live": live,
        "starts": list(model.start_names),
        "controls": [
            asdict(c) | {"value": values.get(c.name, c.value)} for c in controls_of(model)
        ],
        "facts": _provenance(model, weights),
    }
    return Dream(content, weights, still_picture(tracks[0]), caption)


class Dream:
    """The figure of a page. In a book it finds its weights in ``_static``; elsewhere it brings them
    along."""

    def __init__(self, content: dict, weights: WeightsScript, still: str, caption: str | None):
        self.content, self.weights, self.still, self.caption = content, weights, still, caption

    def _repr_html_(self) -> str:
        folder = os.environ.get("MOTIONLAB_SCRIPTS")  # set by a book's build
        if folder:
            self.weights.write(folder)
            return self.html
        page = html.escape(self.page(), quote=True)
        height = self.content["live"]["height"] + 420
        return f'<iframe srcdoc="{page}" style="border:0;width:100%;height:{height}px"></iframe>'

    @property
    def html(self) -> str:
        """The figure for a page that has the player's script."""
        # "</script>" inside a string would end the element: escape every "<".
        data = json.dumps(self.content, separators=(",", ":")).replace("<", "\\u003c")
        text = f"<figcaption>{html.escape(self.caption)}</figcaption>" if self.caption else ""
        return (
            '<figure class="motionlab-dream" style="margin:1rem 0">'
            f'<script type="application/json">{data}</script>'
            f'<noscript><img src="{self.still}" alt="Still picture of a sampled motion" '
            f'style="max-width:100%"></noscript>{text}</figure>'
        )

    def page(self) -> str:
        """A page that needs no other file."""
        scripts = [bundle_path().read_text(encoding="utf-8"), self.weights.text]
        # the words would end the element
        scripts = [script.replace("</script", r"<\/script") for script in scripts]
        inline = "".join(f"<script>{script}</script>" for script in scripts)
        return (
            '<!doctype html><html lang="en"><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width"><title>dream</title>'
            f'{inline}<body style="margin:8px">{self.html}</body></html>'
        )

    def save(self, path: str | Path) -> Path:
        """Write a page that holds figure, player and weights; returns its path."""
        path = Path(path)
        path.write_text(self.page(), encoding="utf-8")
        return path


def check_starts(model: nn.Module) -> None:
    """Raise ViewerError if a model has no states to start from."""
    if not getattr(model, "start_names", ()):
        raise ViewerError(
            "This model has no states to start from; motionlab.load gives it some, or set "
            "model.starts = model.observe(features) and model.start_names = ('name', ...)."
        )


@torch.no_grad()
def sampled_tracks(
    model: nn.Module, state: Any, frames: int, *, seed: int, color: str, **sampling: float
) -> list[Track]:
    """What a player shows of motions that go on from a state, its own frame first."""
    chance = torch.Generator(next(model.parameters()).device).manual_seed(seed)
    sampled = model.generate(frames, state, generator=chance, **sampling)
    features = torch.cat([state.frame[:, None].to(sampled), sampled], dim=1).cpu()
    encoding = model.encoding
    # Features of points have them: through `to_motion` they would be bent to the bones' lengths.
    points, contacts = encoding.positions(features), encoding.contacts(features)
    skeleton = encoding.skeleton
    if encoding.points != skeleton.points:  # joints alone
        skeleton = skeleton.without_end_sites()
    feet = [None] * len(points) if contacts is None else touching(contacts)
    return [Track(p, skeleton, "", color, f) for p, f in zip(points, feet, strict=True)]


def trail_of(trail: str | int | Sequence[str | int] | None, tracks: list[Track]) -> list[int]:
    """Points that leave a trail; by default hips and toes, or feet where a body has no toes."""
    if trail is None:
        toes = ("left_toes", "right_toes")
        roles = tracks[0].skeleton.roles
        trail = ["hips", *(t if t in roles else t.replace("toes", "foot") for t in toes)]
    return trail_points(trail, tracks)


def touching(contacts: Tensor) -> Tensor:
    """Heels and toes (..., 4) on the ground, from an encoding's channels; some have toes alone."""
    if contacts.shape[-1] == 2:
        left, right = contacts.unbind(-1)
        never = torch.zeros_like(left)
        contacts = torch.stack([never, left, never, right], dim=-1)
    return contacts > 0.5


def _provenance(model: nn.Module, weights: WeightsScript) -> list[tuple[str, str]]:
    """What a reader may want to know of the weights; as much of it as the model says."""
    about = getattr(model, "about", {})
    parameters = sum(parameter.numel() for parameter in model.parameters())
    made = about.get("preset", {})
    mixture = f"{model.components} Gaussians, " if hasattr(model, "components") else ""
    lstm = f"LSTM of {model.starts.hidden.shape[1]} × {model.width}"
    known = {
        "Weights": about.get("name"),
        "sha256": getattr(model, "hash", None),
        "Network": f"{lstm}, {mixture}{parameters:,} numbers",
        "In this page": f"{weights.file}: whole numbers of a byte, and a scale for each row",
        "Made by": about.get("command"),
        "Seed": made.get("seed"),
        "Data": about.get("data_name"),
        "sha256 of the data": about.get("data"),
    }
    return [(name, str(value)) for name, value in known.items() if value not in (None, "")]
