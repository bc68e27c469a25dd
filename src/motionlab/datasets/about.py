"""What is said about a data set, in a terminal and in a notebook."""

from __future__ import annotations

import html
import textwrap
from dataclasses import dataclass


@dataclass(frozen=True, repr=False)
class Info:
    """A data set at a glance: how much, under which licence, with what peculiarities."""

    name: str
    title: str
    clips: int
    minutes: float
    bytes: int
    licence: str
    commercial: bool
    citation: str
    home: str
    quirks: tuple[str, ...]
    splits: dict[str, int]

    def _rows(self) -> list[tuple[str, str]]:
        size = f", {self.bytes / 1e6:.1f} MB of files" if self.bytes else ""
        splits = ", ".join(f"{count} {name}" for name, count in self.splits.items())
        return [
            ("clips", f"{self.clips} ({splits}), {self.minutes:.1f} minutes{size}"),
            ("licence", self.licence),
            ("cite", self.citation),
            ("home", self.home),
            *(("quirk", quirk) for quirk in self.quirks),
        ]

    def __repr__(self) -> str:
        rows = [
            textwrap.fill(f"  {key:8} {value}", 100, subsequent_indent=" " * 11)
            for key, value in self._rows()
            if value
        ]
        return "\n".join([f"{self.name}: {self.title}", *rows])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{key}</th>"
            f"<td style='text-align:left'>{html.escape(value)}</td></tr>"
            for key, value in self._rows()
            if value
        )
        title = f"<caption><b>{self.name}</b>: {html.escape(self.title)}</caption>"
        return f"<table>{title}{rows}</table>"
