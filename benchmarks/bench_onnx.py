"""A network that was taken along: a frame in ONNX Runtime, beside the time it lasts and `generate`.

    python benchmarks/bench_onnx.py [--rounds 9] [--save]

The loop of `examples/onnx_walk.py` with `lstm-gmm-permissive`, on one thread: the network alone with its chance;
the whole loop, refined and turned to rotations; 16 futures as one batch. Seconds are those of processors. If
`onnxruntime-web` is installed there (`npm install --prefix examples --no-save onnxruntime-web`), the network of
`onnx_walk.mjs` under Node, too. With it: sizes of files.
"""

from __future__ import annotations

import importlib.util
import subprocess
import tempfile
import time
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import torch
import tyro
from interleaved import medians, save, table, verdict
from onnx_step import on_one_thread

import motionlab
from motionlab.weights.export import export_onnx

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = "lstm-gmm-permissive", "refiner-permissive"
FRAMES, FUTURES = 300, 16
LIMITS = {"the whole loop / its length": 0.1, "16 futures / one": 8.0}


@dataclass
class Options:
    rounds: int = 9
    save: bool = False


@torch.no_grad()
def main(options: Options) -> None:
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        files = [export_onnx(motionlab.load(name), Path(folder, f"{name}.onnx")) for name in NAMES]
        sizes = {f"{file.name} (MB)": file.stat().st_size / 1e6 for file in files}
        jobs = made(files)
        seconds = medians(jobs, options.rounds, time.process_time)
        whole = export_onnx(motionlab.load(NAMES[0]), Path(folder, "whole.onnx"), half=False)
        sizes[f"{NAMES[0]}, float32 (MB)"] = whole.stat().st_size / 1e6
        node = {"": in_node(files[0]), ", float32": in_node(whole)}
    lasts = FRAMES / 30
    found = {
        "a frame (ms)": 1000 * seconds["network"] / FRAMES,
        "network / generate": seconds["network"] / seconds["generate"],
        "the whole loop / its length": seconds["whole loop"] / lasts,
        "16 futures / one": seconds["16 futures"] / seconds["network"],
        **{f"a frame under Node{how} (ms)": ms for how, ms in node.items() if ms is not None},
        **sizes,
    }
    table(
        f"{FRAMES} frames of one character",
        [(name, f"{1000 * value:.1f} ms", "") for name, value in seconds.items()]
        + [(name, f"{value:.3g}", verdict(value, LIMITS[name]) if name in LIMITS else "")
           for name, value in found.items()],
    )  # fmt: skip
    if options.save:
        save("bench_onnx", {"limits": LIMITS, "seconds": seconds, **found})


def made(files: list[Path]) -> dict:
    """Jobs of `FRAMES` frames."""
    spec = importlib.util.spec_from_file_location("onnx_walk", EXAMPLES / "onnx_walk.py")
    loop = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loop)
    (_, about), (_, its) = map(loop.network, files)
    walker, refiner = (on_one_thread(file.read_bytes()) for file in files)
    start, model = about["starts"][0], motionlab.load(NAMES[0])

    def rows() -> object:
        return islice(loop.frames(walker, start, loop.chance(about, 0)), FRAMES)

    def futures() -> None:
        state = {part: np.float32([start[part]] * FUTURES) for part in ("frame", "hidden", "cell")}
        random = np.random.default_rng(0)
        for _ in range(FRAMES):
            noise = 0.11 * random.standard_normal((FUTURES, len(start["frame"])), np.float32)
            gumbel = np.float32(random.gumbel(size=(FUTURES, 5)))
            names = ["features", *(f"{part}_after" for part in state)]
            _, *after = walker.run(names, state | {"noise": noise, "gumbel": gumbel})
            state = dict(zip(state, after, strict=True))

    return {
        "network": lambda: list(rows()),
        "whole loop": lambda: list(loop.poses(about, loop.refined(refiner, its, rows()))),
        "16 futures": futures,
        "generate": lambda: model.generate(FRAMES, model.starts[0], **model.sampling),
    }


def in_node(file: Path) -> float | None:
    """Milliseconds of a frame under Node; None if there is no runtime for it."""
    if not (EXAMPLES / "node_modules" / "onnxruntime-web").is_dir():
        return None
    command = ["node", Path(__file__).with_name("onnx_node.mjs"), file, str(FRAMES)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
