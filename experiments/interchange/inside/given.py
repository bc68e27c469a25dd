"""What a script in a program's own environment is given, and how it tells what it saw."""

import json
import sys
from pathlib import Path

FOLDER = Path(sys.argv[1])
WAY = sys.argv[2] if len(sys.argv) > 2 else ""
BVH, GLB = (str(FOLDER / f"clip.{kind}") for kind in ("bvh", "glb"))
BACK_BVH, BACK_GLB = (str(FOLDER / f"back.{kind}") for kind in ("bvh", "glb"))


def numbers():
    """The motion as numbers, see experiments/interchange/clips.py."""
    return json.loads((FOLDER / "clip.json").read_text(encoding="utf-8"))


def see(**seen):
    """names, fps, positions [frame][point][3]; maybe rotations (world, x y z w), ends, start."""
    listed = {
        key: getattr(value, "tolist", lambda value=value: value)() for key, value in seen.items()
    }
    (FOLDER / "seen.json").write_text(json.dumps(listed), encoding="utf-8")
