"""Three choices of STRNN's authors: LSTM over GRU, no attention, positions over angles. Claims S10.

    python -m experiments.strnn.choices [--data runs/everything.npz] [--preset table|smoke] [--list]
        [--seeds 2]

Temporal_20_20_MSE of `experiments.strnn.ablations` beside the same with one choice made otherwise, kept
in runs/strnn_choices/: stopped and started again, a training goes on. Updates, windows, frames, noise
and width are equal; the number of weights is told. How it is judged stands in claims.yaml.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from motionlab.models import Strnn
from motionlab.training import Prepared
from motionlab.training.checkpoints import read_checkpoint
from motionlab.training.strnn import StrnnPreset, in_body_frame
from motionlab.training.windows import Windows

from ..common.trainings import Run, show
from . import ablations
from .ablations import Row
from .other_decoders import AttentiveStrnn, GruStrnn

FOLDER = Path("runs/strnn_choices")
PLAIN = "Temporal_20_20_MSE"
ROWS = (
    Row("GRU", "GRU cells instead of LSTM cells"),
    Row("attention", "decoder and predictor look back at all frames that were read"),
    Row("angles", "frames are joint angles, not positions"),
)
KINDS = {"GRU": GruStrnn, "attention": AttentiveStrnn}
LOOKED_AT = {
    "walk": "bandai-locomotion",
    "dance": "aclstm-cmu",
}  # sources; the first prefix of each


@dataclass(frozen=True)
class ChoicePreset(StrnnPreset):
    """Settings of a training of one of `ROWS`."""

    choice: str = "GRU"

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of a split, of the rows that data have."""
        return Windows(data.clips(split), self.frames)

    def model(self, data: Prepared) -> Strnn:
        """An untrained network for some data."""
        sizes = self.width, self.frames - self.predict, self.predict
        if self.choice in KINDS:
            return KINDS[self.choice](data.encoding, data.normalizer, *sizes)
        return Strnn(
            data.encoding, data.normalizer, *sizes, spatial=False, residual=False, drop=self.drop
        )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default="runs/everything.npz")
    parser.add_argument("--preset", default="table", choices=("table", "smoke"))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    chosen = parser.parse_args(arguments)
    runs = in_order(chosen.preset, chosen.seeds)
    if chosen.list:
        show(runs)
        return
    angles = Prepared.find(chosen.data)
    body = in_body_frame(angles)
    for run in runs:
        if not run.done:
            run.train(rows_for(run, angles, body), run.row.name)


# -- trainings ------------------------------------------------------------------------------------


def in_order(preset: str = "table", seeds: int = 2) -> list[Run]:
    """All trainings, those of a seed side by side; those without a choice are of the ablations."""
    plain = [run for run in ablations.in_order([PLAIN], preset) if run.seed < seeds]
    folder = FOLDER if preset == "table" else FOLDER / preset
    others = [
        Run(row, run.seed, ChoicePreset(**vars(run.preset) | {"choice": row.name}),
            folder / row.name / f"seed-{run.seed}")
        for run in plain for row in ROWS
    ]  # fmt: skip
    return sorted(plain + others, key=lambda run: run.seed)


def rows_for(run: Run, angles: Prepared, body: Prepared) -> Prepared:
    """The clips as a row learns from them."""
    return angles if run.row.name == "angles" else body


def trained(run: Run, data: Prepared) -> Strnn:
    """The network of a training, with the weights that were best in validation."""
    model = run.preset.model(data)
    model.load_state_dict(read_checkpoint(ablations.weights_of(run))[0])
    return model.eval()
