"""What an STRNN foretells, and what becomes of motion that it goes on with by itself.

    python -m experiments.strnn.extrapolation WEIGHTS ... [--split val] [--starts 50]
        [--frames 20000] [--noise 0 0.05]

Forecasts stand beside zero velocity, the mean frame and a ridge regression; motion in open loop beside
what recorded motion does. Nothing here is a verdict, so it is for validation clips unless told otherwise.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor

import motionlab
from motionlab import metrics
from motionlab.contacts import label_positions
from motionlab.errors import DataError
from motionlab.models import Strnn
from motionlab.models.ridge import Ridge
from motionlab.training import Prepared
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

from ..common import record, rollouts

FLOOR = (
    20  # frames that the floors read and foretell, and of the prefix that all rollouts go on from
)
TIMES = (80, 160, 320, 400, 560)  # ms
MANIFOLD = 200  # frames of a rollout that are held against the manifold, as in the paper
PENALTY, STEP = 1e-3, 3  # of the ridge regression; a window begins at every third frame
TAIL = 10.0  # seconds at the end, of which rollouts are compared

Forecast = Callable[[Tensor, int], Tensor]  # normalised windows and n frames to normalised frames


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", nargs="+", type=Path)
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="val", choices=("val", "test"))
    parser.add_argument("--starts", type=int, default=50)
    parser.add_argument("--frames", type=int, default=20_000)
    parser.add_argument("--noise", nargs="+", type=float, default=[0.0])
    parser.add_argument("--output", default="results/strnn_extrapolation.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    models = [motionlab.load(path) for path in chosen.weights]
    for path, model in zip(chosen.weights, models, strict=True):
        if not isinstance(model, Strnn):
            raise DataError(f"{path}: is a {type(model).__name__}, no STRNN.")
    data = in_body_frame(Prepared.find(chosen.data)).matching(models[0].encoding)
    clips = data.clips(chosen.split)
    real, seeds = real_of(data), prefixes(clips, chosen.starts, max(m.encode for m in models))
    rows = {}
    for path, model in zip(chosen.weights, models, strict=True):
        row = {"weights": record.about_weights(model, path) | {"settings": settings(model)}}
        row["forecasts"] = forecasts(model.extrapolate, clips, data, model.encode)
        row["decoded"] = decoded(model, clips, data)
        for noise in chosen.noise:
            generator = torch.Generator().manual_seed(0)
            made = model.extrapolate(seeds, chosen.frames, noise=noise, generator=generator)
            row[f"open loop, noise {noise:g}"] = opened(made, data, real, model.predict)
            row[f"open loop, noise {noise:g}"]["manifold"] = manifold(made, data, real, clips)
        rows[str(path)] = row
    result = {
        "split": chosen.split, "starts": len(seeds), "frames": chosen.frames, "rows": rows,
        "floors": floors(clips, data), "real": about_real(clips, data, real),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def settings(model: Strnn) -> dict:
    """What tells it from others of its kind."""
    return {name: getattr(model, name) for name in model.settings}


def prefixes(clips: Sequence[Tensor], wanted: int, frames: int) -> Tensor:
    """Frames (starts, frames, dim) from the middle of clips spread over all that are twice as long."""
    long = [clip for clip in clips if len(clip) >= 2 * frames]
    if not long:
        raise DataError(f"None of {len(clips)} clips has {2 * frames} frames to begin in.")
    chosen = [long[i] for i in rollouts.spread_evenly(len(long), wanted)]
    return torch.stack([clip[len(clip) // 2 - frames :][:frames] for clip in chosen])


# -- forecasts ------------------------------------------------------------------------------------


@torch.no_grad()
def forecasts(go_on: Forecast, clips: Sequence[Tensor], data: Prepared, seen: int) -> dict:
    """Mean squared error of a channel, in normalised units, at some times and over all `FLOOR` frames.

    Errors between frames are interpolated. Every window of `seen` and `FLOOR` frames counts once.
    """
    errors = []
    for windows in Windows(clips, seen + FLOOR).tiles(256):
        said = data.normalizer(go_on(windows[:, :seen], FLOOR))
        errors.append((said - data.normalizer(windows[:, seen:])).square().mean(-1))
    error = torch.cat(errors).mean(0)
    at = metrics.at_milliseconds(error, data.encoding.fps, TIMES)
    named = {f"{ms} ms": float(its) for ms, its in zip(TIMES, at, strict=True)}
    return named | {f"{FLOOR} frames": float(error.mean())}


@torch.no_grad()
def decoded(model: Strnn, clips: Sequence[Tensor], data: Prepared) -> float:
    """Mean squared error of a channel in frames that are said again."""
    off = [
        (data.normalizer(model.reconstruct(some)) - data.normalizer(some)).square().mean((1, 2))
        for some in Windows(clips, model.encode).tiles(256)
    ]
    return float(torch.cat(off).mean())


def floors(clips: Sequence[Tensor], data: Prepared) -> dict[str, dict]:
    """Forecasts that no network made."""
    ridge = Ridge.fit(data.encoding, data.normalizer, data.clips("train"), FLOOR, FLOOR,
                      penalty=PENALTY, step=STEP)  # fmt: skip
    mean = data.normalizer.mean
    rivals = {
        "zero velocity": lambda seen, n: seen[:, -1:].expand(-1, n, -1),
        "mean frame": lambda seen, n: mean.expand(len(seen), n, -1),
        "ridge regression": ridge.extrapolate,
    }
    return {name: forecasts(go_on, clips, data, FLOOR) for name, go_on in rivals.items()}


# -- open loop ------------------------------------------------------------------------------------


class Real(NamedTuple):
    """What the training clips, without mirror images, say of real motion."""

    judge: rollouts.Judge
    tolerance: float  # of `metrics.loop`
    change: float  # m/s, mean motion change of points relative to the root
    acceleration: float  # m/s², mean
    clips: list[Tensor]  # normalised, those of a manifold's window or longer


@lru_cache(maxsize=1)
def real_of(data: Prepared) -> Real:
    encoding = data.encoding
    each = zip(data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True)
    clips = [c for n, split, c in each if split == "train" and not n.endswith("_mirrored")]
    points = [encoding.positions(clip) for clip in clips]
    whole = [some for some in points if len(some) >= 3]
    frames = torch.tensor([float(len(some)) for some in whole])
    lively = torch.stack([metrics.acceleration(some, encoding.fps) for some in whole])
    return Real(
        rollouts.judge_of(data),
        metrics.loop_tolerance(points, encoding.skeleton, encoding.fps),
        float(torch.cat([changes(some, encoding.fps) for some in whole]).mean()),
        float((lively * frames).sum() / frames.sum()),
        [data.normalizer(clip) for clip in clips if len(clip) >= 4 / 3 * encoding.fps],
    )


def changes(points: Tensor, fps: float) -> Tensor:
    """Motion change (frames - 1,) of points around the root, in m/s."""
    return metrics.motion_change(points - points[:, :1], fps)


def opened(made: Tensor, data: Prepared, real: Real, window: int) -> dict:
    """What became of rollouts (starts, frames, dim), made `window` frames at a time."""
    encoding, fps, frames = data.encoding, data.encoding.fps, made.shape[1]
    skeleton, minute = encoding.skeleton, round(60 * fps)
    failed, periods, tails, rows = [], [], [], []
    for features in made:
        points = rollouts.points_of(encoding, features)
        failures = real.judge.failures(points)
        failed.append(failures)
        if not all(map(math.isinf, failures.values())):
            continue
        last = points[-minute:]
        periods.append(metrics.loop(last, skeleton, fps, real.tolerance).period)
        tails.append(points[-round(TAIL * fps) :])
        bones = metrics.bone_length_error(points, skeleton)
        down = label_positions(points, skeleton, fps)
        rows.append({
            "movement, last minute, over real": float(changes(last, fps).mean()) / real.change,
            "acceleration over real": float(metrics.acceleration(points, fps)) / real.acceleration,
            "bones, mean (cm)": float(bones.mean), "bones, worst (cm)": float(bones.worst),
            "foot skate (cm/s)": float(metrics.foot_skate(points, down, skeleton, fps)),
            "speed, last minute (m/s)": float(metrics.speed(last, fps).mean()),
        } | _seams(points, window))  # fmt: skip
    found = {
        "alive": len(rows) / len(made),
        "failed": {kind: sum(math.isfinite(its[kind]) for its in failed) for kind in rollouts.KINDS},
        "seconds until failure": sorted(min(its.values()) for its in failed),
    }  # fmt: skip
    if not rows:
        return found
    groups = metrics.converged(torch.stack(tails), skeleton, fps, real.tolerance)
    found |= {
        "in loops, of those alive": sum(map(math.isfinite, periods)) / len(periods),
        "periods (s)": sorted(filter(math.isfinite, periods)),
        "largest shared end": int(groups.bincount().max()) / len(groups),
    }
    worst = {"bones, worst (cm)": max(row["bones, worst (cm)"] for row in rows)}
    means = {key: sum(row[key] for row in rows) / len(rows) for key in rows[0]}
    return found | means | worst | {"seconds each": frames / fps}


def _seams(points: Tensor, window: int) -> dict[str, float]:
    """Nothing for windows so short that there is no elsewhere."""
    if window < 4 or len(points) < 2 * window:
        return {}
    jumps = metrics.seam_jumps(points, window)
    return {"steps across seams": float(jumps.steps),
            "accelerations across seams": float(jumps.accelerations)}  # fmt: skip


def manifold(made: Tensor, data: Prepared, real: Real, clips: Sequence[Tensor]) -> dict:
    """Distance of the first frames from the nearest real windows, and of real ones from them."""
    fps = data.encoding.fps
    sound = made[:, :MANIFOLD].isfinite().all(-1).all(-1)
    ours = data.normalizer(made[sound, :MANIFOLD])
    if not len(ours) or ours.shape[1] < 4 / 3 * fps:
        return {}
    theirs = _long(clips, data)
    return {
        "to real": float(metrics.manifold_distance(ours, real.clips, fps).mean()),
        "of real": float(metrics.manifold_distance(theirs, ours, fps).mean()),
    }


def about_real(clips: Sequence[Tensor], data: Prepared, real: Real) -> dict:
    """The same of real clips, as far as it has a meaning there."""
    fps, skeleton = data.encoding.fps, data.encoding.skeleton
    points = [data.encoding.positions(clip) for clip in clips if len(clip) >= 3]
    skates = [
        metrics.foot_skate(some, label_positions(some, skeleton, fps), skeleton, fps)
        for some in points
    ]
    theirs = _long(clips, data)
    by_source: dict[str, list[float]] = {}
    each = metrics.manifold_distance(theirs, real.clips, fps).tolist()
    for source, distance in zip(_sources(clips, data), each, strict=True):
        by_source.setdefault(source, []).append(distance)
    return {
        "motion change (m/s)": real.change, "acceleration (m/s²)": real.acceleration,
        "loop tolerance": real.tolerance,
        "foot skate (cm/s)": float(torch.stack(skates).nanmean()),
        "manifold, to training clips": sum(each) / len(each),
        "by source": {name: sum(its) / len(its) for name, its in sorted(by_source.items())},
    }  # fmt: skip


def _long(clips: Sequence[Tensor], data: Prepared) -> list[Tensor]:
    """Normalised clips that hold a window of the manifold distance."""
    return [data.normalizer(clip) for clip in clips if len(clip) >= 4 / 3 * data.encoding.fps]


def _sources(clips: Sequence[Tensor], data: Prepared) -> list[str]:
    """Of each clip that `_long` keeps the source of its name."""
    places = {}
    for name, its in zip(data.names, data.features.split(data.lengths.tolist()), strict=True):
        places[its.data_ptr()] = name.partition("/")[0]
    return [places[c.data_ptr()] for c in clips if len(c) >= 4 / 3 * data.encoding.fps]


if __name__ == "__main__":
    record.run(main)
