"""Why does a critic tell solved walks from recorded ones? What was tried, on validation clips.

    python -m experiments.rnn_gan.critic_attempts [--only ROW ...]

A critic learns recorded walks from walks of one row that begin in one held-out start, and is asked
about other recorded walks and those of two other starts, all of validation clips. Each row solves the
same curves (W5's shapes without splines, half as long) with one wish changed; all are refined and
locked. Beside them, free samples from the same starts, refined. What is solved is kept in
runs/critic_attempts/.

The rule, fixed before these runs: an attempt helps if its accuracy is not above the upper end of the
interval of refined free samples, with root mean square errors of at most 1 cm and foot skate of at most
3 cm/s in the median, which is what a path was to be followed by.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import torch
from torch import nn

import motionlab
from motionlab.paths import Path as Way
from motionlab.solvers import design
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from .curves import shapes
from .following import GAITS, NAME, Solved, finished, kept, made_with, median, row_of, starts
from .refined_samples import Variant, asked, clips_of

LENGTH = 9.0  # m, of each curve
FREE = "free samples, refined"
OURS = "as it is"
ROWS: dict[str, dict[str, float]] = {
    OURS: {},
    "slow feet left alone": {"resting": 0.0},
    "all feet left alone": {"resting": 0.0, "contact": 0.0},
    "near the line by 2 cm": {"path": (0.7 / 2.0) ** 2},
}  # weights of terms
ERROR, SKATE = 1.0, 3.0  # cm, cm/s


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=list(ROWS), default=list(ROWS))
    parser.add_argument("--runs", type=Path, default=Path("runs/critic_attempts"))
    parser.add_argument("--output", default="results/critic_attempts.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    model, refiner = motionlab.load(NAME), motionlab.load("refiner-contacts")
    data = Prepared.find("locomotion").matching(model.encoding)
    begun, *_ = starts(data, "walk", "val", 3)
    rows = {FREE: {"critic": accuracy(model, data, free(model, refiner, begun))}}
    for name in chosen.only:
        solved = [
            kept(chosen.runs / made_with(model) / f"{name} {seed}.pt",
                 lambda seed=seed, name=name: walked(model, begun[seed], seed, ROWS[name]))
            for seed in range(len(begun))
        ]  # fmt: skip
        rows[name] = told(model, refiner, data, solved) | {"weights": ROWS[name]}
        print(name, rows[name], flush=True)
    result = {
        "weights": [record.about_weights(net, find(of))
                    for net, of in ((model, NAME), (refiner, "refiner-contacts"))],
        "rows": rows,
        "helps": [name for name, row in rows.items() if helps(row, rows[FREE])],
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def ways() -> dict[str, Way]:
    return {name: Way.through(curve) for name, curve in shapes(GAITS["walk"].size, LENGTH).items()}


def walked(model: nn.Module, start: torch.Tensor, seed: int, weights: dict[str, float]) -> Solved:
    with torch.no_grad():
        model.starts = model.observe(start[None], doubt=False)
    model.start_names = ("walk",)
    curves = ways()
    speed = GAITS["walk"].speed
    made = design.design_all(list(curves.values()), speed, 0, model, seed=seed, weights=weights)
    return {name: (motion, {}) for name, (motion, _) in zip(curves, made, strict=True)}


def told(model: nn.Module, refiner: nn.Module, data: Prepared, solved: list[Solved]) -> dict:
    done, curves = [finished(each, refiner) for each in solved], ways()
    rows = [row_of(each[name][0], way) for each in done for name, way in curves.items()]
    motions = [[model.encoding.encode(motion) for motion, _ in each.values()] for each in done]
    return {
        key: median([row[key] for row in rows])
        for key in ("rms (cm)", "foot skate (cm/s)", "acceleration (m/s²)", "jerk (m/s³)")
    } | {"critic": accuracy(model, data, motions)}


@torch.no_grad()
def free(model: nn.Module, refiner: nn.Module, begun: torch.Tensor) -> list[list[torch.Tensor]]:
    """As many free samples from each start, as long as the curves take."""
    frames, count = round(LENGTH / GAITS["walk"].speed * model.fps), len(ways())
    found = []
    for seed, start in enumerate(begun):
        state = model.observe(start.expand(count, -1, -1), doubt=False)
        generator = torch.Generator().manual_seed(seed)
        found.append(
            list(refiner(model.generate(frames, state, generator=generator, **model.sampling)))
        )
    return found


def accuracy(model: nn.Module, data: Prepared, motions: list[list[torch.Tensor]]) -> dict:
    """Of critics that have seen the first start's motions and every other recorded walk."""
    clips = clips_of(data, "walk", "val")
    seen, others = motions[0], [motion for each in motions[1:] for motion in each]
    halves = {"val": clips[::2], "test": clips[1::2]}
    return asked(Variant(model.encoding, halves, [others], [seen]))._asdict()


def helps(row: dict, free_samples: dict) -> bool:
    if "rms (cm)" not in row:
        return False
    good = row["rms (cm)"] <= ERROR and row["foot skate (cm/s)"] <= SKATE
    return good and row["critic"]["value"] <= free_samples["critic"]["high"]


if __name__ == "__main__":
    record.run(main)
