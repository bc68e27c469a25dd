"""What was tried so that the plain generator copies less of what it learnt from (W1-novelty).

    python -m experiments.rnn_gan.replay_attempts [--list]

`samples` counts replays on test clips; here each attempt is measured alike on validation clips. Some
change how frames are drawn, and cost nothing; others go on training from the weights that ship, with
one change each. Trainings and rows stay in runs/replay_attempts/: stopped and started again, it goes on.

The rule, fixed before these runs: an attempt helps if at most 5 % of the windows are replays, with a
median distance of at most 1.5 times that of held-out clips, acceleration within 10 % and jerk within
20 % of people's, and a likelihood of validation clips not below that of the weights that ship by more
than 1 nat a frame. Without one that helps, what ships stays.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch
from torch import nn

import motionlab
from motionlab.training import PRESETS, Prepared
from motionlab.training.checkpoints import write_whole
from motionlab.training.evaluation import evaluate, likelihood
from motionlab.weights import find

from ..common import record, rollouts, trainings
from ..common.rollouts import OBSERVED
from ..common.trainings import Run
from . import samples
from .pace_attempts import MORE, NATS, SHIPS, drawn

MODEL = "lstm-gmm"
FOLDER = Path("runs/replay_attempts")
MINUTE = 1800  # frames
DRAWN: dict[str, dict] = {
    SHIPS: {},
    "half as much chance again": {"temperature": 1.5},
    "twice as much chance": {"temperature": 2.0},
    "three times as much": {"temperature": 3.0},
}  # factors on how frames are drawn
TRAINED = (
    trainings.Row("no change", "goes on as before", MORE),
    trainings.Row("more noise", "inputs further off: 0.2 deviations", MORE | {"noise": 0.2}),
    trainings.Row("shorter windows", "windows of 32 frames", MORE | {"frames": 32, "batch": 64}),
)
REPLAYS, FAR, ACCELERATION, JERK = 0.05, 1.5, 0.10, 0.20  # the rule's


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--starts", type=int, default=50)
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--output", default="results/lstm_gmm_replay_attempts.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    runs = [run_of(row) for row in TRAINED]
    if chosen.list:
        trainings.show(runs)
        return
    data = Prepared.find(chosen.data)
    ships = motionlab.load(MODEL)
    rows = {
        name: measured(ships, drawn(ships, factors), data, chosen.starts)
        for name, factors in DRAWN.items()
    }
    for run in runs:
        if not run.done:
            run.train(data.matching(ships.encoding), MODEL)  # it knows no contacts
        model = motionlab.load(run.folder / "best.safetensors")
        rows[run.row.name] = measured(model, dict(ships.sampling), data, chosen.starts)
    result = {
        "weights": record.about_weights(ships, find(MODEL)),
        "split": "val",
        "sampling": dict(ships.sampling),
        "what": {run.row.name: run.row.what for run in runs},
        "rows": rows,
        "helps": [name for name, row in rows.items() if helps(row, rows[SHIPS])],
    }
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def run_of(row: trainings.Row) -> Run:
    preset = replace(PRESETS[MODEL]["ship"], **row.changes)
    return Run(row, 0, preset, FOLDER / row.name.replace(" ", "_"), find(MODEL))


def measured(model: nn.Module, sampling: dict, full: Prepared, starts: int) -> dict:
    """Replays, likeness and likelihood on validation clips, measured before or now."""
    named = "-".join(f"{name}{value:g}" for name, value in sorted(sampling.items()))
    kept = FOLDER / f"{model.hash[:8]}-{named}-{full.hash[:8]}-{starts}.json"
    if not kept.is_file():
        data = full.matching(model.encoding)
        clips = data.clips("val")
        beside = evaluate(model, data, "val", starts=starts, seconds=10, **sampling)
        found = {
            "likelihood": likelihood(model, clips)._asdict(),
            "samples over data": {
                key: value.value / beside.data[key].value for key, value in beside.samples.items()
            },
            "novelty": samples.novelty(heads(model, data, sampling, starts), full, model.encoding, "val"),
        }  # fmt: skip
        text = json.dumps(record.rounded(found))
        write_whole(kept, lambda stream: stream.write(text.encode()))
    return json.loads(kept.read_text(encoding="utf-8"))


def heads(model: nn.Module, data: Prepared, sampling: dict, starts: int) -> torch.Tensor:
    """First minutes (some, frames, dim) of rollouts from validation clips, of those that last it."""
    seen = round(OBSERVED * model.fps)
    clips = [clip for clip in data.clips("val") if len(clip) >= seen]
    begun = torch.stack([clips[i][:seen] for i in rollouts.spread_evenly(len(clips), starts)])
    made = torch.cat([some for _, some in rollouts.sampled(model, begun, MINUTE, 0, **sampling)])
    judge = rollouts.judge_of(data)
    fails = [judge.failures(rollouts.points_of(model.encoding, one)) for one in made]
    return made[torch.tensor([min(when.values()) == math.inf for when in fails])]


def helps(row: dict, ships: dict) -> bool:
    """The rule."""
    new, over = row["novelty"], row["samples over data"]
    return bool(
        new
        and new["replays"] <= REPLAYS
        and new["median over that of held-out clips"] <= FAR
        and abs(over["acceleration (m/s²)"] - 1) <= ACCELERATION
        and abs(over["jerk (m/s³)"] - 1) <= JERK
        and row["likelihood"]["value"] >= ships["likelihood"]["value"] - NATS
    )


if __name__ == "__main__":
    record.run(main)
