"""Where does the network not know a motion? The line of `solvers.denoise_known`, fitted.

    python -m experiments.rnn_gan.denoising_known [--clips 5]

Validation clips alone: pieces on the network's own body, and recordings on the rigs that they were made
on, so that the error of bringing them over and back is in it. Each gets noise, and is cleaned twice: as
the network always says, and as a smooth line. Two numbers are sought, of ``at one + slope · ln(angle)``
nats a frame, so that taking the network's answer above that line and the smooth one below it is best:
the sum over clips of the logarithms of the error over the smooth line's, a rise counting twice, as
harm is worse than a gain forgone. There is one line for the own body and one for other rigs, whose motion
is a little strange to the network on its own body. Of lines as good as the best the one in their middle.
"""

from __future__ import annotations

import argparse
import math
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import NamedTuple

import torch
from torch import Generator, nn

import motionlab
from motionlab import Motion, corrupt, datasets
from motionlab.datasets import registry
from motionlab.datasets.loader import stance
from motionlab.solvers import clean_recording
from motionlab.solvers.denoise import clean_jobs, job_of, see
from motionlab.solvers.denoise_rig import noise_left
from motionlab.solvers.denoise_seen import LEAST_ANGLE, motion_of
from motionlab.solvers.denoise_windows import Settings
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from ..common.rollouts import spread_evenly
from .denoising import NAME
from .noises import HIGH, KINDS, LOW, MID, is_kind, pieces

LEVELS = {"low": LOW, "mid": MID, "high": HIGH}
ON_RIGS = ("low", "mid")
PER_RIG, SECONDS = 2, 3.0  # recordings of a kind, and how much of each
ALWAYS, NEVER = Settings(least=-math.inf), Settings(least=math.inf, rounds=1, steps=1)
SLOPES = [0.5 * i for i in range(41)]
HARM = 2.0
BY_HAND = (61.2, 7.2)  # the line that was drawn by hand before


