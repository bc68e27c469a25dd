"""What a page shows where no kernel runs."""

from __future__ import annotations


class PageFigure:
    """A figure of a built page: plain HTML, no kernel and no widget state."""

    def __init__(self, html: str) -> None:
        self.html = html

    def _repr_html_(self) -> str:
        return self.html
