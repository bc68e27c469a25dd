"""`motionlab convert`: a hundred BVH clips of 10 s at 30 fps to GLB, and Blender with some of the same.

    python benchmarks/bench_convert.py [--clips 100] [--blender PYTHON --blender-clips 10] [--save]

Clips are procedural gaits. Seconds are those of processors, without those for the start of a program.
Blender is `bpy` in a Python of its own, which --blender names: it reads each file with the rate and
length that stand there, and writes GLB as it does unless told otherwise. What it writes has no body to
see; ours has one.
"""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from interleaved import save, table, verdict

from motionlab import write_bvh
from motionlab.__main__ import main as motionlab
from motionlab.datasets import gaits

SECONDS, FPS = 10, 30
LIMITS = {"seconds a clip": 1 / 20, "ours / Blender's": 0.2}
IN_BLENDER = """
import json, sys, time
from pathlib import Path
import bpy
folder, files = Path(sys.argv[1]), sys.argv[2:]
seconds = []
for file in files:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    start = time.process_time()
    bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True, update_scene_duration=True)
    bpy.ops.export_scene.gltf(filepath=str(folder / (Path(file).stem + ".glb")))
    seconds.append(time.process_time() - start)
print("\\n" + json.dumps({"version": bpy.app.version_string, "seconds": sorted(seconds)}))
"""


@dataclass
class Options:
    clips: int = 100
    blender: str = ""
    """A Python in which bpy is installed; without, its time is left out."""
    blender_clips: int = 10
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    with tempfile.TemporaryDirectory() as folder:
        clips = Path(folder, "clips")
        clips.mkdir()
        for i in range(options.clips):
            speed = 0.8 + 2.4 * i / options.clips
            motion = gaits.make(seconds=SECONDS, speed=speed, turn_rate=0.2, seed=i, fps=FPS)
            write_bvh(motion, clips / f"{i:03}.bvh", units="m")
        numbers = {"clips": options.clips, "limits": LIMITS, **ours(clips, Path(folder))}
        if options.blender:
            files = sorted(clips.glob("*.bvh"))[: options.blender_clips]
            numbers["Blender"] = blenders(options.blender, files, Path(folder))
            numbers["ours / Blender's"] = (
                numbers["seconds a clip"] / numbers["Blender"]["seconds a clip"]
            )
    rows = [
        ("clips a second of one core", f"{numbers['clips a second']:.1f}", "at least 20"),
        ("seconds a clip", f"{numbers['seconds a clip']:.3f}", ""),
    ]
    if options.blender:
        ratio = verdict(numbers["ours / Blender's"], LIMITS["ours / Blender's"])
        rows.append((f"of Blender {numbers['Blender']['version']}'s", "", ratio))
    title = f"{options.clips} clips of {SECONDS} s at {FPS} fps, BVH to GLB"
    table(f"{title}, {options.threads} thread(s)", rows)
    if options.save:
        save("bench_convert", numbers)


def ours(clips: Path, folder: Path) -> dict:
    """Processor seconds of one command, after one for a single file, which loads what it needs."""
    said = io.StringIO()
    first = next(clips.glob("*.bvh"))
    with contextlib.redirect_stdout(said):
        motionlab(["convert", str(first), "--out", str(folder / "first.glb")])
        start, begun = time.process_time(), time.perf_counter()
        code = motionlab(["convert", str(clips), "--to", "glb", "--out", str(folder / "ours")])
        seconds, wall = time.process_time() - start, time.perf_counter() - begun
    count = len(list((folder / "ours").glob("*.glb")))
    if code or count < len(list(clips.iterdir())):
        raise SystemExit(f"only {count} clips were written: {said.getvalue()[-500:]}")
    return {
        "clips a second": count / seconds,
        "seconds a clip": seconds / count,
        "seconds on the clock": wall,
    }


def blenders(python: str, files: list[Path], folder: Path) -> dict:
    script = folder / "in_blender.py"
    script.write_text(IN_BLENDER, encoding="utf-8")
    run = subprocess.run(
        [python, str(script), str(folder), *map(str, files)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    told = json.loads(run.stdout.strip().splitlines()[-1])
    mean = sum(told["seconds"]) / len(files)
    return {"version": told["version"], "clips": len(files), "seconds a clip": mean}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
