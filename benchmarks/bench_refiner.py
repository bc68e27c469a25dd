"""Refining: against the time that the motion lasts, and against the generator's own.

    python benchmarks/bench_refiner.py [--characters 256] [--rounds 5] [--threads 1] [--save]
        [--against FOLDER]

One character, as a stream of single frames and in one piece; many characters in one piece, beside
the generator that makes them (`lstm-gmm`, as fast as it goes at this number). The stream is also
refined as torch does it, and by an older build of motionlab, if FOLDER holds one. Seconds are those
of processors. With it: how far the stream's points lie from torch's, at most.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from interleaved import OtherBuild, answer, medians, save, table, verdict

import motionlab

SECONDS, FRAMES = 10, 60
LIMITS = {"a stream / its length": 1 / 60, "refining / generating many": 2.0}


@dataclass
class Options:
    characters: int = 256
    rounds: int = 5
    threads: int = 1
    save: bool = False
    against: Path | None = None
    answer: bool = False  # to the process that asks for jobs on the standard input


@torch.no_grad()
def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    jobs = made(options.characters)
    if options.answer:
        return answer(jobs, time.process_time)
    if options.against:
        older = OtherBuild(options.against, ["--threads", str(options.threads)])
        jobs["one, by the older build"] = older.job("one, frame by frame")
    points = motionlab.load("refiner").encoding.positions
    fast, plain = (
        points(torch.cat(jobs[f"one, frame by frame{how}"](), 1)) for how in ("", " in torch")
    )
    seconds = medians(jobs, options.rounds, time.process_time)
    found = {
        "a stream / its length": seconds["one, frame by frame"] / SECONDS,
        "in torch / its length": seconds["one, frame by frame in torch"] / SECONDS,
        "in one piece / its length": seconds["one, in one piece"] / SECONDS,
        "refining / generating many": seconds["many refined"] / seconds["many generated"],
        "apart (mm)": 1000 * float((fast - plain).norm(dim=-1).max()),
    }
    if options.against:
        older.close()
        of_older = seconds["one, by the older build"]
        found["by the older build / its length"] = of_older / SECONDS
        found["a stream / by the older build"] = seconds["one, frame by frame"] / of_older
    table(
        f"{SECONDS} s of one, {FRAMES} frames of {options.characters}, {options.threads} threads",
        [(name, f"{1000 * value:.1f} ms", "") for name, value in seconds.items()]
        + [
            (name, f"{value:.4g}", verdict(value, LIMITS[name]) if name in LIMITS else "")
            for name, value in found.items()
        ]
        + [("a stream, times real time", f"{1 / found['a stream / its length']:.0f}", "")],
    )
    if options.save:
        save("bench_refiner", {"limits": LIMITS, "seconds": seconds, **found})


def made(characters: int) -> dict:
    model, refiner = motionlab.load("lstm-gmm"), motionlab.load("refiner")
    chance = torch.Generator().manual_seed(0)
    one = model.generate(
        round(SECONDS * model.fps), model.starts[0], generator=chance, **model.sampling
    )
    starts = model.starts[[i % len(model.starts.frame) for i in range(characters)]]
    generate = lambda: model.generate(
        FRAMES, starts, generator=chance, precision="int8", **model.sampling
    )
    many = generate()

    def stream() -> list[torch.Tensor]:
        state, refined = None, []
        for frame in one.split(1, dim=1):
            now, state = refiner.refine(frame, state)
            refined.append(now)
        return refined

    def in_torch() -> list[torch.Tensor]:
        with torch.enable_grad():  # nothing asks for a gradient, but numpy knows of none
            return stream()

    return {
        "one, frame by frame": stream,
        "one, frame by frame in torch": in_torch,
        "one, in one piece": lambda: refiner.refine(one),
        "many generated": generate,
        "many refined": lambda: refiner.refine(many),
    }


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