class Case(NamedTuple):
    """One clip with noise: what the network always says, and what a smooth line, cm from the truth.

    where : "own body", or whose rig it is. angle : radians of noise at the network's rate, as the clip told it.
    """

    where: str
    kind: str
    noise: str
    angle: float
    likelihood: float
    network: float
    line: float

    @property
    def ratio(self) -> float:
        return self.network / self.line


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="everything")
    parser.add_argument("--clips", type=int, default=5, help="of each kind, on the own body")
    parser.add_argument("--output", default="results/denoising_known.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model = motionlab.load(NAME).requires_grad_(False)
    data = Prepared.find(chosen.data).matching(model.encoding)
    found = []
    for case in chain(own_body(model, data, chosen.clips), on_rigs(model)):
        found.append(case)
        print(*(f"{x:.3g}" if isinstance(x, float) else x for x in case), flush=True)
    own_cases, rigs_cases = split(found)
    line, rigs = fitted(own_cases), fitted(rigs_cases)
    named = lambda its: dict(zip(("at one", "slope"), its, strict=True))
    result = {
        "weights": record.about_weights(model, find(NAME)), "split": "val",
        **named(line), "other rigs": named(rigs),
        "told": told(own_cases, line) | told(rigs_cases, rigs),
        "by hand before": dict(zip(("at one", "slope"), BY_HAND, strict=True))
        | {"told": told(found, BY_HAND)},
        "cases": [case._asdict() for case in found],
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | record.rounded(result), chosen.output)


def split(found: Iterable[Case]) -> tuple[list[Case], list[Case]]:
    """Cases on the own body, and on other rigs."""
    own = [case for case in found if case.where == "own body"]
    return own, [case for case in found if case.where != "own body"]


@torch.no_grad()
def own_body(model: nn.Module, data: Prepared, count: int) -> Iterator[Case]:
    """Pieces of each kind, on the network's body."""
    encoding = model.encoding
    for kind in KINDS:
        truths = pieces(data, kind, "val", count)
        for noise in LEVELS:
            seen = [trembling(truth, noise) for truth in truths]
            jobs = [job_of(encoding, *see(encoding, its, None, None)) for its in seen]
            for its, job, truth in zip(
                clean_jobs(model, jobs, ALWAYS, always=True), jobs, truths, strict=True
            ):
                yield Case(
                    "own body", kind, noise, job.noise.angle_rad, its.likelihood,
                    off(motion_of(encoding, its.rows), truth),
                    off(motion_of(encoding, job.line), truth),
                )  # fmt: skip


def on_rigs(model: nn.Module, seconds: float = SECONDS) -> Iterator[Case]:
    """Two recordings of each kind and source, on their own rig."""
    for source, kind, truth in recordings(seconds):
        for noise in ON_RIGS:
            seen = trembling(truth, noise)
            way = lambda how, seen=seen, source=source: clean_recording(
                seen, model, reference=stance(source), settings=how
            )
            network, line = way(ALWAYS), way(NEVER)
            left = noise_left(truth.fps / model.encoding.fps)
            yield Case(
                source, kind, noise, left * network.record["noise"]["angle_rad"],
                network.record["likelihood"], off(network.motion, truth), off(line.motion, truth),
            )  # fmt: skip


def recordings(seconds: float) -> Iterator[tuple[str, str, Motion]]:
    """Source, kind, and the middle of a validation recording as it was made."""
    for source in sorted(registry.sources()):
        for kind in KINDS:
            clips = [
                clip
                for clip in registry.members("everything")
                if clip.source == source and clip.split == "val" and is_kind(clip, kind)
            ]
            some = [clips[i].name for i in spread_evenly(len(clips), PER_RIG)]
            for motion in datasets.load(source, clips=some, download=False) if some else ():
                frames = min(len(motion), round(seconds * motion.fps))
                first = (len(motion) - frames) // 2
                yield source, kind, motion[first : first + frames]


def trembling(truth: Motion, noise: str) -> Motion:
    """With white noise of its own, the same in every run."""
    chance = Generator().manual_seed(zlib.crc32(f"known, {noise}, {truth.name}".encode()))
    return corrupt.tremble(truth, *LEVELS[noise], generator=chance)


def off(found: Motion, truth: Motion) -> float:
    """Mean distance of joints, in cm."""
    return 100 * float((found.positions() - truth.positions()).norm(dim=-1).mean())


# -- the line -------------------------------------------------------------------------------------


def fitted(found: Sequence[Case]) -> tuple[float, float]:
    """The line, at one radian and its slope, that costs least."""
    best: list[tuple[float, float, float]] = []
    for slope in SLOPES:
        heights = sorted(case.likelihood - slope * _log(case) for case in found)
        for low, high in zip(
            [heights[0] - 10, *heights], [*heights, heights[-1] + 10], strict=True
        ):
            line = ((low + high) / 2, slope)
            best.append((round(cost(found, line), 9), *line))
    least = min(best)[0]
    equal = [line for its, *line in best if its == least]
    slope = sorted(slope for _, slope in equal)[len(equal) // 2]
    heights = [height for height, its in equal if its == slope]
    return sum(heights) / len(heights), slope


def cost(found: Iterable[Case], line: tuple[float, float]) -> float:
    """Sum of logarithms of the errors over the smooth line's, a rise counting HARM times."""
    logs = [math.log(case.ratio) for case in found if known(case, line)]
    return sum(its * (HARM if its > 0 else 1) for its in logs)


def known(case: Case, line: tuple[float, float]) -> bool:
    return case.likelihood >= line[0] + line[1] * _log(case)


def _log(case: Case) -> float:
    return math.log(max(case.angle, LEAST_ANGLE))


def told(found: Sequence[Case], line: tuple[float, float]) -> dict[str, dict]:
    """By where and kind: how many are cleaned by the network, and the mean error over the line's."""
    groups: dict[str, list[Case]] = {}
    for case in found:
        where = "own body" if case.where == "own body" else "other rigs"
        groups.setdefault(f"{where}, {case.kind}", []).append(case)
    mean = lambda values: math.exp(sum(map(math.log, values)) / len(values))
    return {
        name: {
            "clips": len(its),
            "cleaned by the network": sum(known(case, line) for case in its),
            "error over the line's": mean([c.ratio if known(c, line) else 1.0 for c in its]),
            "always": mean([case.ratio for case in its]),
            "worst": max([case.ratio for case in its if known(case, line)], default=1.0),
        }
        for name, its in groups.items()
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
