"""How many futures are worth looking at: the same scripts by the best of 1, 4, 16 and 64, and their price.

    python -m experiments.rnn_gan.steering_futures [--seeds 10]

Some of W6's scripts (`steering.SCRIPTS`), from validation starts, refined and locked. *Settled*: the share of
runs that settle within people's own time and a second more, as W6 counts it. Told, not judged.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import torch

import motionlab
from motionlab.training import Prepared

from ..common import record
from . import steering

FUTURES = (1, 4, 16, 64)
LATE = 1.0  # seconds more than people, as in W6
JUDGED = Path("results/steering.json")  # where people's own times stand


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--windows", type=int, default=60, help="of which frames a second are told")
    parser.add_argument("--output", default="results/steering_futures.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    model, refiner = motionlab.load(steering.NAME), motionlab.load(steering.REFINER)
    data = Prepared.find("locomotion").matching(model.encoding)
    begun = steering.beginnings(model, data, "walk", "val")
    people = json.loads(JUDGED.read_text(encoding="utf-8"))["scripts"]
    scripts = [name for name in steering.SCRIPTS if name.startswith(("90°", "179°", "walk,"))]
    found = {}
    for futures in FUTURES:
        rows = {name: runs(name, futures, model, refiner, begun, chosen.seeds) for name in scripts}
        found[f"K = {futures}"] = {name: told(its, people[name]) for name, its in rows.items()}
        print(f"K = {futures}", flush=True)
    ways = {f"K = {futures}": {"futures": futures} for futures in FUTURES}
    speed = steering.speed(motionlab.load(steering.NAME), refiner, chosen.windows, ways)
    record.write(
        record.provenance(begin, 0, data)
        | {"runs": chosen.seeds * steering.BEGINS, "futures": found, "speed": speed},
        chosen.output,
    )


def runs(
    name: str, futures: int, model: torch.nn.Module, refiner: torch.nn.Module, begun, seeds: int
) -> list[dict]:
    """What came of a script's command, a row a run."""
    script = steering.SCRIPTS[name]
    made = steering.played(script, model, refiner, begun, "futures", seeds, {"futures": futures})
    return [steering.row_of(script, motion) for motion, _ in made.values()]


def told(rows: list[dict], people: dict) -> dict:
    """The share of runs that settle in time, and medians of time and skate."""
    latest = people["people's (s)"]["median"] + LATE
    middle = steering.summary(rows)
    return {
        "settled": sum(row["settled (s)"] <= latest for row in rows) / len(rows),
        "settled (s)": middle["settled (s)"],
        "foot skate (cm/s)": middle["foot skate (cm/s)"],
    }


if __name__ == "__main__":
    record.run(main)
