"""W2: what each part of the training recipe of the generator is worth.

    python -m experiments.rnn_gan.recipe [--list] [--only ROW ...] [--share 1/2] [--preset smoke]

Goes through a list of trainings, each kept in runs/recipe/: stopped and started again, it goes on.
Two processes that take a share each need half the time. The result is written when all that are
asked for are there; rows that are not complete stay open. What is measured and how it is judged
stands in claims.yaml.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from torch import nn

from motionlab.training import PRESETS, Prepared, Preset
from motionlab.training.checkpoints import load_weights, write_whole
from motionlab.training.evaluation import likelihood, measured, over_all, starting_windows

from ..common import record, rollouts, trainings
from ..common.trainings import Run
from . import recipe_data

NAME = "lstm-gmm"
SEEDS = (0, 1, 2)
TRIAL = 0.25  # of the updates, with which a learning rate is tried


@dataclass(frozen=True)
class Row(trainings.Row):
    """Trainings that differ in their seed only."""

    data: str = "locomotion"  # see recipe_data
    rates: Sequence[float] = ()  # learning rates to choose from
    first: str | None = None  # row whose weights it begins with
    share: float = 1.0  # of the preset's updates


ROWS = (
    Row("table", "the table preset: noise 0.05, Adam, skip 0.9, 30 frames a second"),
    Row("no noise", "no noise on the inputs", {"noise": 0.0}),
    Row("skip 0", "the paper's output layer: means without a share of the present frame",
        {"skip": 0.0}),
    Row("RMSProp", "the paper's optimiser", {"optimizer": "rmsprop"}, rates=(3e-4, 1e-3, 3e-3)),
    Row("SGD", "gradient descent with momentum 0.9", {"optimizer": "sgd"}, rates=(1e-2, 3e-2, 1e-1)),
    Row("everything else", "all clips but those of one actor, to begin from", data="others"),
    Row("pretrained", "then the one actor", data="actor", first="everything else", share=0.25),
    Row("scratch", "the one actor alone, as many updates in all", data="actor", share=1.25),
    Row("30 fps", "clips recorded at 120 frames a second, thinned to 30", data="30"),
    Row("120 fps", "the same clips as they were recorded", data="120"),
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="table", choices=list(PRESETS[NAME]))
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=[row.name for row in ROWS])
    parser.add_argument("--share", default="1/1", help="this process's part of the trainings")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--starts", type=int, default=100, help="rollouts a training")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each rollout")
    parser.add_argument("--output", help="results/lstm_gmm_recipe.json if left out")
    chosen = parser.parse_args(arguments)
    if chosen.preset != "table" and not (chosen.output or chosen.list):
        parser.error("another preset than table is not the result: name an --output")
    begin = time.perf_counter()
    base = PRESETS[NAME][chosen.preset]
    folder = Path("runs") / ("recipe" if chosen.preset == "table" else f"recipe-{chosen.preset}")
    rows = [row for row in ROWS if chosen.only is None or row.name in chosen.only]
    part, parts = map(int, chosen.share.split("/"))
    if chosen.list:
        trainings.show(run for row in rows for run in runs_of(row, base, folder))
        return
    for row in shared(rows, part, parts):
        for seed in SEEDS:
            for run in needed(row, seed, base, folder):
                if not run.done:
                    run.train(recipe_data.of(run.row.data), NAME)
    if parts > 1:
        print("this share is done; start without --share once all are, for the result")
        return
    result = {
        "preset": chosen.preset,
        "starts": chosen.starts,
        "seconds of a rollout": chosen.seconds,
        "rows": {
            row.name: told(row, base, folder, chosen.starts, chosen.seconds)
            for row in rows
            if row.name != "everything else"
        },
    }
    facts = record.provenance(begin, 0, recipe_data.of("locomotion"))
    record.write(facts | result, chosen.output or "results/lstm_gmm_recipe.json")


# -- the list of trainings ------------------------------------------------------------------------


def shared(rows: Sequence[Row], part: int, parts: int) -> list[Row]:
    """Rows of one process: no other one needs a training of theirs, be it for a first stage."""
    families = list(dict.fromkeys(row.first or row.name for row in rows))
    mine = families[part - 1 :: parts]
    return [row for row in rows if (row.first or row.name) in mine]


def preset_of(row: Row, base: Preset, **more) -> Preset:
    """The preset of a row's trainings."""
    updates = max(base.validate_every, round(base.updates * row.share))
    return replace(base, updates=updates, decay=min(base.decay, updates), **row.changes, **more)


def trials(row: Row, base: Preset, folder: Path) -> list[Run]:
    """Short trainings that choose a row's learning rate, with another seed than the others."""
    return [
        Run(row, 9, preset_of(replace(row, share=TRIAL), base, learning_rate=rate, seed=9),
            folder / _slug(row.name) / f"rate-{rate:g}")
        for rate in row.rates
    ]  # fmt: skip


