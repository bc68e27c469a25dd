"""Why do generated runs slow down? Trainings from nothing that differ in how runs are seen.

    python -m experiments.rnn_gan.running_on [--list] [--only ROW ...] [--seeds 0 1 2]

Recorded runs end in mid-stride: what comes after two seconds of running the network never sees.
Each row is the contact generator at the table preset. Trainings stay in runs/running_on/: stopped
and started again, it goes on. Pace is measured as in `keeping_pace`, on validation clips, and
written to results/running_on.json when all are there.

The rule, fixed before these trainings: a row helps if in every seed its runs are nearer to their
start's pace at 8 to 10 seconds than those of the row "as recorded" in any seed, and its walks are
within 5 % of theirs; the shipped preset takes, of the rows that help, the one with the best
likelihood on validation clips.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from torch import nn

import motionlab
from motionlab.training import PRESETS, Prepared
from motionlab.training.evaluation import likelihood

from ..common import record, trainings
from ..common.trainings import Run
from .keeping_pace import GAITS, REACH, starts, told

NAME = "lstm-gmm-contacts"
LONG = 180  # frames to which runs are brought
SAMPLING = {"temperature": 0.15}  # as shipped, for all rows alike
JUDGED = "8-10 s"

ROWS = (
    trainings.Row("as recorded", "runs that end in mid-stride, as few as there are"),
    trainings.Row("more often", "a fifth of all windows run", {"runs": 0.2}),
    trainings.Row("go on", "runs go on for six seconds", {"run_on": LONG}),
    trainings.Row("go on, 0.2", "and a fifth of all windows run", {"run_on": LONG, "runs": 0.2}),
    trainings.Row("go on, 0.3", "and three tenths of them", {"run_on": LONG, "runs": 0.3}),
)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="table", choices=list(PRESETS[NAME]))
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=[row.name for row in ROWS])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--output", default="results/running_on.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    runs = {
        row.name: [run_of(row, seed, chosen.preset) for seed in chosen.seeds]
        for row in ROWS
        if chosen.only is None or row.name in chosen.only
    }
    if chosen.list:
        trainings.show(run for each in runs.values() for run in each)
        return
    data = Prepared.find("locomotion")
    for seed in zip(*runs.values(), strict=True):  # a whole comparison first, then the next seed
        for run in seed:
            if not run.done:
                run.train(data, NAME)
    rows = {
        name: [measured(run, data, chosen.starts) for run in each] for name, each in runs.items()
    }
    result = {"preset": chosen.preset, "sampling": SAMPLING, "rows": rows, "helps": helping(rows)}
    record.write(
        record.provenance(begin, chosen.seeds[0], data, seeds=chosen.seeds) | result, chosen.output
    )


def run_of(row: trainings.Row, seed: int, preset: str) -> Run:
    its = replace(PRESETS[NAME][preset], seed=seed, run_on=0, runs=0.0)
    folder = (
        Path("runs/running_on") / f"{preset}-{row.name.replace(' ', '_').replace(',', '')}-{seed}"
    )
    return Run(row, seed, replace(its, **row.changes), folder)


def measured(run: Run, data: Prepared, count: int) -> dict:
    """Pace and likelihood on validation clips of one training, measured before or now."""
    model = motionlab.load(run.folder / "best.safetensors")
    kept = run.folder / f"pace-{model.hash[:8]}-{data.hash[:8]}-{count}.json"
    if not kept.is_file():
        found = record.rounded(_measured(model, data, count))
        kept.write_text(json.dumps(found), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def _measured(model: nn.Module, data: Prepared, count: int) -> dict:
    found = {"likelihood": likelihood(model, data.clips("val"))._asdict()}
    for gait in GAITS:
        begun, speeds, _ = starts(data, gait, "val", count)
        found[gait] = told(model, begun, speeds, gait, SAMPLING)["spans"]
    return found


def helping(rows: dict[str, list[dict]]) -> list[str]:
    """Names of rows that help, the best likelihood first."""
    apart = lambda found, gait: abs(found[gait][JUDGED]["speed over the start's"]["value"] - 1)
    least = min((apart(found, "run") for found in rows.get("as recorded", [])), default=None)
    good = [
        name
        for name, seeds in rows.items()
        if least is not None
        and all(apart(f, "run") < least and apart(f, "walk") <= REACH["walk"] for f in seeds)
    ]
    nats = lambda name: sum(found["likelihood"]["value"] for found in rows[name])
    return sorted(good, key=nats, reverse=True)


if __name__ == "__main__":
    record.run(main)
