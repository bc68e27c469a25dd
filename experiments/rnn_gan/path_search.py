"""What a search for a walk along a path costs, and what it brings: ours beside simpler ways.

    python -m experiments.rnn_gan.path_search [--seeds 0 1 2] [--only ROW ...]

Every row solves the same curves (W5's smooth shapes and its square, half as long, at 1.2 m/s) from the
same held-out motion, window after window, without refiner and lock. Energies of windows of other
lengths can't be compared, so the network's likelihood of the finished motion stands beside: that of
each frame given those before it, nothing disturbed. Seconds are the processor's, of one thread and all
curves of a seed in one batch. Writes results/path_search.json; each row is kept in runs/path_search/ as
it is done.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import torch
from torch import nn

import motionlab
from motionlab import Motion, metrics
from motionlab.paths import Path as Way
from motionlab.solvers import design
from motionlab.solvers.path_control import BASELINES, STEPS
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from .curves import shapes
from .following import GAITS, NAME, made_with, mean, median, recorded, row_of, starts

LENGTH = 9.0  # m, of each curve
OURS = "ours"
ROWS: dict[str, dict] = {
    OURS: {},
    "ours, 10 steps": {"steps": 10},
    "ours, 60 steps": {"steps": 60},
    "ours, from guided guesses": {"guide": True},
    "ours, from one sample": {"candidates": 1},
    "ours, slow feet held to 2 mm": {"weights": {"resting": 9.0}},
} | BASELINES


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=list(ROWS), default=list(ROWS))
    parser.add_argument("--runs", type=Path, default=Path("runs/path_search"))
    parser.add_argument("--output", default="results/path_search.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    model = motionlab.load(NAME)
    data = Prepared.find("locomotion").matching(model.encoding)
    rows = {}
    for name in chosen.only:
        found = [kept(chosen.runs, name, seed, model, data) for seed in chosen.seeds]
        rows[name] = {"settings": ROWS[name], **summary(found)}
        print(name, rows[name]["median"], flush=True)
    result = {
        "weights": record.about_weights(model, find(NAME)),
        "steps": STEPS,
        "rows": rows,
        "recorded": recorded("walk", data),
    }
    record.write(
        record.provenance(begin, chosen.seeds[0], data, seeds=chosen.seeds) | result, chosen.output
    )


def kept(runs: Path, name: str, seed: int, model: nn.Module, data: Prepared) -> dict[str, dict]:
    """Rows of one way to search by the names of their curves: measured before, or now."""
    path = runs / made_with(model) / f"{name} {seed}.json"
    if path.is_file():
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["settings"] == ROWS[name]:
            return found["curves"]
    path.parent.mkdir(parents=True, exist_ok=True)
    curves = record.rounded(measured(name, seed, model, data))
    path.write_text(json.dumps({"settings": ROWS[name], "curves": curves}), encoding="utf-8")
    return curves


def measured(name: str, seed: int, model: nn.Module, data: Prepared) -> dict[str, dict]:
    begun, *_ = starts(data, "walk", "test", 3)
    with torch.no_grad():
        model.starts = model.observe(begun[seed % len(begun)][None], doubt=False)
    speed = GAITS["walk"].speed
    model.start_names = (f"walk {speed} m/s",)
    ways = {name: Way.through(curve) for name, curve in shapes(GAITS["walk"].size, LENGTH).items()}
    made = design.design_all(
        list(ways.values()), speed, 0, model, seed=seed, progress=True, **ROWS[name]
    )
    return {
        curve: row_of(motion, way) | told_of(motion, its, model)
        for (curve, way), (motion, its) in zip(ways.items(), made, strict=True)
    }


@torch.no_grad()
def told_of(motion: Motion, its: dict, model: nn.Module) -> dict[str, float]:
    """What the search says of itself, and the network of what came out."""
    seconds = len(motion) / motion.fps
    likely = model.log_prob(model.encoding.encode(motion)[None])[0]
    return {
        "energy (nats a frame)": sum(its["terms (nats a frame)"].values()),
        "log-likelihood (nats a frame)": float(likely[round(motion.fps) :].mean()),
        "seconds a second of motion": its["seconds"] / seconds,
        "evaluations a second of motion": its["evaluations"] / seconds,
        "finished": its["finished"],
        "without broken frames": its["broken frames"] == 0,
    }


def summary(found: Sequence[dict[str, dict]]) -> dict:
    """Medians over curves, each the mean of its seeds, with intervals; shares over all motions."""
    curves = {name: [rows[name] for rows in found] for name in found[0]}
    shares = ("finished", "without broken frames")
    keys = [key for key in next(iter(curves.values()))[0] if key not in shares]
    flat = [row for rows in curves.values() for row in rows]
    return {
        "median": {
            key: metrics.bootstrap([mean(rows, key) for rows in curves.values()], median)
            for key in keys
        }
    } | {key: sum(row[key] for row in flat) / len(flat) for key in shares}


if __name__ == "__main__":
    record.run(main)