def final(row: Row, seed: int, base: Preset, folder: Path) -> Run:
    """The training of one seed. The row's trials must be done."""
    tried = trials(row, base, folder)
    more = (
        {"learning_rate": min(tried, key=lambda t: t.validation).preset.learning_rate}
        if tried
        else {}
    )
    first = None
    if row.first:
        before = next(r for r in ROWS if r.name == row.first)
        first = final(before, seed, base, folder).folder / "best.safetensors"
    preset = preset_of(row, base, seed=seed, **more)
    return Run(row, seed, preset, folder / _slug(row.name) / f"seed-{seed}", first)


def needed(row: Row, seed: int, base: Preset, folder: Path):
    """Trainings in the order in which they can be run, the last one that of the row and seed."""
    yield from trials(row, base, folder)
    if row.first:
        yield from needed(next(r for r in ROWS if r.name == row.first), seed, base, folder)
    yield final(row, seed, base, folder)


def runs_of(row: Row, base: Preset, folder: Path) -> list[Run]:
    """All of a row's trainings that can be told yet."""
    tried = trials(row, base, folder)
    known = all(run.made for run in tried)
    return tried + [final(row, seed, base, folder) for seed in SEEDS if known]


def _slug(name: str) -> str:
    return name.lower().replace(" ", "-")


# -- what they are worth --------------------------------------------------------------------------


def told(row: Row, base: Preset, folder: Path, starts: int, seconds: float) -> dict:
    """A row of the result."""
    data = recipe_data.of(row.data)
    real = [
        split == "train" and not name.endswith("_mirrored")
        for split, name in zip(data.splits, data.names, strict=True)
    ]
    runs = [final(row, seed, base, folder) for seed in SEEDS]
    found = {
        "what": row.what,
        "updates": runs[0].preset.updates,
        "minutes": float(data.lengths[real].sum()) / data.encoding.fps / 60,
        "runs": [evaluated(run, starts, seconds) for run in runs],
    }
    if row.rates:
        found["learning rates"] = {
            f"{run.preset.learning_rate:g}": run.validation for run in trials(row, base, folder)
        }
    return found


def evaluated(run: Run, starts: int, seconds: float) -> dict:
    """One training, judged on test clips; kept, since the rollouts take minutes."""
    kept = run.folder / f"found-{starts}-{seconds:g}.json"
    if kept.exists():
        return json.loads(kept.read_text())
    data = recipe_data.of(run.row.data)
    path = run.folder / "best.safetensors"
    found = {"seed": run.seed, "fell apart": run.fell_apart}
    if path.exists():
        model, about = load_weights(path)
        model.eval().requires_grad_(False)
        found |= {"update": about["update"], "validation": run.validation}
        found["log-likelihood"] = likelihood(model, data.clips("test")).value
        found |= robustness(model, data, starts, seconds)
    found = record.rounded(found)
    write_whole(kept, lambda stream: stream.write(json.dumps(found).encode()))
    return found


@cache
def _judged(data_name: str) -> tuple[rollouts.Judge, float]:
    """The judge of some data, and the mean acceleration of the clips that rollouts begin in."""
    data = recipe_data.of(data_name)
    judge = rollouts.judge_of(data)
    clips = [data.encoding.positions(clip) for clip in data.clips("test")]
    clips = [clip for clip in clips if len(clip) >= rollouts.OBSERVED * data.encoding.fps]
    each = [measured(p, data.encoding.skeleton, data.encoding.fps) for p in clips]
    return judge, over_all(each, list(map(len, clips)))["acceleration (m/s²)"].value


def robustness(model: nn.Module, data: Prepared, starts: int, seconds: float) -> dict:
    """How long samples at temperature 1 last, and how lively they are as long as they do."""
    judge, real = _judged(recipe_data.name_of(data))
    fps, skeleton = data.encoding.fps, data.encoding.skeleton
    begun = starting_windows(data.clips("test"), starts, round(rollouts.OBSERVED * fps))
    lasted, kinds, lively = [], dict.fromkeys(rollouts.KINDS, 0), []
    for _, features in rollouts.sampled(model, begun, round(seconds * fps), seed=0):
        for motion in features:
            points = rollouts.points_of(data.encoding, motion)
            failures = judge.failures(points)
            kinds = {kind: count + math.isfinite(failures[kind]) for kind, count in kinds.items()}
            lasted.append(min(seconds, *failures.values()))
            sound = points[: round(lasted[-1] * fps)]
            if len(sound) >= fps:
                lively.append((measured(sound, skeleton, fps), len(sound)))
    means = {}
    if lively:
        each, frames = zip(*lively, strict=True)
        means = {key: found.value for key, found in over_all(each, frames).items()}
    return {
        "starts": len(lasted),
        "seconds until failure": float(np.mean(lasted)),
        "failed": kinds,
        "samples": means,
        "acceleration over data": means["acceleration (m/s²)"] / real if means else None,
    }


if __name__ == "__main__":
    record.run(main)
