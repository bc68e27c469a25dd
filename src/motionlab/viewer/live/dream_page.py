"""A network that dreams in a built page: it runs in the reader's browser, without end.

A page has no kernel. So the weights travel as a script beside the page, rounded to a byte each, and
are loaded when the reader asks for them; web/src/network/ holds the network in plain JavaScript.
Until then, and where nothing can be loaded, the figure plays clips that were sampled beforehand.
"""

from __future__ import annotations

import html
import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from torch import nn

from ..pictures import palette
from .dream_settings import check_starts, controls_of, name_of, sampled_tracks, trail_of
from .network_weights import WeightsScript, check_known, weights_script
from .player import bundle_path, dressed, payload
from .show import still_picture


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
    weights = weights_script(model, name_of(model))
    sampling = getattr(model, "sampling", {})
    frames = round(seconds * model.fps)
    tracks = sampled_tracks(model, model.starts, frames, seed=0, color=color, **sampling)
    common = {"height": height, "autoplay": True, "trail": trail_of(trail, tracks)}
    clips = [payload([track], model.fps, follow=True, overlay=False, **common) for track in tracks]
    dress = dressed(model.encoding.skeleton)
    live = {
        **common,
        "name": weights.name,
        "script": f"_static/{weights.file}",
        "megabytes": f"{len(weights.text) / 1e6:.1f}",
        "floor": float(np.median([clip["floor"] for clip in clips])),
        "look": {
            **dress,
            "label": "",
            "name": name_of(model),
            "color": color,
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
