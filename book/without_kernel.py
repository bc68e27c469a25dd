"""What a built page shows in place of widgets, which need a kernel: what they showed last.

What a reader can move in a page is a page figure (`motionlab.viewer.knobs` and others), no widget; so
no page loads the widget manager, which weighs 3.6 MB.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import Any

import nbformat

VIEW = "application/vnd.jupyter.widget-view+json"
STATE = "application/vnd.jupyter.widget-state+json"
Widget = dict[str, Any]  # as saved with a page: model_name, state


def without_widgets(page: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The page with no widgets: progress bars are left out, sliders become a line and what they gave.

    Cells and their metadata stay as they are: by these MyST-NB finds a page in its cache.

    Raises
    ------
    ValueError : a widget that shows neither; the message names the cell.
    """
    saved = page.metadata.pop("widgets", {}).get(STATE, {}).get("state", {})
    code = [cell for cell in page.cells if cell.cell_type == "code"]
    for at, cell in enumerate(code, 1):
        cell.outputs = [new for output in cell.outputs for new in _in_page(output, saved, at)]
    return page


def _in_page(output: Widget, saved: dict[str, Widget], cell: int) -> list[Widget]:
    """What stands in a page for one output of a cell."""
    if VIEW not in output.get("data", {}):
        return [output]
    tree = list(_tree(output["data"][VIEW]["model_id"], saved))
    if any(widget["model_name"] == "FloatProgressModel" for widget in tree):
        return []
    given = [new for widget in tree for new in widget["state"].get("outputs", ())]
    if not given:
        raise ValueError(
            f"code cell {cell}: a widget that a page can't move; show what a page can: viewer.knobs"
        )
    settings = [f"{w['state']['description']} {w['state']['value']:g}" for w in tree if _slides(w)]
    note = f"A kernel has sliders here; this page shows {', '.join(settings)}:"
    line = {"text/html": f"<p><small>{html.escape(note)}</small></p>", "text/plain": note}
    return [nbformat.v4.new_output("display_data", line), *map(nbformat.from_dict, given)]


def _tree(name: str, saved: dict[str, Widget]) -> Iterator[Widget]:
    """A widget and all in it; nothing for one that was closed."""
    if name in saved:
        yield saved[name]
        for child in saved[name]["state"].get("children", ()):
            yield from _tree(child.removeprefix("IPY_MODEL_"), saved)


def _slides(widget: Widget) -> bool:
    state = widget["state"]
    return "description" in state and isinstance(state.get("value"), int | float)
