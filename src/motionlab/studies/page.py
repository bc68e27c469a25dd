"""The page on which people judge: one file that opens from disk, and asks the network for nothing."""

from __future__ import annotations

import html
import json
import os

from ..viewer.live.figure import PageFigure
from ..viewer.live.whole_page import whole_page
from .build import Built


def study_figure(built: Built, *, reveal: bool = False) -> PageFigure:
    """The study as a figure of a page that has the player's script, as the book's pages have.

    reveal : at the end raters see what their own answers say of each method. Then the page knows
        which clip is whose, and who looks into its source sees it, too.
    """
    content = built.content
    if reveal:
        whose = {clip.id: {"method": clip.method, "gait": clip.gait} for clip in built.study.clips}
        content = {**content, "key": whose}
    # "</script>" inside a string would end the element: escape every "<".
    data = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
    return PageFigure(
        '<figure class="motionlab-study">'
        f'<script type="application/json">{data}</script>'
        "<noscript>This study needs JavaScript: allow scripts for this page, and reload it.</noscript>"
        "</figure>"
    )


def study_here(built: Built, *, reveal: bool = False, height: int = 720) -> PageFigure:
    """The study where a notebook is read: in a built page as `study_figure`, in a kernel as a page within
    the page, `height` pixels high."""
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return study_figure(built, reveal=reveal)
    page = html.escape(study_page(built, reveal=reveal))
    title = html.escape(built.study.title)
    return PageFigure(
        f'<iframe srcdoc="{page}" title="{title}" style="width: 100%; height: {height}px; border: 0"></iframe>'
    )


def study_page(built: Built, *, reveal: bool = False) -> str:
    """The HTML of the whole page."""
    return whole_page(study_figure(built, reveal=reveal), built.study.title)
