"""What was tried so that walks and runs keep their pace for a minute, where those that ship do not.

    python -m experiments.rnn_gan.pace_attempts [--model lstm-gmm-permissive] [--list]

`keeping_pace` measures what ships on test clips; here each attempt is measured alike on validation
clips. Some change how frames are drawn, and cost nothing; others go on training from the weights that
ship, with one change each. Trainings stay in runs/pace_attempts/: stopped and started again, it goes on.

The rule, fixed before these runs: an attempt helps if walks stay within 5 % and runs within 10 % of
their start's pace at 8 to 10 and at 30 to 60 seconds, with a likelihood of validation clips not below
that of the weights that ship by more than 1 nat a frame. Without one that helps, what ships stays.
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
from motionlab.errors import DataError
from motionlab.training import PRESETS, Prepared
from motionlab.training.evaluation import likelihood
from motionlab.weights import find

from ..common import record, trainings
from ..common.trainings import Run
from .keeping_pace import GAITS, JUDGED, REACH, starts, told

FOLDER = Path("runs/pace_attempts")
DATA = {
    "lstm-gmm-contacts": "locomotion",
    "lstm-gmm-permissive": "runs/locomotion-permissive.npz",
}
MORE = {"updates": 400, "decay": 400, "learning_rate": 1e-3}  # of training, from what ships
SHIPS = "as it ships"
DRAWN: dict[str, dict] = {
    SHIPS: {},
    "half as much chance": {"temperature": 0.5},
    "half as much again": {"temperature": 1.5},
}  # factors on how frames are drawn
TRAINED = (
    trainings.Row("no change", "goes on as before", MORE),
    trainings.Row("more noise", "inputs further off: 0.2 deviations", MORE | {"noise": 0.2}),
    trainings.Row("longer windows", "windows of 160 frames", MORE | {"frames": 160, "batch": 16}),
    trainings.Row("no run more often", "runs as often as there are", MORE | {"runs": 0.0}),
)
NATS = 1.0  # of likelihood that an attempt may lose


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="lstm-gmm-contacts", choices=list(DATA))
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--output", help="results/MODEL_pace_attempts.json if left out")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    runs = [run_of(row, chosen.model) for row in TRAINED]
    if chosen.list:
        trainings.show(runs)
        return
    data = Prepared.find(DATA[chosen.model])
    ships = motionlab.load(chosen.model)
    rows = {
        name: measured(ships, drawn(ships, factors), data, chosen.starts)
        for name, factors in DRAWN.items()
    }
    for run in runs:
        if not run.done:
            run.train(data, chosen.model)
        model = motionlab.load(run.folder / "best.safetensors")
        rows[run.row.name] = measured(model, dict(ships.sampling), data, chosen.starts)
    result = {
        "weights": record.about_weights(ships, find(chosen.model)),
        "split": "val",
        "sampling": dict(ships.sampling),
        "what": {run.row.name: run.row.what for run in runs},
        "rows": rows,
        "helps": [name for name, row in rows.items() if helps(row, rows[SHIPS])],
    }
    output = chosen.output or f"results/{chosen.model.replace('-', '_')}_pace_attempts.json"
    record.write(record.provenance(begin, 0, data) | result, output)


def run_of(row: trainings.Row, model: str) -> Run:
    preset = replace(PRESETS[model]["ship"], **row.changes)
    return Run(row, 0, preset, FOLDER / f"{model}-{row.name.replace(' ', '_')}", find(model))


def drawn(model: nn.Module, factors: dict[str, float]) -> dict:
    """How frames are drawn: as the model ships, some of it times a factor."""
    return model.sampling | {name: by * model.sampling[name] for name, by in factors.items()}


def measured(model: nn.Module, sampling: dict, data: Prepared, count: int) -> dict:
    """Pace and likelihood on validation clips, measured before or now."""
    named = "-".join(f"{name}{value:g}" for name, value in sorted(sampling.items()))
    kept = FOLDER / f"{model.hash[:8]}-{named}-{data.hash[:8]}-{count}.json"
    if not kept.is_file():
        kept.parent.mkdir(parents=True, exist_ok=True)
        matching = data.matching(model.encoding)
        found = {"likelihood": likelihood(model, matching.clips("val"))._asdict()}
        for gait in GAITS:
            try:
                begun, speeds, _ = starts(matching, gait, "val", count)
            except DataError as error:
                found[gait] = {"not measured": str(error)}
                continue
            found[gait] = told(model, begun, speeds, gait, sampling)["spans"]
        kept.write_text(json.dumps(record.rounded(found)), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def helps(row: dict, ships: dict) -> bool:
    """The rule; a gait of which there are no starts is left out."""
    spans = [f"{first}-{last} s" for first, last in JUDGED]
    near = all(
        abs(row[gait][span]["speed over the start's"]["value"] - 1) <= REACH[gait]
        for gait in GAITS
        for span in spans
        if span in row[gait]
    )
    return near and row["likelihood"]["value"] >= ships["likelihood"]["value"] - NATS


if __name__ == "__main__":
    record.run(main)
