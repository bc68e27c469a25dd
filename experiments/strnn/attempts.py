"""What moves the shipped STRNN's bones, survival and loops: short trainings from its weights.

    python -m experiments.strnn.attempts WEIGHTS [--data runs/everything.npz] [--updates 250]
        [--starts 40] [--frames 2400] [--output results/strnn_attempts.json]

Each attempt goes on from the weights by as many updates, all of the network at once, and is judged on
validation clips: no claim hangs on it. Nothing is kept but the numbers.
"""

from __future__ import annotations

import argparse
import copy
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

import motionlab
from motionlab.models import Strnn
from motionlab.training import Prepared
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

from ..claims.strnn import short_loops
from ..common import record
from . import extrapolation

BATCH, RATE = 32, 3e-4  # windows; Adam's, falling to nothing


@dataclass(frozen=True)
class Attempt:
    """What a training is like that goes on from the weights."""

    what: str
    noise: float = 0.007  # on what is read, in deviations, as the shipped training ended
    bones: float = 0.1  # what squared errors of bone lengths cost, by cm², as there
    own: bool = False  # in every second window the network reads frames that it has said itself


ATTEMPTS = {
    "more updates": Attempt("nothing is changed"),
    "no price on bones": Attempt("bones may have any length", bones=0.0),
    "more noise": Attempt("ten times the noise on what is read", noise=0.07),
    "own frames": Attempt("every second window is read as the network said it", own=True),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--data", default="runs/everything.npz")
    parser.add_argument("--updates", type=int, default=250)
    parser.add_argument("--starts", type=int, default=40)
    parser.add_argument("--frames", type=int, default=2400)
    parser.add_argument("--output", default="results/strnn_attempts.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    shipped = motionlab.load(chosen.weights)
    data = in_body_frame(Prepared.find(chosen.data)).matching(shipped.encoding)
    size = chosen.starts, chosen.frames
    rows = {"as it ships": {"what": "no training", **judged(shipped, data, *size)}}
    for name, attempt in ATTEMPTS.items():
        model = copy.deepcopy(shipped)
        taught(model, attempt, data, chosen.updates)
        rows[name] = {"what": attempt.what, **judged(model, data, *size)}
        print(name, rows[name], flush=True)
    result = {
        "split": "val", "starts": chosen.starts, "frames": chosen.frames,
        "updates": chosen.updates, "rows": rows,
        "weights": record.about_weights(shipped, chosen.weights),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def taught(model: Strnn, attempt: Attempt, data: Prepared, updates: int) -> None:
    """Let a network learn; `Windows` of one more prediction, so that it may read its own frames."""
    windows = Windows(data.clips("train"), model.frames + model.predict)
    optimizer = torch.optim.Adam(model.parameters(), RATE)
    model.train().requires_grad_(True)  # what is loaded to be used does not learn
    for update in range(updates):
        chance = torch.Generator().manual_seed(update)
        optimizer.param_groups[0]["lr"] = RATE * (1 - update / updates)
        cost(model, attempt, windows.draw(BATCH, chance), chance).backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 5.0)
        optimizer.step()
        optimizer.zero_grad()
    model.eval()


def cost(model: Strnn, attempt: Attempt, windows: Tensor, chance: torch.Generator) -> Tensor:
    """The loss of windows (batch, encode + 2 predict, dim), with what an attempt adds to it."""
    first = model.normalizer(windows)
    true = first[:, model.predict :].clone()
    noise = attempt.noise * torch.randn(true[:, : model.encode].shape, generator=chance)
    read = true[:, : model.encode] + noise
    if attempt.own:
        with torch.no_grad():
            said = model._whole(first[::2, : model.encode])[:, -model.predict :]
        read[::2, -model.predict :] = said
    said = model._whole(read)
    bends = said[..., model.glides].diff(n=2, dim=1)
    error = model._error(said, true) + model.smooth * bends.square().mean()
    if attempt.bones:
        off = 100 * model.encoding.bones_off(model.normalizer.inverse(said))
        error = error + attempt.bones * off.square().mean()
    return error


@torch.no_grad()
def judged(model: Strnn, data: Prepared, starts: int, frames: int) -> dict:
    """What becomes of open loops from validation clips, and how well windows are said."""
    clips, real = data.clips("val"), extrapolation.real_of(data)
    seeds = extrapolation.prefixes(clips, extrapolation._sources(clips, data), starts, 20)
    found = extrapolation.opened(model.extrapolate(seeds, frames), data, real, model.predict)
    ahead = extrapolation.forecasts(model.extrapolate, clips, data, model.encode)
    row = {
        "alive": found["alive"], "failed": found["failed"],
        "said again": extrapolation.decoded(model, clips, data),
        "foretold": ahead["20 frames"],
    }  # fmt: skip
    if "periods (s)" in found:
        named = ("bones, mean (cm)", "foot skate (cm/s)", "movement, last minute, over real",
                 "steps across seams", "in loops, of those alive")  # fmt: skip
        row |= {name: found[name] for name in named if name in found}
        row["in a loop of under 10 s, of those alive"] = short_loops(found)
    return row


if __name__ == "__main__":
    record.run(main)
