"""The trainings of the table: four networks that see as many frames of the same clips.

    python -m experiments.comparison.trainings [--list] [--only ROW ...] [--seeds 0 1 2]

A frame that is seen is one of a window of an update: updates x batch x frames, `BUDGET`, is the same for
all rows. Each has the recipe of its preset `table`, shortened. Trainings stay in runs/comparison/: stopped
and started again, it goes on. The first seed of all rows comes first.

    RNN      LSTM-GMM on joint angles, without contacts
    acLSTM   LSTM-3LR on points around the root, half of its inputs its own
    STRNN    the residual network behind a Temporal 20/20, as it ships, on points in the body's frame
    PFNN     with a trajectory of a second either way; each of its windows is a frame
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path

import torch
from torch import Tensor

from motionlab import Skeleton
from motionlab.encodings import Normalizer, RootRelative
from motionlab.training import PRESETS, Prepared, Preset
from motionlab.training.dances import METHODS

from ..common import record, trainings
from ..common.trainings import Run

FOLDER = Path("runs/comparison")
SEEDS = (0, 1, 2)
UPDATES, BATCH, FRAMES = 1_000, 32, 64
BUDGET = UPDATES * BATCH * FRAMES  # frames that each training sees

_SHORT = {"updates": UPDATES, "decay": 250, "warmup": 100, "validate_every": 250}
_STRNN = {"updates": 1_600, "decay": 400, "warmup": 100, "validate_every": 400}
PRESETS_OF: dict[str, Preset] = {
    "RNN": replace(PRESETS["lstm-gmm"]["table"], batch=BATCH, frames=FRAMES, **_SHORT),
    # at its own tempo: people who run are not recorded for longer than a window
    "acLSTM": replace(
        METHODS["aclstm"]["table"], batch=BATCH, frames=FRAMES, tempo=0.0, snapshots=0, **_SHORT
    ),
    # windows of 40 frames, so more of them
    "STRNN": replace(
        PRESETS["strnn-temporal-hy"]["table"], batch=BATCH, quiet=800, alone=133, behind=267,
        bones=0.1, **_STRNN,
    ),
    "PFNN": replace(PRESETS["pfnn"]["table"], batch=BATCH * FRAMES, **_SHORT),
}  # fmt: skip
ROWS = (
    trainings.Row("RNN", "the plain generator"),
    trainings.Row("acLSTM", "auto-conditioned, 5 recorded frames and 5 of its own"),
    trainings.Row("STRNN", "20 frames read, 20 foretold, in three stages"),
    trainings.Row("PFNN", "led by a trajectory"),
)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=list(PRESETS_OF))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    chosen = parser.parse_args(arguments)
    runs = [
        run
        for seed in chosen.seeds
        for run in map(lambda row, seed=seed: run_of(row.name, seed), ROWS)
        if chosen.only is None or run.row.name in chosen.only
    ]
    if chosen.list:
        trainings.show(runs)
        return
    torch.set_num_threads(1)
    data = Prepared.find(chosen.data)
    for run in runs:
        if not run.done:
            run.train(data_of(run.row.name, data), run.row.name)


def run_of(name: str, seed: int) -> Run:
    """The training of a row; its folder is named by its settings, too."""
    row = next(row for row in ROWS if row.name == name)
    preset = replace(PRESETS_OF[name], seed=seed)
    settings = hashlib.sha256(repr(sorted(asdict(preset).items())).encode()).hexdigest()[:8]
    return Run(row, seed, preset, FOLDER / f"{name}-{seed}-{settings}")


def weights_of(run: Run) -> Path | None:
    """What a training that is done has left; None if it is not."""
    path = run.folder / run.preset.weights
    return path if run.done and path.is_file() else None


def frames_seen(preset: Preset) -> int:
    """By a training: updates x batch x frames. A window of the PFNN is one frame."""
    frames = 1 if hasattr(preset, "sparsity") else preset.frames
    return preset.updates * preset.batch * frames


def data_of(name: str, data: Prepared) -> Prepared:
    """The clips as a row's network has them; a STRNN's preset and a PFNN's bring them about themselves."""
    if name == "RNN":
        return data.without_contacts()
    return around_root(data) if name == "acLSTM" else data


@lru_cache(maxsize=1)
def around_root(data: Prepared) -> Prepared:
    """The same clips as joints around the root."""
    encoding = RootRelative(joints_alone(data.encoding.skeleton), data.encoding.fps)
    each = data.features.split(data.lengths.tolist())
    rows = [rows_of(data.encoding.positions(clip)[:, : encoding.points]) for clip in each]
    learned = [clip for clip, split in zip(rows, data.splits, strict=True) if split == "train"]
    normalizer = Normalizer.fit(learned)
    return replace(data, features=torch.cat(rows), encoding=encoding, normalizer=normalizer)


def joints_alone(skeleton: Skeleton) -> Skeleton:
    """The body without its end sites, which not every encoding carries."""
    return replace(skeleton, end_parents=(), end_offsets=torch.zeros(0, 3), roles=None)


def rows_of(points: Tensor) -> Tensor:
    """Features of `RootRelative` (..., frames, 3 points) of points (..., frames, points, 3)."""
    root, others = points[..., :1, :], points[..., 1:, :]
    steps = root[..., 0, :].diff(dim=-2)
    steps = torch.cat([steps[..., :1, :], steps], dim=-2)
    steps = torch.stack([steps[..., 0], root[..., 0, 1], steps[..., 2]], dim=-1)
    return torch.cat([steps, (others - root).flatten(-2)], dim=-1)


if __name__ == "__main__":
    record.run(main)
