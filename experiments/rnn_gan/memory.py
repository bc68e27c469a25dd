"""Which temperature and which memory of the noise suit a generator: fitted on validation clips.

    python -m experiments.rnn_gan.memory [--model lstm-gmm]

White noise that accelerates as people do leaves little chance: samples from one start differ less
than people do (W1-variety). Noise with a memory (`LstmGmm.generate`) differs more with less
trembling, so it has two numbers to fit, temperature and memory.

The rule, written before any run
--------------------------------
Tried are all pairs of TEMPERATURES and MEMORIES, and white noise at the temperature that fits
(`fit_temperature`: mean acceleration as people's). Of each pair is measured, over people's:

* a, j: mean acceleration and mean jerk of STARTS samples of 10 s from all over the validation clips,
  over those of these clips;
* s, six of them: spread of mean speed, turn rate and step length, as in W1-variety, of walks and
  runs, over that of people who do the same again; the median over three starts, the validation clips
  at the QUARTILES of speed, SAMPLES from each;
* sound: the share of these samples that W1-variety calls sound, of walks and of runs;
* skate: weighted foot skate over people's.

A pair that is unsound, or skates, is out: less sound than white noise by more than LESS_SOUND, in
walks or in runs, or more than MORE_SKATE times white noise's skate. Of those left the one is taken
that is nearest to people, by the least cost

    |ln a| / ln 1.1  +  |ln j| / ln 1.2  +  mean of w |ln s| / ln 1.5,

w being 1 where samples differ less than people, and EXCESS where they differ more: the claim is that
they differ enough. So 10 % of acceleration weigh as much as 20 % of jerk, and as a spread that is
too small by a third in all six. White noise takes part: it is the answer if no memory is better.
What is chosen is judged by W1-variety-memory on test clips, once (samples.py --sampling).
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from pathlib import Path

from torch import nn

import motionlab
from motionlab.training import Prepared
from motionlab.training.checkpoints import write_whole
from motionlab.training.evaluation import evaluate
from motionlab.training.finish import fit_temperature
from motionlab.weights import find

from ..common import record, rollouts
from ..common.rollouts import Judge
from . import samples

TEMPERATURES, MEMORIES = (0.2, 0.3, 0.4, 0.5), (0.5, 0.7, 0.8, 0.9, 0.95)
STARTS, SAMPLES, QUARTILES = 50, 40, (0.25, 0.5, 0.75)
LESS_SOUND, MORE_SKATE = 0.05, 4 / 3
ACCELERATION, JERK, SPREAD = math.log(1.1), math.log(1.2), math.log(1.5)  # what weighs as much
EXCESS = 0.5
FOLDER = Path("runs") / "memory"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--model", default="lstm-gmm", help="shipped name, or file of weights")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--starts", type=int, default=STARTS, help="fewer, to see that it runs")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="fewer, to see that it runs")
    parser.add_argument("--pairs", type=int, help="only so many of them, to see that it runs")
    parser.add_argument("--output", help="results/MODEL_memory.json if left out")
    chosen = parser.parse_args(arguments)
    output = chosen.output or f"results/{Path(chosen.model).stem.replace('-', '_')}_memory.json"
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    judge = rollouts.judge_of(data)
    known = samples.people(data, judge)
    rows = []
    for sampling in pairs(model, data)[: chosen.pairs]:
        rows.append(kept(model, data, judge, known, sampling, chosen))
        print(f"{sampling}: cost {cost(rows[-1]):.2f}", flush=True)
    best = choose(rows)
    result = {
        "weights": record.about_weights(model, path), "split": "val", "sampling": best["sampling"],
        "rows": [
            row | {"cost": cost(row), "left out": left_out(row, rows[0])} for row in rows
        ],
    }  # fmt: skip
    record.write(record.provenance(begin, chosen.seed, data) | result, output)


def pairs(model: nn.Module, data: Prepared) -> list[dict[str, float]]:
    """What is tried; white noise comes first."""
    white = {"temperature": fit_temperature(model, data.clips("val")), "memory": 0.0}
    tried = [{"temperature": t, "memory": m} for m in MEMORIES for t in TEMPERATURES]
    return [white, *tried]


def kept(
    model: nn.Module, data: Prepared, judge: Judge, known: samples.People, sampling: dict,
    chosen: argparse.Namespace,
) -> dict:  # fmt: skip
    """What a pair makes; kept in runs/memory/, so that who is stopped goes on."""
    settings = [f"{value:g}" for value in sampling.values()]
    counts = [str(n) for n in (chosen.seed, chosen.starts, chosen.samples)]
    file = FOLDER / ("-".join([model.hash[:12], data.hash[:6], *counts, *settings]) + ".json")
    if not file.exists():
        row = measured(
            model, data, judge, known, sampling, chosen.seed, chosen.starts, chosen.samples
        )
        text = json.dumps(record.rounded(row))
        write_whole(file, lambda stream: stream.write(text.encode()))
    return json.loads(file.read_text(encoding="utf-8"))


def measured(
    model: nn.Module, data: Prepared, judge: Judge, known: samples.People, sampling: dict,
    seed: int, starts: int, count: int,
) -> dict:  # fmt: skip
    """A pair's samples over people, in all that the rule asks for."""
    found = [
        samples.variety(model, data, judge, seed, sampling, "val", known, at, count)
        for at in QUARTILES
    ]
    spreads = [samples.over_people(one) for one in found]
    beside = evaluate(model, data, "val", starts=starts, seconds=10, seed=seed, **sampling)
    return {
        "sampling": sampling,
        "spread over people's": {
            key: statistics.median(one[key] for one in spreads) for key in spreads[0]
        },
        "sound": {
            gait: statistics.fmean(one[gait]["sound"] for one in found) for gait in samples.GAITS
        },
        "samples over data": {
            key: value.value / beside.data[key].value for key, value in beside.samples.items()
        },
        "frozen or diverged": beside.frozen + beside.diverged,
    }


def cost(row: dict) -> float:
    """How far from people; infinite where there is nothing left to compare."""
    over = row["samples over data"]
    ratios = [over.get("acceleration (m/s²)"), over.get("jerk (m/s³)")]
    ratios += row["spread over people's"].values()
    if not all(ratios):  # a spread of nothing, or of samples that all fell apart
        return math.inf
    a, j, *logs = map(math.log, ratios)
    spread = statistics.fmean(max(-s, EXCESS * s) for s in logs)
    return abs(a) / ACCELERATION + abs(j) / JERK + spread / SPREAD


def left_out(row: dict, white: dict) -> str:
    """Why a row is out, or nothing."""
    skates = lambda some: some["samples over data"].get("foot skate, weighted (cm/s)", math.inf)
    if any(row["sound"][gait] < its - LESS_SOUND for gait, its in white["sound"].items()):
        return "less sound than white noise"
    return "skates" if skates(row) > MORE_SKATE * skates(white) else ""


def choose(rows: list[dict]) -> dict:
    """The row that the rule takes; the first is white noise's."""
    return min((row for row in rows if not left_out(row, rows[0])), key=cost)


if __name__ == "__main__":
    record.run(main)
