"""The two clips that go through every program, and the files of them that a program is given."""

from __future__ import annotations

import json
from pathlib import Path

import roma

from motionlab import Motion, datasets, io
from motionlab.datasets import gaits

REAL = ("accad", "Male1_B15_WalkTurnAround")


def known() -> Motion:
    """A made walk of 301 frames at 120 a second; a file written of it has the motion to compare with."""
    return gaits.make(seconds=301 / 120, speed=1.3, turn_rate=0.4, fps=120.0, seed=0, name="known")


def real() -> Motion:
    """A recorded walk that turns around, of an actor of ACCAD."""
    source, name = REAL
    (clip,) = [motion for motion in datasets.load(source) if motion.name == name]
    return clip


def lay(motion: Motion, folder: Path) -> None:
    """Write what a program may ask for: clip.bvh in centimetres, clip.glb in metres, and clip.json."""
    folder.mkdir(parents=True, exist_ok=True)
    io.write_bvh(motion, folder / "clip.bvh")
    io.write_gltf(motion, folder / "clip.glb")
    (folder / "clip.json").write_text(json.dumps(as_numbers(motion)), encoding="utf-8")


def as_numbers(motion: Motion) -> dict:
    """A motion for programs that take numbers: metres, quaternions x y z w against the parent."""
    body = motion.skeleton
    return {
        "fps": motion.fps,
        "names": body.names,
        "parents": body.parents,
        "offsets": body.offsets.tolist(),
        "root": motion.root_positions.tolist(),
        "rotations": roma.rotmat_to_unitquat(motion.rotations).tolist(),
        "points": body.point_names,
        "positions": motion.positions().tolist(),
    }
