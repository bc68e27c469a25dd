"""All trainings that chapter 4 compares: acLSTM, its rivals, and what its parts are worth.

    python -m experiments.aclstm.trainings [--list] [--only ROW ...] [--share 1/2] [--preset smoke]

Goes through a list of trainings, each kept in runs/dances/: stopped and started again, it goes on.
What the claims need most comes first. Two processes that take a share each need half the time.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from motionlab.training import PRESETS
from motionlab.training.checkpoints import write_whole
from motionlab.training.dances import METHODS

from ..common import record, trainings
from ..common.trainings import Run
from . import dances

PLAIN = ("aclstm-indian", "lstm-3lr-indian")  # seen again on their way


@dataclass(frozen=True)
class Row(trainings.Row):
    """Trainings of one method on one style."""

    method: str = "aclstm"
    seeds: tuple[int, ...] = (0,)

    @property
    def model(self) -> str:
        """As `motionlab train` names it."""
        return f"{self.method}-{self.data}"


def _all_methods(style: str) -> list[Row]:
    return [
        Row(name, f"{method} on {style}", data=style, method=method,
            seeds=(0, 1, 2) if name in PLAIN else (0,))
        for method in METHODS for name in [f"{method}-{style}"]
    ]  # fmt: skip


def _indian(name: str, what: str, **changes) -> Row:
    """acLSTM on Indian dance with something changed."""
    return Row(name, what, changes, data="indian")


ROWS = (
    *_all_methods("indian"),
    *_all_methods("martial"),
    _indian("length-10", "10 recorded frames, 10 fed back, and so on", real=10, fed=10),
    _indian("length-1", "recorded and fed-back frames in turn", real=1, fed=1),
    _indian("length-2", "2 recorded frames, 2 fed back, and so on", real=2, fed=2),
    *_all_methods("walking"),
    _indian("fps-60", "60 frames a second, as the paper says", fps=60.0),
    _indian("staircase", "each layer a frame later than the one below", staircase=True),
    _indian("trim", "without the rest at both ends of a clip", trim=True),
    _indian("metres", "features in metres, not normalised", metres=True),
)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="table", choices=list(METHODS["aclstm"]))
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=[row.name for row in ROWS])
    parser.add_argument("--share", default="1/1", help="this process's part of the trainings")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    chosen = parser.parse_args(arguments)
    runs = in_order(chosen.only, chosen.preset)
    if chosen.list:
        trainings.show(runs)
        return
    part, parts = map(int, chosen.share.split("/"))
    for run in runs[part - 1 :: parts]:
        if not run.done:
            run.train(dances.found(run.row.data), run.row.model)
    if all(run.done for run in in_order(None, chosen.preset)):
        told = {run.folder.as_posix(): _told(run) for run in in_order(None, chosen.preset)}
        text = json.dumps(record.rounded(told), indent=1)
        write_whole(
            folder_of(chosen.preset) / "all.json", lambda stream: stream.write(text.encode())
        )


def folder_of(preset: str) -> Path:
    """Where trainings are kept."""
    return Path("runs") / ("dances" if preset == "table" else f"dances-{preset}")


def in_order(only: Sequence[str] | None, preset: str) -> list[Run]:
    """All trainings: first those of rows that have several, seed by seed, then as rows are listed."""
    runs = [
        run_of(row, seed, preset)
        for row in ROWS if only is None or row.name in only for seed in row.seeds
    ]  # fmt: skip
    return sorted(runs, key=lambda run: (len(run.row.seeds) == 1, run.seed))


def run_of(row: Row, seed: int, preset: str) -> Run:
    """One training of a row; the weights after its last update are always kept."""
    base = PRESETS[row.model][preset]
    snapshots = base.snapshots or base.validate_every
    settings = replace(base, seed=seed, snapshots=snapshots, **row.changes)
    return Run(row, seed, settings, folder_of(preset) / row.name / f"seed-{seed}")


def snapshots(run: Run) -> dict[int, Path]:
    """Weights that were kept, by the number of updates after which they were."""
    found = {
        int(path.stem.removeprefix("at-")): path for path in run.folder.glob("at-*.safetensors")
    }
    return dict(sorted(found.items()))


def weights_of(run: Run) -> Path | None:
    """The weights after the last update; None if the training is not done, or left none.

    Not those of the lowest validation loss: with equal updates for all methods, how long to train
    is not chosen by a loss that each of them defines in its own way.
    """
    kept = list(snapshots(run).values())
    return kept[-1] if kept and run.done else None


def _told(run: Run) -> dict:
    """What is worth knowing of a training."""
    last = run.curve[-1] if run.curve else {}
    return {
        "updates": run.made, "hours": last.get("seconds", 0.0) / 3600,
        "training loss": last.get("train"), "validation loss": last.get("val"),
        "lowest validation loss": run.validation, "fell apart": run.fell_apart,
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
