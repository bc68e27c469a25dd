"""How well an STRNN foretells, beside rivals with as many updates: the claim S6.

    python -m experiments.strnn.prediction WEIGHTS [--data everything] [--split test]
        [--output results/strnn_prediction.json]

WEIGHTS are those of the network of S3, told beside. The others are trainings of
`experiments.strnn.ablations`, seed 0. Error: mean Euclidean distance of frames in deviations of the
training frames, after `FLOOR` frames.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import torch
from torch import Tensor, nn

import motionlab
from motionlab import metrics
from motionlab.models.gpdm import Gpdm
from motionlab.models.ngram import Ngram
from motionlab.models.ridge import Ridge
from motionlab.training import Prepared
from motionlab.training.checkpoints import load_weights
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

from ..common import record
from . import ablations
from .extrapolation import FLOOR, PENALTY, STEP

TIMES = (80, 160, 240, 320, 400, 480, 560)  # ms
# On validation clips more updates foretold worse, and so did six dimensions.
GPDM = {"latent": 3, "length": 30, "frames": 600, "updates": 20}
OURS = ("Composite_20_20_HY", "SpatioTemp_20_20_LH", "Temporal_20_20_MSE")

Forecast = Callable[[Tensor, int], Tensor]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--data", default="everything")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--output", default="results/strnn_prediction.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    shipped = motionlab.load(chosen.weights)
    data = in_body_frame(Prepared.find(chosen.data)).matching(shipped.encoding)
    clips, rows = data.clips(chosen.split), {}
    for run in ablations.in_order((*OURS, *ablations.METHODS)):
        if run.seed == 0:
            model, _ = load_weights(ablations.weights_of(run))
            rows[run.row.name] = errors(forecast_of(model), clips, data)
    rows["6-gram"] = errors(ngram_of(data).extrapolate, clips, data)
    rows["gpdm"] = errors(gpdm_of(data).extrapolate, clips, data)
    ridge = Ridge.fit(data.encoding, data.normalizer, data.clips("train"), FLOOR, FLOOR,
                      penalty=PENALTY, step=STEP)  # fmt: skip
    beside = {
        "zero velocity": lambda seen, n: seen[:, -1:].expand(-1, n, -1),
        "ridge regression": ridge.extrapolate, "the network of S3": shipped.extrapolate,
    }  # fmt: skip
    result = {
        "split": chosen.split, "rows": rows,
        "beside": {name: errors(go_on, clips, data) for name, go_on in beside.items()},
        "updates": ablations.TABLE.updates, "gpdm": GPDM,
        "weights": record.about_weights(shipped, chosen.weights),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def forecast_of(model: nn.Module) -> Forecast:
    """How a network goes on, whether it names one frame at a time or many."""
    if hasattr(model, "extrapolate"):
        return model.extrapolate
    return lambda seen, n: model.generate(n, model.observe(seen, doubt=False))


def ngram_of(data: Prepared) -> Ngram:
    """Six frames of any training clip or its mirror image."""
    return Ngram.fit(data.encoding, data.normalizer, data.clips("train"), 6, FLOOR)


def gpdm_of(data: Prepared) -> Gpdm:
    """A second from the middle of each of a few training clips; exact processes bear no more."""
    return Gpdm.fit(data.encoding, data.normalizer, data.clips("train"), **GPDM)


@torch.no_grad()
def errors(go_on: Forecast, clips: Sequence[Tensor], data: Prepared) -> dict[str, float]:
    """Mean distance from the frames that came, at `TIMES`, over all windows of clips."""
    off = []
    for windows in Windows(clips, 2 * FLOOR).tiles(256):
        said = data.normalizer(go_on(windows[:, :FLOOR], FLOOR))
        off.append((said - data.normalizer(windows[:, FLOOR:])).norm(dim=-1))
    mean = torch.cat(off).mean(0)
    at = metrics.at_milliseconds(mean, data.encoding.fps, TIMES)
    return {f"{ms} ms": float(its) for ms, its in zip(TIMES, at, strict=True)}


if __name__ == "__main__":
    record.run(main)
