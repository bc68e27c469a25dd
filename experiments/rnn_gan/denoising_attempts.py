"""What was tried for the lines of W7 that are missed: a gap of half a second, runs, and feet that slide.

    python -m experiments.rnn_gan.denoising_attempts [--clips 3]

Validation clips that walk and run, each noise as in `denoising`, and what the network always says there,
without a step back, so that the attempts alone are compared.

The rule, fixed before these runs: an attempt is taken in if its own number, summed over walks and runs,
falls by a twentieth or more, and no error of either gait and any noise rises by more than a fiftieth.
Of two for the same number the better one. Else all stays as it was.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import nn

import motionlab
from motionlab.solvers.denoise import clean_jobs, see
from motionlab.solvers.denoise_seen import cross_validated, motion_of, smooth
from motionlab.solvers.denoise_windows import Job, Settings
from motionlab.training import Prepared

from ..common import record
from .denoising import ERROR, HIT, NAME
from .noises import KINDS, Case, cases, measure, pieces

NOISES = ("white, mid", "white, high", "gap")
SKATE = "foot skate (cm/s)"
BEFORE = "as it was"
FALLS, RISES = 0.95, 1.02


class Attempt(NamedTuple):
    """What is tried, for which number: of which gaits and noises, and which measure; None: the start."""

    settings: Settings
    number: tuple[tuple[str, ...], tuple[str, ...], str] | None
    free: bool = False


GAITS = KINDS[:2]
GAP = (GAITS, ("gap",), HIT)
RUNS = (("running",), ("white, mid", "white, high"), ERROR)
FEET = (GAITS, ("white, mid", "white, high"), SKATE)
ATTEMPTS = {
    BEFORE: Attempt(Settings(), None),
    "gap: six rounds": Attempt(Settings(rounds=6), GAP),
    "gap: sixty steps a round": Attempt(Settings(steps=60), GAP),
    "gap: a full prior": Attempt(Settings(prior=1.0), GAP),
    "runs: begun as free as the clip asks for": Attempt(Settings(), RUNS, free=True),
    "runs: changes less spread": Attempt(Settings(spread=1.0), RUNS),
    "runs: half the prior": Attempt(Settings(prior=0.2), RUNS),
    "feet: faster ones rest, too": Attempt(Settings(slow=1.0), FEET),
    "feet: held three times as hard": Attempt(Settings(contact=3.0), FEET),
    "feet: both, with a full prior": Attempt(Settings(slow=1.0, contact=3.0, prior=1.0), FEET),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="everything")
    parser.add_argument("--clips", type=int, default=3)
    parser.add_argument("--output", default="results/denoising_attempts.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model = motionlab.load(NAME).requires_grad_(False)
    data = Prepared.find(chosen.data).matching(model.encoding)
    seen = {
        kind: {
            noise: cases(pieces(data, kind, "val", chosen.clips), kind, noise, "val")
            for noise in NOISES
        }
        for kind in GAITS
    }
    rows = {}
    for name, attempt in ATTEMPTS.items():
        rows[name] = {
            kind: {noise: cleaned(model, its, attempt) for noise, its in noises.items()}
            for kind, noises in seen.items()
        }
        print(f"{name}: {judged(attempt, rows[name], rows[BEFORE])}", flush=True)
    found = {
        name: judged(ATTEMPTS[name], its, rows[BEFORE]) | {"numbers": its}
        for name, its in rows.items()
    }
    result = {"clips": chosen.clips, "split": "val", "attempts": record.rounded(found)}
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


@torch.no_grad()
def cleaned(model: nn.Module, judged: list[Case], attempt: Attempt) -> dict[str, float]:
    """Means over clips of what the network always says."""
    encoding = model.encoding
    jobs = []
    for case in judged:
        seen, levels = see(encoding, case.seen, None, case.missing)
        line = (cross_validated if attempt.free else smooth)(seen, levels, encoding.fps)
        jobs.append(Job(seen, levels, line, line))
    done = clean_jobs(model, jobs, attempt.settings, always=True)
    each = [
        measure(motion_of(encoding, its.cleaned.rows), case)
        for its, case in zip(done, judged, strict=True)
    ]
    return {key: sum(its[key] for its in each) / len(each) for key in each[0]}


def judged(attempt: Attempt, rows: dict, before: dict) -> dict:
    """Its own number over that before, the largest rise of an error, and whether it is taken in."""
    if attempt.number is None:
        return {}
    kinds, noises, measure = attempt.number
    total = lambda its: sum(its[kind][noise][measure] for kind in kinds for noise in noises)
    own = total(rows) / total(before)
    worst = max(
        rows[kind][noise][ERROR] / before[kind][noise][ERROR]
        for kind in rows
        for noise in rows[kind]
    )
    return {
        "of the number before": own, "largest rise of an error": worst,
        "helps": own <= FALLS and worst <= RISES,
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
