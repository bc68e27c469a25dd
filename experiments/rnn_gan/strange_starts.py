"""Which starts are doubted, and does a doubted start foretell that a sample leaves its gait?

    python -m experiments.rnn_gan.strange_starts [--model lstm-gmm-contacts] [--split test]

1. Of seconds of held-out motion, as it is and with a planted fault, the share that lies beyond the
   bounds of `motionlab.models.familiar` (stored with the weights, or else fitted here on validation
   clips). The rule, fixed before: no more than 5 % of sound ones, and 90 % of those with another unit
   or 4 times too fast.
2. From held-out starts of steady motion (`keeping_pace.starts`), three samples of 10 s each: the share
   that is in another gait at 8 to 10 s (`keeping_pace.LEFT`, times the start's speed) or lost. It is
   told for thirds of the starts by likelihood and by distance, with the area under the curve (AUC) of
   each as a sign of a start from which one sample or more leaves. The rule, fixed before: it foretells
   if the lower end of the AUC's interval over starts is above 0.5.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

import motionlab
from motionlab import Motion, metrics
from motionlab.encodings import Encoding
from motionlab.models.familiar import SECONDS, SHARE, Familiar, bounds, measure
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record, rollouts
from .keeping_pace import GAITS, LEFT, SEEDS, pace, starts

LENGTH, JUDGED = 10.0, (8.0, 10.0)  # seconds of a sample, and those in which it is judged
FOUND = 0.9  # share of faults that must be doubted
MUST = ("100 times too large", "100 times too small", "4 times too fast")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm-contacts", help="name, or file of weights")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--output", help="results/MODEL_strange_starts.json if left out")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    familiar = model.familiar or bounds(model, data.clips("val"))
    if familiar is None:
        raise motionlab.MotionLabError(f"{chosen.data}: has too few validation clips for bounds.")
    model.familiar = None  # what is strange is counted here, not warned of
    result = {
        "weights": record.about_weights(model, path),
        "split": chosen.split,
        "bounds": familiar._asdict(),
        "doubted": doubted(model, data.clips(chosen.split), familiar),
    }
    for gait in GAITS:
        begun, speeds, _ = starts(data, gait, chosen.split, chosen.starts)
        result[gait] = foretold(model, begun, speeds, gait, familiar)
    output = chosen.output or (
        f"results/{Path(chosen.model).stem.replace('-', '_')}_strange_starts.json"
    )
    record.write(record.provenance(begin, 0, data) | result, output)


# -- planted faults -------------------------------------------------------------------------------


def doubted(model: nn.Module, clips: Sequence[Tensor], familiar: Familiar) -> dict:
    """Shares of seconds of clips (frames, dim) that are doubted, by fault."""
    rows = {}
    for fault, plant in faults().items():
        spoiled = [planted(model.encoding, clip, plant) for clip in clips]
        second = round(SECONDS * model.fps)
        parts = [part for clip in spoiled for part in clip.split(second) if len(part) == second]
        if parts:
            far, unlikely = beyond(model, torch.stack(parts), familiar)
            shares = {"far": far, "unlikely": unlikely, "either": far | unlikely}
            rows[fault] = {"seconds": len(parts)}
            rows[fault] |= {key: float(its.double().mean()) for key, its in shares.items()}
    missed = [fault for fault in MUST if fault not in rows or rows[fault]["either"] < FOUND]
    sound = "none" in rows and rows["none"]["either"] <= SHARE
    return {"faults": rows, "not found": missed, "as it should be": sound and not missed}


def beyond(model: nn.Module, features: Tensor, familiar: Familiar) -> tuple[Tensor, Tensor]:
    """Which starts (batch, frames, dim) are too far, and which too unlikely."""
    measured = [measure(model, some) for some in features.split(256)]
    likelihood, distance = (torch.cat(parts) for parts in zip(*measured, strict=True))
    return distance > familiar.distance, likelihood < familiar.likelihood


def faults() -> dict[str, Callable[[Motion], Motion]]:
    """What may be wrong with a motion that somebody brings."""
    scaled = lambda unit: (
        lambda motion: replace(motion, root_positions=unit * motion.root_positions)
    )
    rows = lambda step: lambda motion: picked(motion, torch.arange(len(motion))[::step])
    return {
        "none": lambda motion: motion,
        "mirrored": lambda motion: motion.mirror(),
        "100 times too large": scaled(100.0),
        "100 times too small": scaled(0.01),
        "4 times too fast": rows(4),
        "twice too fast": rows(2),
        "4 times too slow": lambda motion: replace(motion.resample(4 * motion.fps), fps=motion.fps),
        "backwards in time": lambda motion: picked(motion, torch.arange(len(motion)).flip(0)),
        "left and right exchanged": exchanged,
        "stands in the file's pose": at_rest,
    }


def planted(encoding: Encoding, clip: Tensor, plant: Callable[[Motion], Motion]) -> Tensor:
    """Features (frames, dim) of a clip with a fault."""
    return encoding.encode(plant(encoding.to_motion(clip)))


def picked(motion: Motion, rows: Tensor) -> Motion:
    """The motion of these frames, at its old rate."""
    contacts = None if motion.contacts is None else motion.contacts[rows]
    return replace(
        motion, root_positions=motion.root_positions[rows], rotations=motion.rotations[rows],
        contacts=contacts,
    )  # fmt: skip


def exchanged(motion: Motion) -> Motion:
    """Left joints turn as right ones did, unmirrored: names that were read the wrong way round."""
    joints = list(motion.skeleton.mirror_partners)
    contacts = None if motion.contacts is None else motion.contacts[:, [2, 3, 0, 1]]
    return replace(motion, rotations=motion.rotations[:, joints], contacts=contacts)


def at_rest(motion: Motion) -> Motion:
    """No joint is turned, and nothing moves."""
    still = torch.eye(3).to(motion.rotations).expand_as(motion.rotations)
    contacts = None if motion.contacts is None else torch.ones_like(motion.contacts)
    places = motion.root_positions[:1].expand_as(motion.root_positions)
    return replace(motion, rotations=still, root_positions=places, contacts=contacts)


# -- what becomes of samples ----------------------------------------------------------------------


@torch.no_grad()
def foretold(
    model: nn.Module, begun: Tensor, speeds: Tensor, gait: str, familiar: Familiar
) -> dict:
    """Samples that leave the gait of their starts (starts, frames, dim), by how strange these are."""
    left = torch.stack([leaving(model, begun, speeds, gait, seed) for seed in SEEDS], 1)
    likelihood, distance = measure(model, begun)
    strange = {"unlikely": -likelihood, "far": distance}
    far, unlikely = beyond(model, begun, familiar)
    doubts = far | unlikely
    mean = lambda rows: float(left[rows].double().mean()) if rows.any() else None
    found = {
        "starts": len(begun),
        "leave": mean(torch.ones_like(doubts)),
        "doubted": int(doubts.sum()),
        "leave of the doubted": mean(doubts),
        "leave of the others": mean(~doubts),
    }
    for name, values in strange.items():
        thirds = values.argsort().tensor_split(3)
        pairs = list(zip(values.tolist(), left.any(1).tolist(), strict=True))
        area = metrics.bootstrap(pairs, auc)
        found[name] = {
            "leave, by thirds": [float(left[some].double().mean()) for some in thirds],
            "auc": area._asdict(),
            "foretells": area.low > 0.5,
        }
    return found


def leaving(model: nn.Module, begun: Tensor, speeds: Tensor, gait: str, seed: int) -> Tensor:
    """Which samples (starts,) are in another gait in the end, or lost."""
    first, last = (round(time * model.fps) for time in JUDGED)
    made = rollouts.sampled(model, begun, round(LENGTH * model.fps), seed, **model.sampling)
    paces = [pace(model, motion) for _, features in made for motion in features]
    low, high = LEFT[gait]
    ratios = torch.stack(paces)[:, first:last].mean(1) / speeds  # NaN of what is lost
    return ~((ratios >= low) & (ratios <= high))


def auc(pairs: Sequence[tuple[float, bool]]) -> float:
    """How often a start that is left is stranger than one that is kept; a half if there is no pair."""
    left = torch.tensor([value for value, leaves in pairs if leaves])
    kept = torch.tensor([value for value, leaves in pairs if not leaves])
    if not len(left) or not len(kept):
        return 0.5
    more = left[:, None] - kept
    return float(((more > 0).double() + (more == 0) / 2).mean())


if __name__ == "__main__":
    record.run(main)
