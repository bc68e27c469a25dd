"""Noise taken away: 32 clips side by side against one alone, and the memory of ten minutes of motion.

    python benchmarks/bench_denoise.py [--rounds 3] [--threads 1] [--minutes 10] [--save]

Clips are made gaits of three seconds under white noise of 2 cm and 0.08 rad, cleaned as `solvers.denoise`
does by itself. Seconds are the processor's. Memory is the most that the process had beyond what it had
before, as ten minutes are cleaned.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, peak, save, table, verdict

import motionlab
from motionlab import Motion, corrupt
from motionlab.datasets import gaits
from motionlab.solvers import denoise

MANY, SECONDS = 32, 3.0
FASTER, MEMORY = 6.0, 1.5 * 2**30  # times one clip's throughput, bytes


@dataclass
class Options:
    rounds: int = 3
    threads: int = 1
    minutes: float = 10.0
    save: bool = False


def noisy(seconds: float, seed: int) -> Motion:
    walk = gaits.make(seconds=seconds, speed=1.0 + 0.02 * seed, seed=seed)
    return corrupt.tremble(walk, generator=torch.Generator().manual_seed(seed))


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    model = motionlab.load("lstm-gmm-contacts")
    clips = [noisy(SECONDS, seed) for seed in range(MANY)]
    times = medians(
        {"one": lambda: denoise(clips[0], model), "many": lambda: denoise(clips, model)},
        options.rounds,
        time.process_time,
    )
    faster = MANY * times["one"] / times["many"]
    before, long = peak(), noisy(60 * options.minutes, 0)
    start = time.process_time()
    denoise(long, model)
    seconds, memory = time.process_time() - start, peak() - before
    table(
        f"denoise, {options.threads} thread(s), processor seconds a second of motion",
        [
            ("one clip of 3 s", f"{times['one'] / SECONDS:.3f}", ""),
            (f"{MANY} clips side by side", f"{times['many'] / SECONDS / MANY:.3f}", ""),
            ("  throughput over one clip's", f"{faster:.1f} x", verdict(FASTER / faster, 1)),
            (f"{options.minutes:g} minutes", f"{seconds / options.minutes / 60:.3f}", ""),
            ("  memory", f"{memory / 2**20:.0f} MB", verdict(memory / MEMORY, 1)),
        ],
    )
    if options.save:
        numbers = {
            "processor seconds a second": {
                "one clip": times["one"] / SECONDS, "32 clips": times["many"] / SECONDS / MANY,
                "long": seconds / options.minutes / 60,
            },
            "32 clips over one, throughput": faster, "minutes": options.minutes,
            "memory (bytes)": memory, "threads": options.threads, "rounds": options.rounds,
            "limits": {"throughput": FASTER, "memory (bytes)": MEMORY},
        }  # fmt: skip
        save("bench_denoise", numbers)


if __name__ == "__main__":
    main(tyro.cli(Options))
