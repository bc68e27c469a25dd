"""W3, W4: samples of both generators, raw, refined, and with locked feet, beside real motion.

    python -m experiments.rnn_gan.refined_samples [--seeds 0 1 2] [--samples 200] [--runs runs]

Needs the refiners of `motionlab train refiner --preset ship --seed N --out runs/refiner-ship-N`, and
of refiner-contacts alike. What is measured and how it is judged stands in claims.yaml.

    RNN     lstm-gmm                        RNN+c      lstm-gmm-contacts
    GAN1    the same, refined               GAN2       the same, refined
                                            GAN2+lock  with feet locked by GAN2's own labels
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

import motionlab
from motionlab import contacts, metrics
from motionlab.encodings import JointAngles
from motionlab.metrics import Interval
from motionlab.solvers import lock_feet
from motionlab.training import Prepared
from motionlab.training.evaluation import measured
from motionlab.training.finish import OBSERVED
from motionlab.training.judging import critic
from motionlab.weights import find

from ..common import record
from ..common.recorded import recorded_clips
from .samples import GAITS

SECONDS = 10.0
TOES = (1, 3)
CHECKED = 2  # samples a validation clip that critics learn from
GENERATORS = {("RNN", "GAN1"): "lstm-gmm", ("RNN+c", "GAN2"): "lstm-gmm-contacts"}
DIVERSE = ("speed (m/s)", "turn rate (rad/s)", "step length (m)")


class Variant(NamedTuple):
    """What becomes of a generator's samples: features (samples, frames, dim), one a refiner."""

    encoding: JointAngles
    clips: dict[str, list[Tensor]]  # recorded ones, of the splits test and val
    test: list[Tensor]
    val: list[Tensor]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--seed", type=int, default=0, help="of the samples")
    parser.add_argument("--output", default="results/refined_samples.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    data, models, weights = Prepared.find(chosen.data), {}, {}
    for (raw, refined), name in GENERATORS.items():
        kind = name.replace("lstm-gmm", "refiner")
        paths = [chosen.runs / f"{kind}-ship-{seed}" / "best.safetensors" for seed in chosen.seeds]
        generator, refiners = motionlab.load(name), list(map(motionlab.load, paths))
        models[raw, refined] = generator, refiners
        weights[raw] = record.about_weights(generator, find(name))
        weights[refined] = [
            record.about_weights(refiner, path) | {"step": refiner.about["step"]}
            for refiner, path in zip(refiners, paths, strict=True)
        ]
    gaits = {}
    for gait in GAITS:
        gaits[gait] = of_gait(gait, models, data, chosen.samples, chosen.seed)
        print(f"{gait}: {time.perf_counter() - begin:.0f} s", flush=True)
    result = {"weights": weights, "samples": chosen.samples, "seconds each": SECONDS,
              "gaits": gaits}  # fmt: skip
    record.write(record.provenance(begin, chosen.seed, data) | result, chosen.output)


@torch.no_grad()
def of_gait(gait: str, models: dict, data: Prepared, count: int, seed: int) -> dict:
    """All variants of one gait, beside recorded motion."""
    variants: dict[str, Variant] = {}
    for (raw, refined), (generator, refiners) in models.items():
        own = data.matching(generator.encoding)
        clips = {split: clips_of(own, gait, split) for split in ("test", "val")}
        numbers = {"test": count, "val": CHECKED * len(clips["val"])}
        made = {split: samples(generator, clips[split], numbers[split], seed) for split in clips}
        variants[raw] = Variant(generator.encoding, clips, [made["test"]], [made["val"]])
        after = ([refiner(made[split]) for refiner in refiners] for split in ("test", "val"))
        variants[refined] = Variant(generator.encoding, clips, *after)
    rnn = variants["RNN"]
    real = [about_motion(rnn.encoding, clip) for clip in rnn.clips["test"]]
    rows = {name: rows_of(its.encoding, its.test) for name, its in variants.items()}
    rows["GAN2+lock"] = [locked_rows(variants["GAN2"].encoding, variants["GAN2"].test[0])]
    by_start = {name: grouped(its, len(real)) for name, its in rows.items()}
    told = {}
    for name in rows:
        raw = "RNN" if name in ("RNN", "GAN1") else "RNN+c"
        told[name] = summary(by_start[name], by_start["RNN"], by_start[raw], real)
        if name in variants:
            told[name] |= about_variant(variants[name], variants[raw])
    columns = lambda key: zip(
        totals(by_start["GAN2"], key), totals(by_start["GAN1"], key), totals(real, key), strict=True
    )
    return {
        "clips": len(real),
        "real": {key: metrics.bootstrap(column(real, key)) for key in real[0]},
        "variants": told,
        "GAN2's distance from real minus GAN1's": {
            key: metrics.bootstrap(list(columns(key)), gap)
            for key in ("foot skate (cm/s)", "jerk (m/s³)")
        },
    }


def about_variant(variant: Variant, raw: Variant) -> dict:
    """What is told of all samples of a variant together."""
    encoding = variant.encoding
    found = {
        "critic": asked(variant),
        "frechet": frechet(encoding, variant.clips["test"], variant.test),
    }
    if variant is not raw:
        found |= moved(encoding, raw.test[0], variant.test)
    if "contacts" in encoding.slices:
        found["labels"] = labels(encoding, variant.test)
    return found


def clips_of(data: Prepared, gait: str, split: str) -> list[Tensor]:
    """Features of the split's recorded clips of a gait, two seconds and longer."""
    seen, (actions, _) = round(OBSERVED * data.encoding.fps), GAITS[gait]
    return [
        clip
        for entry, its_split, clip in recorded_clips(data)
        if its_split == split and len(clip) >= seen and entry.action.startswith(actions)
    ]


def samples(generator: nn.Module, clips: Sequence[Tensor], count: int, seed: int) -> Tensor:
    """Motions (count, frames, dim) that go on from clips by turns; what explodes is drawn again."""
    seen, frames = round(OBSERVED * generator.fps), round(SECONDS * generator.fps)
    begun = torch.stack([clips[i % len(clips)][:seen] for i in range(count)])
    made = torch.full((count, frames, generator.encoding.dim), torch.nan)
    for attempt in range(10):
        left = ~made.isfinite().all(-1).all(-1)
        if not left.any():
            break
        chance = torch.Generator().manual_seed(1_000 * seed + attempt)
        state = generator.observe(begun[left])
        made[left] = generator.generate(frames, state, generator=chance, **generator.sampling)
    return made


# -- what one motion is like ------------------------------------------------------------------------


def about_motion(encoding, features: Tensor) -> dict[str, float]:
    """Of features (frames, dim): what `measured` says, feet in the floor, step length, knees."""
    return about_points(encoding.positions(features), encoding.skeleton, encoding.fps)


def about_points(points: Tensor, skeleton, fps: float) -> dict[str, float]:
    down = contacts.label_positions(points, skeleton, fps)
    bends = torch.stack([bend(points, skeleton, side) for side in ("left", "right")])
    return measured(points, skeleton, fps) | {
        "turn rate (rad/s)": float(metrics.turn_rate(points, skeleton, fps).mean()),
        "step length (m)": float(metrics.step_length(points, down, skeleton, fps)),
        "in the floor (cm)": float(metrics.penetration(points, skeleton).mean()),
        "straightest knee (°)": float(bends.min()),
        "knees' speed (°/s)": float(bends.diff(dim=-1).abs().mean() * fps),
        "stance (s)": stance(down[:, TOES], fps),
    }


def bend(points: Tensor, skeleton, side: str) -> Tensor:
    """Degrees (frames,) by which a knee is bent; 0 is a straight leg."""
    hip, knee, ankle = (
        points[:, skeleton.roles[f"{side}_{part}"]] for part in ("upper_leg", "lower_leg", "foot")
    )
    cosine = torch.cosine_similarity(knee - hip, ankle - knee, dim=-1)
    return torch.rad2deg(cosine.clamp(-1, 1).arccos())


def stance(down: Tensor, fps: float) -> float:
    """Mean seconds that labels (frames, toes) stay on; NaN if they never are."""
    begins = (down[1:] & ~down[:-1]).sum() + down[0].sum()
    return float(down.sum() / begins / fps) if begins else float("nan")


def rows_of(encoding, motions: Sequence[Tensor]) -> list[list[dict]]:
    return [[about_motion(encoding, motion) for motion in some] for some in motions]


def locked_rows(encoding, features: Tensor) -> list[dict]:
    """The same of motions whose feet are locked by their own labels."""
    found = []
    for motion in features:
        decoded = encoding.to_motion(motion)
        locked = lock_feet(decoded, decoded.contacts, floor=None)
        found.append(about_points(locked.positions(), encoding.skeleton, encoding.fps))
    return found


def column(rows: Sequence[dict], key: str) -> list[float]:
    return [row[key] for row in rows]


# -- all of them beside real motion -----------------------------------------------------------------


Start = dict[str, list[float]]  # what is measured of all samples of a start, of all refiners
Pair = tuple[float, int]  # sum and number of values


def grouped(rows: list[list[dict]], starts: int) -> list[Start]:
    """Rows of each refiner's samples, put together by the clip that they began in."""
    return [
        {key: [row[key] for some in rows for row in some[start::starts]] for key in rows[0][0]}
        for start in range(starts)
    ]


def summary(ours: list[Start], rnn: list[Start], raw: list[Start], real: list[dict]) -> dict:
    """Means, distances from real over RNN's, spread over the unrefined samples'.

    Intervals are over starts.
    """
    found: dict = {"mean": {}, "distance from real over RNN's": {}, "spread over unrefined": {}}
    for key in real[0]:
        columns = [totals(starts, key) for starts in (ours, rnn, real)]
        found["mean"][key] = metrics.bootstrap(columns[0], mean)
        found["distance from real over RNN's"][key] = metrics.bootstrap(
            list(zip(*columns, strict=True)), nearer
        )
        if key in DIVERSE:
            found["spread over unrefined"][key] = spread(ours, key) / spread(raw, key)
    return found


def totals(starts: Sequence[Start | dict], key: str) -> list[Pair]:
    """Of each start, NaN left out: feet that never rest have no skate."""
    columns = [np.ravel(start[key]) for start in starts]
    return [(float(np.nansum(some)), int(np.isfinite(some).sum())) for some in columns]


def mean(pairs: Sequence[Pair]) -> float:
    """Of all samples of some starts."""
    count = sum(n for _, n in pairs)
    return sum(total for total, _ in pairs) / count if count else float("nan")


def nearer(entries: Sequence[tuple[Pair, Pair, Pair]]) -> float:
    """How far the mean is from the real one, over how far RNN's is."""
    ours, rnn, real = (mean(pairs) for pairs in zip(*entries, strict=True))
    return abs(ours - real) / max(abs(rnn - real), 1e-9)


def gap(entries: Sequence[tuple[Pair, Pair, Pair]]) -> float:
    """How much farther from the real mean the first is than the second."""
    first, second, real = (mean(pairs) for pairs in zip(*entries, strict=True))
    return abs(first - real) - abs(second - real)


def spread(starts: Sequence[Start], key: str) -> float:
    """From the 10 % to the 90 % quantile of all samples."""
    low, high = np.nanquantile(np.concatenate([start[key] for start in starts]), [0.1, 0.9])
    return float(high - low)


def asked(variant: Variant) -> Interval:
    """Accuracy of critics that learn from validation clips and are asked about test clips.

    One for each refiner, or three of different seeds of what is not refined.
    """
    motions = list(zip(variant.val, variant.test, strict=True))
    motions = motions if len(motions) > 1 else motions * 3
    clips = variant.clips
    told = [
        critic(variant.encoding, (clips["val"], list(val)), (clips["test"], list(test)), seed)
        for seed, (val, test) in enumerate(motions)
    ]
    real, made = (
        metrics.bootstrap(torch.stack(shares).mean(0).numpy()) for shares in zip(*told, strict=True)
    )
    reach = [
        sum((getattr(end, side) - end.value) ** 2 for end in (real, made)) ** 0.5 / 2
        for side in ("low", "high")
    ]
    value = (real.value + made.value) / 2
    return Interval(value, value - reach[0], value + reach[1], real.clips + made.clips)


def frechet(encoding, clips: Sequence[Tensor], motions: Sequence[Tensor]) -> list[float]:
    """Fréchet distance to the test clips, one a refiner."""
    skeleton, fps = encoding.skeleton, encoding.fps
    reference = metrics.Frechet.fit([encoding.positions(clip) for clip in clips], skeleton, fps)
    return [
        reference.distance([reference.moments(encoding.positions(motion), fps) for motion in some])
        for some in motions
    ]


def moved(encoding, raw: Tensor, refined: Sequence[Tensor]) -> dict:
    """How far roots end from where they would have (cm), each refiner's quantiles."""
    there = encoding.root_path(raw)[:, -1]
    away = [100 * (encoding.root_path(some)[:, -1] - there).norm(dim=-1) for some in refined]
    return {"root moved (cm)": [
        {name: float(some.quantile(q)) for name, q in (("50%", 0.5), ("90%", 0.9))} for some in away
    ]}  # fmt: skip


def labels(encoding, motions: Sequence[Tensor]) -> dict[str, float]:
    """The network's own labels against contacts by speed in the motion itself."""
    said = torch.stack([encoding.contacts(some) for some in motions]).flatten(0, 1) > 0.5
    true = torch.stack([
        contacts.label_positions(encoding.positions(motion), encoding.skeleton, encoding.fps)
        for some in motions for motion in some
    ])[..., TOES]  # fmt: skip
    both = (said & true).sum()
    return {
        "precision": float(both / said.sum()),
        "recall": float(both / true.sum()),
        "F1": float(2 * both / (said.sum() + true.sum())),
        "stance by labels (s)": float(np.nanmean([stance(one, encoding.fps) for one in said])),
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
