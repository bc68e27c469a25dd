"""A figure as a page of its own: one file that opens from disk, without kernel or network."""

from __future__ import annotations

import html
from collections.abc import Sequence

from .figure import PageFigure
from .player import bundle_path

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 1rem/1.5 system-ui, sans-serif; max-width: 72rem; margin: 1rem auto; padding: 0 1rem; }}
h1 {{ font-size: 1.2rem; margin: 0; }}
p {{ margin: 0; opacity: 0.75; }}
p.note {{ opacity: 1; }}
</style>
</head>
<body>
<h1>{title}</h1>
<p>{text}</p>
{notes}{figure}
{below}
<script>{script}</script>
</body>
</html>
"""


def whole_page(
    figure: PageFigure, title: str, text: str = "", notes: Sequence[str] = (), below: str = ""
) -> str:
    """The HTML of a page that holds one figure and the script that brings it to life.

    notes : what whoever looks at it should know, a line each above the figure. below : HTML below it.
    """
    # "</script>" inside the script would end the element
    script = bundle_path().read_text(encoding="utf-8").replace("</script", "<\\/script")
    lines = "".join(f'<p class="note">note: {html.escape(note)}</p>\n' for note in notes)
    return _PAGE.format(
        title=html.escape(title), text=html.escape(text), notes=lines, figure=figure.html,
        below=below, script=script,
    )  # fmt: skip
