"""Foot locking: seconds for 10 s of motion, a batch of 32 against one after the other, and a stream.

    python benchmarks/bench_foot_lock.py [--clips 32] [--rounds 5] [--threads 1] [--save]

The motion is the shipped network's with contacts, so feet slide. Seconds are those of processors.
With it: how far a stream lies from the offline lock, and how much feet slide, on what the shipped
refiner makes of that motion.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import torch
import tyro
from interleaved import medians, save, table, verdict

import motionlab
from motionlab.feet.lock import lock, lock_feet
from motionlab.feet.lock_stream import LockStream
from motionlab.metrics import foot_skate

SECONDS = 10
LIMITS = {"one clip (s)": 2.0, "batch / loop": 0.15, "a stream / its length": 0.01}


@dataclass
class Options:
    clips: int = 32
    rounds: int = 5
    threads: int = 1
    save: bool = False


def streamed(motion: motionlab.Motion) -> motionlab.Motion:
    stream = LockStream(motion.skeleton, motion.fps)
    parts = (
        stream.push(motion.root_positions, motion.rotations, motion.contacts),
        stream.finish(),
    )
    place, turns = (torch.cat(both) for both in zip(*parts, strict=True))
    return replace(motion, root_positions=place, rotations=turns)


def differences(motions: list[motionlab.Motion]) -> dict[str, float]:
    """Means over motions: cm/s that toes slide in contact, mm from streamed to offline points."""
    rows = []
    for motion in motions:
        made = [motion, lock_feet(motion), streamed(motion)]
        points = [m.positions() for m in made]
        toes = motion.contacts[:, [1, 3]]
        skates = [float(foot_skate(p, toes, motion.skeleton, motion.fps)) for p in points]
        rows.append([*skates, 1000 * float((points[2] - points[1]).norm(dim=-1).mean())])
    names = ("slide, given (cm/s)", "slide, offline (cm/s)", "slide, stream (cm/s)", "apart (mm)")
    return dict(zip(names, torch.tensor(rows).mean(0).tolist(), strict=True))


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
        time.process_time,
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
    refined = motionlab.load("refiner-contacts")(features)
    apart = differences([encoding.to_motion(one) for one in refined])
    table("streamed and offline", [(name, f"{value:.1f}", "") for name, value in apart.items()])
    if options.save:
        save("bench_foot_lock", {"limits": LIMITS, "seconds": seconds, **found, **apart})


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
