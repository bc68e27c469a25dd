"""A widget as a notebook shows it, in a page of its own: what it sends is kept, and it can be told things."""

from __future__ import annotations

import json
from pathlib import Path

import anywidget

from motionlab.viewer.live.player import STATIC

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><link rel="icon" href="data:,"><title>widget</title>
<body style="margin: 8px"><div id="el"></div><script type="module">
const traits = {traits}, heard = {{}};
globalThis.sent = [];
globalThis.tell = (message) => heard["msg:custom"].forEach((hear) => hear(message));
const model = {{
  get: (name) => traits[name],
  on: (event, hear) => (heard[event] ??= []).push(hear),
  off: () => {{}},
  send: (message) => sent.push(structuredClone(message)),
}};
{esm}
widgetModule.render({{ model, el: document.getElementById("el") }});
globalThis.figure = document.getElementById("el").motionlab;
</script></body></html>"""


def open_widget(visit, folder: Path, made: anywidget.AnyWidget):
    """Open the page of a widget, whose kernel is the test: `sent` is what it asked, `tell` answers."""
    traits = {name: getattr(made, name) for name in ("kind", "content", "caption")}
    esm = (STATIC / "widget.js").read_text(encoding="utf-8")
    end = esm.rindex("export{")
    name = esm[end:].split("{")[1].split(" as ")[0]
    esm = f"{esm[:end]}\nconst widgetModule = {name};"
    page = PAGE.format(
        traits=json.dumps(traits).replace("<", "\\u003c"), esm=esm.replace("</script", "<\\/script")
    )
    (folder / "widget.html").write_text(page, encoding="utf-8")
    opened = visit("widget.html")
    opened.page.wait_for_function("globalThis.figure")
    return opened
