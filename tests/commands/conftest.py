"""A working directory with files as somebody brings them."""

from __future__ import annotations

import pytest

from motionlab import write_bvh
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working directory with walk.bvh and, in clips/, two files and one that is none."""
    monkeypatch.chdir(tmp_path)
    # drawing it takes ten seconds at first; tests/browser looks at the whole page
    monkeypatch.setattr("motionlab.viewer.live.show.still_picture", lambda track: "data:,")
    write_bvh(WALK, "walk.bvh")
    (tmp_path / "clips" / "more").mkdir(parents=True)
    write_bvh(WALK, "clips/a.bvh")
    write_bvh(WALK[:10], "clips/more/b.bvh")
    (tmp_path / "clips" / "notes.txt").write_text("no clip")
    return tmp_path
