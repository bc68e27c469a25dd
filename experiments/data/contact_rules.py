"""How well the contact rules find contacts: writes results/contact_rules.json.

    MOTIONLAB_DATA=folder python -m experiments.data.contact_rules [--output results/contact_rules.json]

Against exact labels (the gaits'): precision, recall and F1 of each channel by kind of gait and
rule, and F1 over the threshold. On real clips, where no label is exact: how much is labelled, for
how long at a time, how often it flickers, how high feet lie that do not move, and what the height
rule takes away. The thresholds are chosen on gaits and on train clips; test clips are not opened.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import torch

import motionlab
from motionlab import Motion, contacts, datasets
from motionlab.datasets import gaits, splits
from motionlab.datasets.registry import choose

from ..common import record

SEEDS = range(5)
SPEEDS = {"slow walk": (0.5, 0.8), "walk": (1.1, 1.4), "brisk walk": (1.7, 1.9)}
SPEEDS |= {"slow run": (2.3, 2.8), "run": (3.3, 3.7), "fast run": (4.5, 5.0)}
CURVE = [round(0.05 * n, 2) for n in range(1, 21)]  # m/s
HEIGHTS = [0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.08]  # m
REAL = ("accad", "cmu", "bandai-locomotion")
EVERY = {"bandai-locomotion": 6}  # of its clips, every sixth
# Actions of real clips that are the gaits' business.
GAITS = {
    "walked": {"walk", "walk-turn", "walk-turn-left", "walk-turn-right", "walk-back"},
    "run": {"run", "run-turn", "dash"},
}
SHORT = 3 / 30  # seconds; a shorter interval is a flicker


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", default="results/contact_rules.json")
    output = Path(parser.parse_args().output)
    begin = time.perf_counter()
    made = {kind: list(_gaits(speeds)) for kind, speeds in SPEEDS.items()}
    made["turning walk"] = list(_gaits((1.2, 1.2), turn_rate=0.8))
    made["starts and stops"] = list(_gaits(([0, 0, 1.4, 1.4, 0, 0], [0, 0, 3.0, 3.0, 0, 0])))
    clips = {source: _train(source) for source in REAL}
    rows = [(c.source, c.where, c.split) for s in REAL for c in choose(s)]
    result = {
        "command": " ".join(record.command()),
        "code_version": motionlab.__version__,
        "data_hash": splits.digest(rows),
        "clips": {source: len(motions) for source, motions in clips.items()},
        "gaits": {k: _against_truth(motions) for k, motions in made.items()},
        "f1_over_speed": {
            kind: {str(v): _f1(made[kind], "speed", speed=v) for v in CURVE}
            for kind in ("walk", "run")
        },
        "f1_over_height": {
            kind: {str(h): _f1(motions, "speed-height", height=h)["all"] for h in HEIGHTS}
            for kind, motions in made.items()
        },
        "resting_heights": {
            f"{source} {gait}": _resting_heights(
                [
                    m
                    for a, some in _by_action(source, motions).items()
                    if a in GAITS[gait]
                    for m in some
                ]
            )
            for source, motions in clips.items()
            for gait in GAITS
        },
        "real": {
            f"{source} {action}": {rule: _habits(some, rule) for rule in contacts.RULES}
            for source, motions in clips.items()
            for action, some in _by_action(source, motions).items()
        },
        "machine": platform.platform(),
        "seconds": 0.0,
    }
    result["seconds"] = round(time.perf_counter() - begin, 1)
    output.parent.mkdir(exist_ok=True)
    output.write_text(json.dumps(_rounded(result), indent=1) + "\n")
    print(f"{output}: {result['seconds']} s")


def _gaits(speeds: Iterable, **options) -> Iterator[Motion]:
    for speed in speeds:
        for seed in SEEDS:
            yield gaits.make(seconds=8, speed=speed, seed=seed, **options)


def _train(source: str) -> list[Motion]:
    names = [clip.name for clip in choose(source, "train")][:: EVERY.get(source, 1)]
    motions = datasets.load(source, "train", clips=names)
    return [motion.resample(30) for motion in motions]


def _by_action(source: str, motions: list[Motion]) -> dict[str, list[Motion]]:
    action = {clip.name: clip.action for clip in choose(source)}
    groups: dict[str, list[Motion]] = {}
    for motion in motions:
        groups.setdefault(action[motion.name], []).append(motion)
    return dict(sorted(groups.items()))


def _found(motions: list[Motion], rule: str, **thresholds) -> torch.Tensor:
    return torch.cat([contacts.label(motion, rule, **thresholds) for motion in motions])


def _against_truth(motions: list[Motion]) -> dict:
    truth = torch.cat([motion.contacts for motion in motions])
    scores = {rule: contacts.agreement(_found(motions, rule), truth) for rule in contacts.RULES}
    return scores | {
        "true share": truth.float().mean().item(),
        "errors near an edge": _errors_near_an_edge(motions),
    }


def _errors_near_an_edge(motions: list[Motion]) -> dict[str, float]:
    """Of the frames that the speed rule gets wrong, the share with a change of the true label
    within one frame of it, and within two."""
    wrong, near = 0, {1: 0, 2: 0}
    for motion in motions:
        errors = contacts.label(motion) != motion.contacts
        wrong += int(errors.sum())
        for reach in near:
            width = 2 * reach + 1
            widened = [
                torch.nn.functional.max_pool1d(labels.T[None].float(), width, 1, reach)[0].T > 0
                for labels in (motion.contacts, ~motion.contacts)
            ]
            near[reach] += int((errors & widened[0] & widened[1]).sum())
    return {f"within {reach}": count / wrong for reach, count in near.items()}


def _f1(motions: list[Motion], rule: str, **thresholds) -> dict[str, float]:
    truth = torch.cat([motion.contacts for motion in motions])
    found = contacts.agreement(_found(motions, rule, **thresholds), truth)
    return {channel: row["f1"] for channel, row in found.items()}


def _resting_heights(motions: list[Motion]) -> dict[str, list[float]]:
    """Metres that resting feet (slower than 0.15 m/s) lie above their clip's median when slow.

    Quantiles 0.5, 0.9, 0.95, 0.99: a height threshold must lie above, or it takes resting feet
    away. The spread is that of floors, sizes and solving, and of feet that rest on their toes.
    """
    above: dict[str, list] = {"heel": [], "toe": []}
    for motion in motions:
        feet = motion.positions()[:, contacts.foot_points(motion.skeleton)]
        speeds = contacts.foot_speeds(feet, motion.fps)
        slow = torch.where(speeds < 0.45, feet[..., 1], torch.nan)
        still, height = speeds < 0.15, feet[..., 1] - slow.nanmedian(dim=0).values
        for column in range(4):
            name = ("heel", "toe")[column % 2]
            above[name].append(height[:, column][still[:, column]])
    return {
        name: np.quantile(torch.cat(values), [0.5, 0.9, 0.95, 0.99]).tolist()
        for name, values in above.items()
        if values
    }


def _habits(motions: list[Motion], rule: str) -> dict:
    """Share of frames in contact, mean seconds of an interval, and flickers a minute, by channel.

    Intervals that the clip's ends cut are left out of length and flickers.
    """
    share, lengths, flickers, seconds = [], [[] for _ in range(4)], np.zeros(4), 0.0
    for motion in motions:
        found = contacts.label(motion, rule).numpy()
        share.append(found)
        seconds += motion.seconds
        for channel in range(4):
            for start, stop in _intervals(found[:, channel]):
                if start > 0 and stop < len(found):
                    lengths[channel].append((stop - start) / motion.fps)
                    flickers[channel] += (stop - start) / motion.fps < SHORT
            for start, stop in _intervals(~found[:, channel]):
                if start > 0 and stop < len(found):
                    flickers[channel] += (stop - start) / motion.fps < SHORT
    return {
        "clips": len(motions),
        "seconds": seconds,
        "share": np.concatenate(share).mean(0).tolist(),
        "mean interval": [float(np.mean(some)) if some else None for some in lengths],
        "flickers a minute": (60 * flickers / seconds).tolist(),
    }


def _intervals(on: np.ndarray) -> list[list[int]]:
    return np.flatnonzero(np.diff(on.astype(int), prepend=0, append=0)).reshape(-1, 2).tolist()


def _rounded(value):
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    if isinstance(value, float):
        return None if np.isnan(value) else round(value, 4)
    return value


if __name__ == "__main__":
    main()
