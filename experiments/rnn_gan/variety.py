"""W1-variety: what makes samples from one start differ more, and what that costs.

    python -m experiments.rnn_gan.variety [--model lstm-gmm]

The claim is judged at the temperature that the weights are shipped with (samples.py). Here
the sources of chance are turned up one by one, on validation clips: the choice among the Gaussians,
their width, noise on what is fed back, and how long noise lasts. With more choice or a memory the
width is fitted anew, so that samples stay as lively as people.
"""

from __future__ import annotations

import argparse
import time

from torch import nn

import motionlab
from motionlab.training import Prepared
from motionlab.training.evaluation import evaluate
from motionlab.training.finish import fit_temperature
from motionlab.weights import find

from ..common import record, rollouts
from . import samples

CHOICES, WIDTHS, NOISES, MEMORIES = (1.0, 2.0, 4.0), (0.5, 1.0), (0.05, 0.1), (0.8, 0.9)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm", help="shipped name, or file of weights")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument(
        "--starts", type=int, default=50, help="samples of which liveliness is told"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", default="results/lstm_gmm_variety.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    judge = rollouts.judge_of(data)
    rows = []
    for changed, sampling in settings(model, data):
        found = samples.variety(model, data, judge, chosen.seed, sampling, split="val")
        beside = evaluate(
            model, data, "val", starts=chosen.starts, seconds=10, seed=chosen.seed, **sampling
        )
        ratios = samples.over_people(found)
        rows.append({
            "turned up": changed,
            "sampling": sampling,
            "spread over people's": ratios,
            "as varied as people": sum(ratio >= 1 for ratio in ratios.values()),
            "sound": {gait: its["sound"] for gait, its in found.items()},
            "samples over data": {
                key: value.value / beside.data[key].value for key, value in beside.samples.items()
            },
        })  # fmt: skip
        print(changed, sampling, rows[-1]["as varied as people"], rows[-1]["sound"], flush=True)
    result = {"weights": record.about_weights(model, path), "split": "val", "rows": rows}
    record.write(record.provenance(begin, chosen.seed, data) | result, chosen.output)


def settings(model: nn.Module, data: Prepared) -> list[tuple[str, dict[str, float]]]:
    """What is turned up, and what `generate` is called with."""
    clips = data.clips("val")
    rows = []
    for choice in CHOICES:
        width = fit_temperature(model, clips, component_temperature=choice)
        sampling = {"temperature": width, "component_temperature": choice}
        rows.append(("component temperature" if rows else "nothing", sampling))
    calm = rows[0][1]
    rows += [("temperature", calm | {"temperature": width}) for width in WIDTHS]
    rows += [("noise", calm | {"noise": noise}) for noise in NOISES]
    for memory in MEMORIES:
        width = fit_temperature(model, clips, memory=memory)
        rows.append(("memory", calm | {"temperature": width, "memory": memory}))
    return rows


if __name__ == "__main__":
    record.run(main)
