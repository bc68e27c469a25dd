"""A figure in which a network runs in the reader's browser, and what it needs of the network."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from .dream_settings import name_of
from .network_weights import WeightsScript
from .player import Track, bundle_path, dressed, floor_height


class NetworkFigure:
    """The figure of a page. In a book it finds its weights in ``_static``; elsewhere it brings them
    along.

    content : what web/src/page.js hands to it; still : a picture, as a data URL.
    kind : which of the page's figures it is: "dream", "path" or "steer".
    room : pixels, beside the picture's height, that a frame of its own needs.
    others : scripts of more weights that its reader may load.
    """

    def __init__(
        self,
        content: dict,
        weights: WeightsScript,
        still: str,
        caption: str | None,
        kind: str = "dream",
        room: int = 420,
        others: Sequence[WeightsScript] = (),
    ):
        self.content, self.weights, self.still, self.caption = content, weights, still, caption
        self.kind, self.room, self.others = kind, room, others

    def _repr_html_(self) -> str:
        folder = os.environ.get("MOTIONLAB_SCRIPTS")  # set by a book's build
        if folder:
            for script in (self.weights, *self.others):
                script.write(folder)
            return self.html
        page = html.escape(self.page(), quote=True)
        height = self.content["live"]["height"] + self.room
        return f'<iframe srcdoc="{page}" style="border:0;width:100%;height:{height}px"></iframe>'

    @property
    def html(self) -> str:
        """The figure for a page that has the player's script."""
        # "</script>" inside a string would end the element: escape every "<".
        data = json.dumps(self.content, separators=(",", ":")).replace("<", "\\u003c")
        text = f"<figcaption>{html.escape(self.caption)}</figcaption>" if self.caption else ""
        return (
            f'<figure class="motionlab-{self.kind}" style="margin:1rem 0">'
            f'<script type="application/json">{data}</script>'
            f'<noscript><img src="{self.still}" alt="Still picture of a sampled motion" '
            f'style="max-width:100%"></noscript>{text}</figure>'
        )

    def page(self) -> str:
        """A page that needs no other file."""
        scripts = [bundle_path().read_text(encoding="utf-8"), self.weights.text]
        scripts += [script.text for script in self.others]
        # the words would end the element
        scripts = [script.replace("</script", r"<\/script") for script in scripts]
        inline = "".join(f"<script>{script}</script>" for script in scripts)
        return (
            '<!doctype html><html lang="en"><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width"><title>motionlab</title>'
            f'{inline}<body style="margin:8px">{self.html}</body></html>'
        )

    def save(self, path: str | Path) -> Path:
        """Write a page that holds figure, player and weights; returns its path."""
        path = Path(path)
        path.write_text(self.page(), encoding="utf-8")
        return path


def live_of(
    model: nn.Module, weights: WeightsScript, tracks: Sequence[Track], color: str
) -> dict[str, Any]:
    """What a page must know to load a network and to draw who it moves.

    tracks : some of its motion, which tells where the floor is and how tall the body.
    """
    return {
        "name": weights.name,
        "script": f"_static/{weights.file}",
        "megabytes": f"{len(weights.text) / 1e6:.1f}",
        "floor": float(np.median([floor_height(track) for track in tracks])),
        "look": {
            **dressed(model.encoding.skeleton),
            "label": "",
            "name": name_of(model),
            "color": color,
            "contacts": "contacts" in model.encoding.slices,
            "tall": max(float(track.positions[..., 1].max()) for track in tracks),
        },
    }


def provenance(
    model: nn.Module, weights: WeightsScript, refiner: nn.Module | None = None
) -> list[tuple[str, str]]:
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
        "Refined by": getattr(refiner, "about", {}).get("name", refiner and type(refiner).__name__),
        "In this page": f"{weights.file}: whole numbers of a byte, and a scale for each row",
        "Made by": about.get("command"),
        "Seed": made.get("seed"),
        "Data": about.get("data_name"),
        "sha256 of the data": about.get("data"),
    }
    return [(name, str(value)) for name, value in known.items() if value not in (None, "")]
