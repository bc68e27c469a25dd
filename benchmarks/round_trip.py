"""Read every clip of every source, write it, read it again: how far do positions move?

    python benchmarks/round_trip.py [SOURCE ...]

Takes about a minute; fails above 0.1 mm. Needs the files: `python -m motionlab data fetch NAME`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import torch
from tqdm import tqdm

import motionlab
from motionlab.datasets import files, loader, registry

ALLOWED = 1e-4  # metres


def error(first: motionlab.Motion, folder: Path) -> float:
    """Largest distance in metres of any point in any frame, first reading to second."""
    path = folder / "clip.bvh"
    motionlab.write_bvh(first, path)
    second = motionlab.read_bvh(path)
    assert second.skeleton.point_names == first.skeleton.point_names, first.name
    assert abs(second.fps - first.fps) < 1e-3, (first.name, first.fps, second.fps)
    return float((first.positions() - second.positions()).norm(dim=-1).max())


def main() -> None:
    torch.set_num_threads(1)
    worst = {}
    for source in sys.argv[1:] or registry.sources():
        clips = registry.members(source)
        with tempfile.TemporaryDirectory() as folder:
            reading = tqdm(files.read(clips), total=len(clips), desc=source, leave=False)
            errors = {
                clip.name: error(loader.parse(clip, *data), Path(folder)) for clip, data in reading
            }
        name = max(errors, key=errors.get)
        worst[source] = errors[name]
        print(f"{source}: {len(errors)} clips, largest error {errors[name] * 1e3:.5f} mm ({name})")
    assert max(worst.values()) <= ALLOWED, "positions moved by more than 0.1 mm"


if __name__ == "__main__":
    main()
