"""What the training clips of "locomotion" hold, source by source: results/locomotion_content.json.

    MOTIONLAB_DATA=folder python -m experiments.data.locomotion_content

A body stands below 0.3 m/s, walks, and runs from 2 m/s on, by the speed of its root over half a
second; of the change from one to another 0.2 m/s are left aside, so that a speed between two counts
for neither. A start leaves standing, a stop ends in it. A turn is 60 degrees or more within a second
and a half. A run is cut off that lasts until the clip's last frame. Mirror images are left out, clips that `run_on` makes longer are counted as recorded.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from motionlab import metrics
from motionlab.training import PRESETS, Prepared
from motionlab.training.run_on import run_on, running

from ..common import record
from ..common.recorded import recorded_clips

GAITS = {"stand": (0.0, 0.3), "walk": (0.5, 1.8), "run": (2.0, 20.0)}  # m/s
SHIP = PRESETS["lstm-gmm-contacts"]["ship"]
WINDOW = 0.5  # seconds of which a speed is the mean
TURN, TURN_SECONDS = math.radians(60), 1.5


def main() -> None:
    begin = time.perf_counter()
    data = Prepared.find("locomotion")
    of_source = defaultdict(list)
    for entry, split, clip in recorded_clips(data):
        if split == "train":
            of_source[entry.source].append(content(data, clip))
    rows = [{"source": source, **summary(clips)} for source, clips in sorted(of_source.items())]
    everything = [clip for clips in of_source.values() for clip in clips]
    rows.append({"source": "all", **summary(everything)})
    train = data.clips("train")
    longer = run_on(train, data.encoding, data.normalizer, SHIP.run_on)
    result = {
        "sources": rows,
        "share of windows that run": {
            "as recorded": share_that_runs(train, data),
            f"runs of {SHIP.run_on} frames": share_that_runs(longer, data),
            "in a batch": SHIP.runs,
        },
    }
    record.write(record.provenance(begin, 0, data) | result, "results/locomotion_content.json")


def content(data: Prepared, clip: Tensor) -> dict:
    """Of one clip (frames, dim): its seconds, how long each gait lasts, and what changes how often."""
    fps, points = data.encoding.fps, data.encoding.positions(clip)
    speed = metrics.speed(points, fps, WINDOW).numpy()
    gaits = {gait: (speed >= low) & (speed < high) for gait, (low, high) in GAITS.items()}
    kinds = [
        gait
        for each in zip(*gaits.values(), strict=True)
        for gait, is_so in zip(gaits, each, strict=True)
        if is_so
    ]
    changes = [(a, b) for a, b in pairwise(kinds) if a != b]
    heading = np.unwrap(metrics.facing(points, data.encoding.skeleton).numpy())
    ahead = round(TURN_SECONDS * fps)
    turned = np.abs(heading[ahead:] - heading[:-ahead]) >= TURN
    edges = np.flatnonzero(np.diff(gaits["run"].astype(int), prepend=0, append=0))
    return {
        "seconds": len(clip) / fps,
        "runs": (np.diff(edges)[::2] / fps).tolist(),  # seconds of each
        "cut off": int(gaits["run"][-1]),
        "starts": sum(a == "stand" for a, _ in changes),
        "stops": sum(b == "stand" for _, b in changes),
        "walk to run": changes.count(("walk", "run")),
        "run to walk": changes.count(("run", "walk")),
        "turns": int((np.diff(turned.astype(int), prepend=0) == 1).sum()),
    }


def share_that_runs(clips: list[Tensor], data: Prepared) -> float:
    """Of all windows of clips, those of which more than half are of a run."""
    runs = [running(clip, data.encoding) for clip in clips if len(clip) >= SHIP.frames]
    windows = torch.cat([each.double().unfold(0, SHIP.frames, 1).mean(-1) for each in runs])
    return float((windows > 0.5).double().mean())


def summary(clips: list[dict]) -> dict:
    seconds = np.array([clip["seconds"] for clip in clips])
    total = lambda what: sum(clip[what] for clip in clips)
    runs = [seconds for clip in clips for seconds in clip["runs"]]
    return {
        "clips": len(clips),
        "minutes": seconds.sum() / 60,
        "clip (s)": {"median": np.median(seconds), "longest": seconds.max()},
        "minutes that run": sum(runs) / 60,
        "runs": len(runs),
        "run (s)": {"median": np.median(runs), "longest": max(runs)} if runs else None,
        "runs cut off": total("cut off"),
        **{
            what: total(what) for what in ("starts", "stops", "walk to run", "run to walk", "turns")
        },
    }


if __name__ == "__main__":
    record.run(main)
