"""Does a walk keep its pace, and a run?

    python -m experiments.rnn_gan.keeping_pace [--model lstm-gmm-contacts] [--split test]

A sample goes on from a second of steady motion; its speed over that second's is told for spans of
the minute after it, mean over samples and three seeds. Starts are seconds in which people keep
their pace, and after which the clip, as long as it goes on, keeps it too: who goes on from a start
of braking is right to brake. The rule, fixed before the weights were trained that it judges: walks
within 5 %, runs within 10 %, at 8 to 10 and at 30 to 60 seconds.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import torch
from torch import Tensor, nn

import motionlab
from motionlab import metrics
from motionlab.errors import DataError
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record, rollouts

GAITS = {"walk": (0.5, 2.0), "run": (2.0, 9.0)}  # m/s
OBSERVED, STEP = 1.0, 1 / 3  # seconds that the network sees, and from one candidate to the next
STEADY = 0.1  # share by which the speed may change within that second and after it
AFTER = 0.5  # seconds that the clip must go on for
SPANS = ((0, 1), (1, 3), (4, 6), (8, 10), (30, 60))  # seconds
SEEDS = (0, 1, 2)
LEFT = {"walk": (0.5, 2.0), "run": (0.6, 2.0)}  # of the start's speed: outside, it is another gait
REACH = {"walk": 0.05, "run": 0.10}
JUDGED = ((8, 10), (30, 60))


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm-contacts", help="name, or file of weights")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--output", help="results/MODEL_pace.json if left out")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    result = {"weights": record.about_weights(model, path), "split": chosen.split}
    for gait in GAITS:
        try:
            begun, speeds, clips = starts(data, gait, chosen.split, chosen.starts)
        except DataError as error:
            result[gait] = {"not measured": str(error)}
            continue
        result[gait] = told(model, begun, speeds, gait, model.sampling)
        result[gait]["clips"] = {
            name: its._asdict() for name, its in people(clips, speeds, round(model.fps)).items()
        }
    output = chosen.output or f"results/{Path(chosen.model).stem.replace('-', '_')}_pace.json"
    record.write(record.provenance(begin, 0, data) | result, output)


def starts(
    data: Prepared, gait: str, split: str, count: int
) -> tuple[Tensor, Tensor, list[Tensor]]:
    """Seconds of steady motion (starts, frames, dim), evenly of all there are, their speeds, and how
    fast (frames,) each clip goes on, as long as it does."""
    fps, (least, most) = data.encoding.fps, GAITS[gait]
    seen, rest, third = round(OBSERVED * fps), round(AFTER * fps), round(OBSERVED * fps / 3)
    found = []
    for clip in data.clips(split):
        over_ground = metrics.speed(data.encoding.positions(clip), fps)
        for frame in range(0, len(clip) - seen - rest + 1, round(STEP * fps)):
            second, after = over_ground[frame : frame + seen], over_ground[frame + seen :]
            mean = float(second.mean())
            held = [part.mean() / mean for part in (second[:third], second[-third:], after)]
            if least <= mean < most and all(abs(h - 1) <= STEADY for h in held):
                found.append((clip[frame : frame + seen], mean, after))
    if not found:
        raise DataError(f"{split}: no clip of these data keeps the pace of a {gait} for as long.")
    chosen = [found[i] for i in rollouts.spread_evenly(len(found), count)]
    begun, speeds, clips = zip(*chosen, strict=True)
    return torch.stack(begun), torch.tensor(speeds), list(clips)


def people(clips: list[Tensor], speeds: Tensor, fps: int) -> dict[str, metrics.Interval]:
    """Speed over the start's of the clips themselves, of those that last as long."""
    found = {}
    for first, last in SPANS:
        lasting = [
            float(clip[first * fps : last * fps].mean() / speed)
            for clip, speed in zip(clips, speeds, strict=True)
            if len(clip) >= last * fps
        ]
        if lasting:
            found[f"{first}-{last} s"] = metrics.bootstrap(
                lasting, lambda some: sum(some) / len(some)
            )
    return found


@torch.no_grad()
def told(model: nn.Module, begun: Tensor, speeds: Tensor, gait: str, sampling: dict) -> dict:
    """What becomes of the pace of some starts (starts, frames, dim)."""
    fps, ratios = model.fps, []
    for seed in SEEDS:
        for _, features in rollouts.sampled(
            model, begun, round(SPANS[-1][1] * fps), seed, **sampling
        ):
            ratios += [pace(model, motion) for motion in features]
    ratios = torch.stack(ratios) / speeds.repeat(len(SEEDS))[:, None]  # (samples, frames)
    spans, verdicts = {}, []
    for first, last in SPANS:
        means = ratios[:, round(first * fps) : round(last * fps)].mean(1)
        sound = means[means.isfinite()]
        low, high = LEFT[gait]
        interval = metrics.bootstrap(sound.tolist(), lambda some: sum(some) / len(some))
        spans[f"{first}-{last} s"] = {
            "speed over the start's": interval._asdict(),
            "in another gait": float(((sound < low) | (sound > high)).double().mean()),
            "lost": len(means) - len(sound),
        }
        if (first, last) in JUDGED:
            verdicts.append(len(sound) == len(means) and abs(interval.value - 1) <= REACH[gait])
    return {
        "starts": len(begun),
        "speed (m/s)": float(speeds.mean()),
        "spans": spans,
        "keeps its pace": all(verdicts),
    }


def pace(model: nn.Module, features: Tensor) -> Tensor:
    """Speed (frames,) in m/s of one motion (frames, dim); NaN from where it is no motion any more."""
    whole = int(features.isfinite().all(-1).cumprod(0).sum())
    speed = torch.full(features.shape[:1], torch.nan)
    if whole > 1:
        speed[:whole] = metrics.speed(model.encoding.positions(features[:whole]), model.fps)
    return speed


if __name__ == "__main__":
    record.run(main)
