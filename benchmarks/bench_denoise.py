"""Noise taken away: 32 clips side by side against one alone, and the memory of ten minutes of motion.

    python benchmarks/bench_denoise.py [--rounds 3] [--threads 1] [--minutes 10] [--save]

Clips are made gaits of three seconds under white noise of 2 cm and 0.08 rad, cleaned as `solvers.denoise`
does by itself. Seconds are the processor's. Memory is the most that the process had, torch and all, after
ten minutes were cleaned.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, peak, save, table, verdict

import motionlab
from motionlab import Motion, corrupt, filters
from motionlab.datasets import gaits
from motionlab.solvers import denoise
from motionlab.solvers.denoise_windows import Settings

MANY, SECONDS = 32, 3.0
AT_ONCE = (8, 64, 128)  # windows; 32 is what ships
FASTER, MEMORY = 6.0, 1536  # times one clip's throughput, MB


@dataclass
class Options:
    rounds: int = 3
    threads: int = 1
    minutes: float = 10.0
    save: bool = False


def noisy(seconds: float, seed: int) -> Motion:
    walk = gaits.make(seconds=seconds, speed=1.0 + 0.02 * seed, seed=seed)
    return corrupt.tremble(walk, generator=torch.Generator().manual_seed(seed))


def attempts(clips: list[Motion], model) -> dict[str, dict[str, float]]:
    """What was tried: processor seconds a second of motion, of one clip and of all."""
    lines = [filters.kalman(clip, cutoff=5.0) for clip in clips]
    ways = {
        **{f"{n} windows at a time": {"settings": Settings(batch=n)} for n in AT_ONCE},
        "smooth lines given": {"noise": (0.02, 0.08)},
        "no term for contacts": {"contacts": False},
    }
    found = {}
    for name, how in ways.items():
        seconds = []
        for n in (1, MANY):
            given = {"start": lines[:n]} if name == "smooth lines given" else {}
            begin = time.process_time()
            denoise(clips[:n], model, **how, **given)
            seconds.append((time.process_time() - begin) / n / SECONDS)
        one, many = seconds
        found[name] = {"one clip": one, "32 clips": many, "throughput": one / many}
    return found


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
    tried = attempts(clips, model)
    long = noisy(60 * options.minutes, 0)
    start = time.process_time()
    denoise(long, model)
    seconds, memory = time.process_time() - start, peak() / 2**20
    table(
        f"denoise, {options.threads} thread(s), processor seconds a second of motion",
        [
            ("one clip of 3 s", f"{times['one'] / SECONDS:.3f}", ""),
            (f"{MANY} clips side by side", f"{times['many'] / SECONDS / MANY:.3f}", ""),
            ("  throughput over one clip's", f"{faster:.1f} x", verdict(FASTER / faster, 1)),
            *((f"    {name}", f"{its['throughput']:.1f} x", "") for name, its in tried.items()),
            (f"{options.minutes:g} minutes", f"{seconds / options.minutes / 60:.3f}", ""),
            ("  memory", f"{memory:.0f} MB", verdict(memory / MEMORY, 1)),
        ],
    )
    if options.save:
        numbers = {
            "processor seconds a second": {
                "one clip": times["one"] / SECONDS, "32 clips": times["many"] / SECONDS / MANY,
                "long": seconds / options.minutes / 60,
            },
            "32 clips over one, throughput": faster, "tried": tried, "minutes": options.minutes,
            "memory (MB)": round(memory), "threads": options.threads, "rounds": options.rounds,
            "limits": {"throughput": FASTER, "memory (MB)": MEMORY},
        }  # fmt: skip
        save("bench_denoise", numbers)


if __name__ == "__main__":
    main(tyro.cli(Options))
