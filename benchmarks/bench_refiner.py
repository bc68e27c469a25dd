"""Refining: against the time that the motion lasts, and against the generator's own.

    python benchmarks/bench_refiner.py [--characters 256] [--rounds 5] [--threads 1] [--save]

One character, as a stream of single frames and in one piece; many characters in one piece, beside
the generator that makes them (`lstm-gmm`, as fast as it goes at this number).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table, verdict

import motionlab

SECONDS, FRAMES = 10, 60
LIMITS = {"refining / generating many": 2.0}


@dataclass
class Options:
    characters: int = 256
    rounds: int = 5
    threads: int = 1
    save: bool = False


@torch.inference_mode()
def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    model, refiner = motionlab.load("lstm-gmm"), motionlab.load("refiner")
    chance = torch.Generator().manual_seed(0)
    one = model.generate(
        round(SECONDS * model.fps), model.starts[0], generator=chance, **model.sampling
    )
    starts = model.starts[[i % len(model.starts.frame) for i in range(options.characters)]]
    generate = lambda: model.generate(
        FRAMES, starts, generator=chance, precision="int8", **model.sampling
    )
    many = generate()

    def stream() -> None:
        state = None
        for frame in one.split(1, dim=1):
            _, state = refiner.refine(frame, state)

    seconds = medians(
        {
            "one, frame by frame": stream,
            "one, in one piece": lambda: refiner.refine(one),
            "many generated": generate,
            "many refined": lambda: refiner.refine(many),
        },
        options.rounds,
    )
    found = {
        "a stream / its length": seconds["one, frame by frame"] / SECONDS,
        "in one piece / its length": seconds["one, in one piece"] / SECONDS,
        "refining / generating many": seconds["many refined"] / seconds["many generated"],
    }
    table(
        f"{SECONDS} s of one, {FRAMES} frames of {options.characters}, {options.threads} threads",
        [(name, f"{1000 * value:.1f} ms", "") for name, value in seconds.items()]
        + [
            (name, f"{value:.4f}", verdict(value, LIMITS[name]) if name in LIMITS else "")
            for name, value in found.items()
        ],
    )
    if options.save:
        save("bench_refiner", {"seconds": seconds, **found})


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
