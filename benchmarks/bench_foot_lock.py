"""Foot locking: seconds for 10 s of motion, a batch of 32 against one after the other, and a stream.

    python benchmarks/bench_foot_lock.py [--clips 32] [--rounds 5] [--threads 1] [--save]

The motion is the shipped network's with contacts, so feet slide.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table, verdict

import motionlab
from motionlab.feet.lock import lock
from motionlab.feet.lock_stream import LockStream

SECONDS = 10
LIMITS = {"one clip (s)": 2.0, "batch / loop": 0.15, "a stream / its length": 0.01}


@dataclass
class Options:
    clips: int = 32
    rounds: int = 5
    threads: int = 1
    save: bool = False


@torch.inference_mode()
def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    model = motionlab.load("lstm-gmm-contacts")
    encoding, fps = model.encoding, model.fps
    rows = torch.arange(options.clips) % len(model.starts.frame)
    chance = torch.Generator().manual_seed(0)
    features = model.generate(
        round(SECONDS * fps), model.starts[rows], generator=chance, **model.sampling
    )
    place, turns = encoding.rotations(features)
    down = encoding.contacts(features) > 0.5
    locked = lambda i: lock(encoding.skeleton, place[i], turns[i], down[i], fps)

    def stream() -> None:
        locking = LockStream(encoding.skeleton, fps)
        for frame in zip(place[0], turns[0], down[0], strict=True):
            locking.push(*frame)

    seconds = medians(
        {
            "one": lambda: locked(0),
            "loop": lambda: [locked(i) for i in range(options.clips)],
            "batch": lambda: lock(encoding.skeleton, place, turns, down, fps),
            "one, frame by frame": stream,
        },
        options.rounds,
    )
    found = {
        "one clip (s)": seconds["one"],
        "batch / loop": seconds["batch"] / seconds["loop"],
        "a stream / its length": seconds["one, frame by frame"] / SECONDS,
    }
    table(
        f"{options.clips} clips of {SECONDS} s, {options.threads} threads",
        [(name, f"{1000 * value:.1f} ms", "") for name, value in seconds.items()]
        + [(name, f"{value:.4f}", verdict(value, LIMITS[name])) for name, value in found.items()],
    )
    if options.save:
        save("bench_foot_lock", {"seconds": seconds, **found})


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
