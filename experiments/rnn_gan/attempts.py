"""What was tried to bring a critic nearer to guessing: games as they ship, but for one setting each.

    python -m experiments.rnn_gan.attempts [--list]

All refine `lstm-gmm-contacts`, with seed 0, and are judged on validation clips as the refiners that
ship were; besides, by the jerk of what goes on from runs among these. Each is kept in runs/attempts/: stopped and started again, it goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from statistics import fmean

import torch
from torch import Tensor

import motionlab
from motionlab import metrics
from motionlab.training import GAMES, Prepared
from motionlab.training.adversarial import train_game
from motionlab.training.checkpoints import load_weights
from motionlab.training.judging import JUDGED, Judge, choose

from ..common import record
from .refined_samples import clips_of, samples

FOLDER = Path("runs/attempts")
RUNS = "jerk of runs (m/s³)"
GENERATOR, MODEL = "lstm-gmm-contacts", "refiner-contacts"
ATTEMPTS = {
    "as it ships": {},
    "changes cost a tenth": {"change_weight": 1.0},
    "sees 0.8 s at a time": {"piece": 25},
    "three times as long": {"steps": 9000},
    "twice as wide": {"width": 256, "discriminator_width": 128},
}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--output", default="results/refiner_attempts.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    if chosen.list:
        for name in ATTEMPTS:
            print(f"{'done' if (folder_of(name) / JUDGED).exists() else '':5} {name}")
        return
    generator, data = motionlab.load(GENERATOR), Prepared.find(chosen.data)
    judge = Judge(generator, data)
    clips = clips_of(data, "run", "val")
    with torch.no_grad():
        runs = samples(generator, clips, len(clips), seed=0)
    rows = {name: play(generator, data, judge, runs, name) for name in ATTEMPTS}
    result = {
        "generator": GENERATOR,
        "real": judge.real | {RUNS: jerk(generator, clips)},
        "unrefined": judge.unrefined | {RUNS: jerk(generator, runs)},
    }
    record.write(record.provenance(begin, 0, data) | result | {"rows": rows}, chosen.output)


def folder_of(name: str) -> Path:
    return FOLDER / name.replace(" ", "-")


def jerk(generator, motions: Iterable[Tensor]) -> float:
    """Mean jerk (m/s³) of features (frames, dim)."""
    points = map(generator.encoding.positions, motions)
    return fmean(metrics.jerk(its, generator.fps).mean().item() for its in points)


def play(generator, data: Prepared, judge: Judge, runs: Tensor, name: str) -> dict:
    """A game from beginning to end: what was changed, the refiner chosen of it, and all of them."""
    folder = folder_of(name)
    preset = replace(GAMES[MODEL]["ship"], seed=0, **ATTEMPTS[name])
    curve = train_game(generator, data, preset, folder, name=MODEL, device="cpu")
    if not (folder / JUDGED).exists():
        choose(folder, judge)
    refiner, about = load_weights(folder / preset.weights)
    with torch.no_grad():
        refined = refiner.eval()(runs)
    chosen = about["judged"]
    print(name, chosen, flush=True)
    return {
        "changes": ATTEMPTS[name],
        "minutes": curve[-1]["seconds"] / 60,
        "chosen": chosen | {RUNS: jerk(generator, refined)},
        "by step": json.loads((folder / JUDGED).read_text(encoding="utf-8"))["refined"],
    }


if __name__ == "__main__":
    record.run(main)
