"""Z2, Z5: how far predictions are from what came next, 80 to 640 ms ahead; acLSTM's tables 1 and 2.

    python -m experiments.aclstm.prediction [--only ROW ...] [--preset smoke]

What is measured and how it is judged stands in claims.yaml. Rows that are not trained yet are left
out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

import motionlab
from motionlab import metrics
from motionlab.models.floor import ConstantVelocity, RunningAverage, ZeroVelocity
from motionlab.training.dances import METHODS

from ..common import record
from . import dances
from .trainings import ROWS, run_of, weights_of

MILLISECONDS = (80, 160, 240, 320, 400, 480, 560, 640)
FLOOR = {
    "zero velocity": ZeroVelocity,
    "constant velocity": ConstantVelocity,
    "running average": RunningAverage,
}

# Zhou et al. (2018): table 1, and table 2 of its appendix A, whose rows for length 5 and scheduled
# sampling are those of table 1. Metres of a body of 1.54 m; walking has another body than ours.
PAPER = {
    "lstm-3lr-walking": (2.46, 2.41, 2.28, 2.27, 2.41, 2.65, 2.91, 3.15),
    "aclstm-walking": (1.05, 1.77, 2.20, 2.46, 2.66, 2.79, 2.99, 3.24),
    "erd-walking": (0.13, 0.22, 0.34, 0.50, 0.71, 0.95, 1.19, 1.42),
    "seq2seq-walking": (0.09, 0.13, 0.24, 0.42, 0.74, 1.22, 1.85, 2.79),
    "scheduled-walking": (0.42, 0.56, 0.71, 0.83, 0.93, 0.99, 1.02, 1.05),
    "lstm-3lr-indian": (2.82, 2.83, 2.85, 2.88, 2.89, 2.90, 2.92, 2.92),
    "aclstm-indian": (0.685, 0.99, 1.22, 1.53, 1.89, 2.08, 2.27, 2.55),
    "erd-indian": (0.51, 0.74, 1.25, 1.96, 2.62, 3.31, 3.76, 3.86),
    "seq2seq-indian": (0.49, 0.79, 1.48, 2.95, 5.41, 8.88, 13.29, 18.73),
    "scheduled-indian": (1.54, 2.24, 2.49, 2.52, 2.65, 2.90, 2.94, 3.12),
    "lstm-3lr-martial": (0.69, 0.86, 1.11, 1.36, 1.60, 1.83, 2.03, 2.19),
    "aclstm-martial": (0.52, 0.74, 0.95, 1.14, 1.35, 1.56, 1.73, 1.88),
    "erd-martial": (0.32, 0.44, 0.63, 0.90, 1.14, 1.40, 1.61, 1.88),
    "seq2seq-martial": (0.28, 0.43, 0.87, 1.57, 2.53, 3.89, 5.83, 8.62),
    "scheduled-martial": (0.63, 0.86, 0.91, 0.98, 1.07, 1.12, 1.20, 1.28),
    "length-10": (0.41, 0.52, 0.68, 0.86, 1.04, 1.23, 1.39, 1.55),
    "length-2": (0.83, 1.28, 1.61, 1.87, 2.09, 2.31, 2.51, 2.66),
    "length-1": (0.89, 1.40, 1.78, 2.14, 2.48, 2.70, 2.84, 2.93),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="table", choices=list(METHODS["aclstm"]))
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=[row.name for row in ROWS])
    parser.add_argument("--seeds", type=int, default=20, help="moments to predict from")
    parser.add_argument("--output", help="results/dances_prediction.json if left out")
    chosen = parser.parse_args(arguments)
    if chosen.preset != "table" and not chosen.output:
        parser.error("another preset than table is not the result: name an --output")
    begin = time.perf_counter()
    rows = {}
    for row in ROWS:
        trained = {seed: weights_of(run_of(row, seed, chosen.preset)) for seed in row.seeds}
        trained = {str(seed): path for seed, path in trained.items() if path}
        if trained and (chosen.only is None or row.name in chosen.only):
            rows[row.name] = {
                "what": row.what, "method": row.method, "style": row.data,
                "paper (m)": PAPER.get(row.name),
                "seeds": {s: of_weights(p, row.data, chosen.seeds) for s, p in trained.items()},
            }  # fmt: skip
    styles = sorted({row["style"] for row in rows.values()})
    floor = {style: of_floor(style, chosen.seeds) for style in styles}
    result = {
        "preset": chosen.preset,
        "moments": chosen.seeds,
        "milliseconds": MILLISECONDS,
        "rows": rows,
        "floor": floor,
    }
    hashes = {style: dances.of(style).hash for style in styles}
    facts = record.provenance(begin, 0, dances.of("indian"), data_hashes=hashes)
    record.write(facts | result, chosen.output or "results/dances_prediction.json")


def of_weights(path: Path, style: str, count: int) -> dict:
    """Errors of a trained network."""
    model = motionlab.load(path)
    return {"update": model.about["update"], "errors (m)": errors(model, style, count)}


def of_floor(style: str, count: int) -> dict:
    """Errors of forecasts that nobody trained."""
    encoding = dances.of(style).encoding
    return {name: errors(model(encoding), style, count) for name, model in FLOOR.items()}


def errors(model: nn.Module, style: str, count: int) -> dict[str, list[float]]:
    """Mean over moments at each of `MILLISECONDS`, and its 95 % interval; in metres."""
    seeds = dances.seeds(style, count, model.fps)
    found = distances(model, seeds.seen, seeds.true)
    each = [metrics.bootstrap(column) for column in found.T]
    return {key: [getattr(interval, key) for interval in each] for key in ("value", "low", "high")}


@torch.no_grad()
def distances(model: nn.Module, seen: Tensor, true: Tensor) -> np.ndarray:
    """Metres (moments, times) of a 1.54 m body: the frame as the network has it, as one vector.

    A prediction that is no number is infinitely far.
    """
    made = model.generate(true.shape[1], model.observe(seen))
    as_points = lambda features: features.unflatten(-1, (-1, 3))
    far = metrics.position_error(as_points(made.nan_to_num(0.0, 0.0, 0.0)), as_points(true))
    at = metrics.at_milliseconds(far, model.fps, MILLISECONDS).numpy()
    at[~made.isfinite().flatten(1).all(1)] = np.inf
    return at


if __name__ == "__main__":
    record.run(main)
