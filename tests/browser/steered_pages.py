"""Pages with somebody to steer, and what their tests share.

A loaded machine makes few frames a second. So nothing here waits for a clock: it waits for frames, and
counts them.
"""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab.viewer.live.player import bundle_path
from motionlab.viewer.live.steer_page import page_figure
from motionlab.viewer.live.steer_settings import Look

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>steer</title>
<script src="player.js"></script><body style="margin: 8px">{}<p style="height: 2000px">.</p>
<p id="end">end</p></body></html>"""
LOOK = Look(1.2, 4, 240, "#dc740a")
PATIENCE = 60_000  # milliseconds
SECOND = 30  # frames


def write_pages(folder: Path) -> None:
    """page.html with a network that is quickly loaded and walks somehow; shipped.html with one that
    walks; beside.html, two under the same keys; missing.html without its weights."""
    tiny = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "stand"))
    tiny.sampling = {"temperature": 0.3}
    shutil.copy(bundle_path(), folder / "player.js")
    shipped = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    pages = {
        "page": page_figure([(tiny, None), shipped], (), LOOK, "Steered"),
        "shipped": page_figure([shipped], (), LOOK),
        "beside": page_figure([(tiny, None)], (1, 3), LOOK),
        "at_once": page_figure([(tiny, None)], (), LOOK, at_once=True),
    }
    for name, figure in pages.items():
        for script in (figure.weights, *figure.others):
            script.write(folder / "_static")
        (folder / f"{name}.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    for name, page in {"missing": "page", "missing_at_once": "at_once"}.items():
        broken = pages[page].html.replace("_static/motionlab-weights", "_static/no-such")
        (folder / f"{name}.html").write_text(PAGE.format(broken), encoding="utf-8")


def value(page, of: str):
    return page.evaluate(f"document.querySelector('figure').motionlab.{of}")


def until(page, expression: str) -> None:
    page.wait_for_function(
        f"(() => {{ const figure = document.querySelector('figure').motionlab; return {expression} }})()",
        timeout=PATIENCE,
    )


def load(page):
    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=PATIENCE)
    return page.locator("figure canvas")


def frames_pass(page, count: int) -> None:
    """So many frames more are seen."""
    until(page, f"figure.player.frame >= {value(page, 'player.frame') + count}")


def settled(page, way: float, within: float, frames: int) -> int:
    """Frames until he goes some way (degrees), judged frame by frame from the newest on."""
    first = value(page, "steered.last")
    off = f"Math.abs(Math.atan2(Math.sin(going.bearing - {math.radians(way)}), Math.cos(going.bearing - {math.radians(way)})))"
    until(
        page,
        f"figure.steered.last > {first + frames} || figure.steered.characters.every(({{ before: {{ going }} }}) => {off} < {math.radians(within)})",
    )
    return value(page, "steered.last") - first
