"""What was tried to steer one character faster, commit by commit: a window of live control.

    python benchmarks/bench_live_parts.py [--rounds 25] [--save] [--against FOLDER ...]

The best of 16 futures, and the paper's gradient from the best of four; refiner and lock behind both, one
thread, seconds of the processor. Each FOLDER holds an older build, such as a worktree of a commit; all take
turns, so that what else the machine does hits all of them. It takes a while on a busy machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from interleaved import OtherBuild, answer, commit, medians, save, table

import motionlab
from motionlab.solvers.live_control import LiveControl

WAYS = {"futures, K 16": ({}, 6), "gradient": ({"way": "gradient", "futures": 4}, 2)}  # windows
FRAMES = 5  # of a window
LIMITS = {
    "futures, K 16": 1000 * FRAMES / 300,
    "gradient": 1000 * FRAMES / 60,
}  # ms a window: 300 frames a second, 60


@dataclass
class Options:
    rounds: int = 25
    save: bool = False
    against: tuple[Path, ...] = ()
    answer: bool = False  # to the process that asks for jobs on the standard input


def main(options: Options) -> None:
    torch.set_num_threads(1)
    jobs = {name: steered(*told) for name, told in WAYS.items()}
    if options.answer:
        return answer(jobs, time.process_time)
    builds = {commit(tree): OtherBuild(tree, []) for tree in options.against}
    every = {f"{name}, {old}": build.job(name) for old, build in builds.items() for name in WAYS}
    every |= {f"{name}, now": job for name, job in jobs.items()}
    seconds = medians(every, options.rounds, time.process_time)
    for build in builds.values():
        build.close()
    took = {name: 1000 * its / WAYS[name.rsplit(", ", 1)[0]][1] for name, its in seconds.items()}
    found = {name: {when: took[f"{name}, {when}"] for when in [*builds, "now"]} for name in WAYS}
    table(
        "one character steered: a window of five frames",
        [(f"{name}, {when}", f"{ms:.1f} ms", f"at most {LIMITS[name]:.1f}; {1000 * FRAMES / ms:.0f} frames a second")
         for name, its in found.items() for when, ms in its.items()],
    )  # fmt: skip
    if options.save:
        save("bench_live_parts", {"limits": LIMITS, "ms a window": found})


def steered(settings: dict, windows: int) -> Callable[[], None]:
    """Some windows of a character who walks and turns; he goes on from round to round."""
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    live = LiveControl(model, "walk", refiner=refiner, lock=True, **settings)
    live.steer(1.2, 0.5)

    def job() -> None:
        for _ in range(windows):
            live.go_on()

    return job


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
