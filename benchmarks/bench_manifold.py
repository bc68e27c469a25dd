"""Nearest windows: 5 000 × 5 000 windows of 40 frames × 73 features, against one window a time.

    python benchmarks/bench_manifold.py [--rounds 3] [--threads 1] [--save]

Windows begin every 10 frames, as in STRNN. The rival is what one would write first: for each
window the difference from all real windows in numpy, its norm, its mean, its least.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import torch
import tyro
from interleaved import medians, peak, save, table, verdict
from numpy.lib.stride_tricks import sliding_window_view

from motionlab.metrics import nearest_window_distance

WINDOWS, LENGTH, STRIDE, DIM = 5000, 40, 10, 73
SAMPLE = 20  # windows that the rival is timed on


@dataclass
class Options:
    rounds: int = 3
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    random = torch.Generator().manual_seed(0)
    frames = LENGTH + STRIDE * (WINDOWS - 1)
    samples, real = (torch.randn(1, frames, DIM, generator=random) for _ in range(2))
    before = peak()
    start = time.perf_counter()
    found = nearest_window_distance(samples, real, fps=30)
    seconds, memory = time.perf_counter() - start, peak() - before
    few = samples[:, : LENGTH + STRIDE * (SAMPLE - 1)]
    many = samples[:, : LENGTH + STRIDE * (25 * SAMPLE - 1)]
    rival = one_at_a_time(few[0].numpy(), real[0].numpy())
    difference = float(np.abs(rival - found.distance[:SAMPLE].numpy()).max())
    times = medians(
        {
            "one at a time": lambda: one_at_a_time(few[0].numpy(), real[0].numpy()),
            "motionlab": lambda: nearest_window_distance(many, real, fps=30),
        },
        options.rounds,
    )
    ratio = times["motionlab"] / 25 / times["one at a time"]
    table(
        f"{WINDOWS} x {WINDOWS} windows of {LENGTH} x {DIM}, {options.threads} thread(s); largest "
        f"difference of {SAMPLE} distances {difference:.1e}",
        [
            ("one window a time, in numpy", f"{times['one at a time'] / SAMPLE:.3f} s", "a window"),
            ("nearest_window_distance", f"{times['motionlab'] / SAMPLE / 25:.4f} s", "a window"),
            ("  ratio", "", verdict(ratio, 0.1)),
            ("nearest_window_distance, all", f"{seconds:.1f} s", verdict(seconds / 60, 1)),
            (
                "  memory beside the features",
                f"{memory / 2**20:.0f} MB",
                verdict(memory / 2**30, 1),
            ),
        ],
    )
    if options.save:
        numbers = {"seconds": seconds, "memory_bytes": memory, "ratio": ratio, **_names(options)}
        save("bench_manifold", numbers)


def one_at_a_time(samples: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Distance of each window (frames, dim) to the nearest real one."""
    cut = lambda x: sliding_window_view(x, LENGTH, axis=0)[::STRIDE].swapaxes(1, 2)
    return np.array(
        [np.linalg.norm(cut(real) - one, axis=-1).mean(-1).min() for one in cut(samples)]
    )


def _names(options: Options) -> dict:
    return {"threads": options.threads, "windows": WINDOWS, "length": LENGTH, "dim": DIM}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
