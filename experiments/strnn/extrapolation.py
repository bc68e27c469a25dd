"""What an STRNN foretells, and what becomes of motion that it goes on with by itself.

    python -m experiments.strnn.extrapolation WEIGHTS ... [--split val] [--starts 50]
        [--frames 20000] [--noise 0 0.05] [--noise-chosen-in RESULT] [--without-residual]

Forecasts stand beside zero velocity, the mean frame and a ridge regression; motion in open loop beside
what recorded motion does. It is for validation clips unless told otherwise: what is chosen, such as the
noise, is chosen there, and verdicts are of test clips.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
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

from ..claims import strnn as rules
from ..claims import verdicts
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
    parser.add_argument("--noise-chosen-in", type=Path, help="no noise, and the best of a result")
    parser.add_argument("--without-residual", action="store_true", help="the same without it, too")
    parser.add_argument("--output", default="results/strnn_extrapolation.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    noises = chosen.noise
    if chosen.noise_chosen_in:
        noises = [0.0, choose_noise(json.loads(chosen.noise_chosen_in.read_text("utf-8")))]
    models = [motionlab.load(path) for path in chosen.weights]
    for path, model in zip(chosen.weights, models, strict=True):
        if not isinstance(model, Strnn):
            raise DataError(f"{path}: is a {type(model).__name__}, no STRNN.")
    data = in_body_frame(Prepared.find(chosen.data)).matching(models[0].encoding)
    clips = data.clips(chosen.split)
    longest = max(model.encode for model in models)
    sources = _sources(clips, data)
    real, seeds = real_of(data), prefixes(clips, sources, chosen.starts, longest)
    begun = Counter(_sources(long_clips(clips, sources, chosen.starts, longest), data))
    rows = {}
    for path, model in zip(chosen.weights, models, strict=True):
        row = {"weights": record.about_weights(model, path) | {"settings": settings(model)}}
        row["forecasts"] = forecasts(model.extrapolate, clips, data, model.encode)
        row["decoded"] = decoded(model, clips, data)
        loops = {f"open loop, noise {noise:g}": noise for noise in noises}
        for title, noise in loops.items():
            row[title] = open_loop(model, seeds, chosen.frames, noise, data, real, clips)
        if chosen.without_residual and model.residual:
            model.residual = False
            title = "open loop, noise 0, without residual"
            row[title] = open_loop(model, seeds, chosen.frames, 0.0, data, real, clips)
            model.residual = True
        rows[str(path)] = row
    result = {
        "split": chosen.split, "starts": len(seeds), "frames": chosen.frames, "noise": noises,
        "sources of starts": begun, "rows": rows,
        "floors": floors(clips, data), "real": about_real(clips, data, real),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def choose_noise(found: dict) -> float:
    """Of a result of validation clips the noise that is used on test clips: the smallest that keeps
    the limits of the claim S3, else that with the fewest short loops where most are alive.

    Raises
    ------
    DataError : the result is of other clips, or of no noise.
    """
    (row,) = found["rows"].values()
    noises = sorted(noise for noise in found["noise"] if noise)
    if found["split"] != "val" or not noises:
        raise DataError(
            "Noise is chosen on validation clips, of --noise above 0; give the result of such a run."
        )
    limits = next(claim for claim in verdicts.claims() if claim["id"] == "S3-noise")["limits"]
    loops = {noise: row[f"open loop, noise {noise:g}"] for noise in noises}
    alive = [noise for noise in noises if loops[noise]["alive"] >= limits["half"]]
    good = [noise for noise in alive if rules.holds(limits, loops[noise])]
    if good or not alive:
        return (good or noises)[0]
    return min(alive, key=lambda noise: rules.short_loops(loops[noise]))


def settings(model: Strnn) -> dict:
    """What tells it from others of its kind."""
    return {name: getattr(model, name) for name in model.settings}


def prefixes(
    clips: Sequence[Tensor], kinds: Sequence[str], wanted: int, frames: int
) -> Tensor:  # fmt: skip
    """Frames (starts, frames, dim) from the middle of `long_clips`."""
    chosen = long_clips(clips, kinds, wanted, frames)
    return torch.stack([clip[len(clip) // 2 - frames :][:frames] for clip in chosen])


def long_clips(
    clips: Sequence[Tensor], kinds: Sequence[str], wanted: int, frames: int
) -> list[Tensor]:
    """Clips that are twice as long, as many of each kind as there are: else most would be walks.

    Where a kind has fewer, the others have more. DataError if there is none.
    """
    long: dict[str, list[Tensor]] = {}
    for clip, kind in zip(clips, kinds, strict=True):
        if len(clip) >= 2 * frames:
            long.setdefault(kind, []).append(clip)
    if not long:
        raise DataError(f"None of {len(clips)} clips has {2 * frames} frames to begin in.")
    chosen, left = {}, min(wanted, sum(map(len, long.values())))
    for done, kind in enumerate(sorted(long, key=lambda kind: (len(long[kind]), kind))):
        count = min(len(long[kind]), -(-left // (len(long) - done)))
        chosen[kind] = [long[kind][i] for i in rollouts.spread_evenly(len(long[kind]), count)]
        left -= count
    return [clip for kind in sorted(chosen) for clip in chosen[kind]]


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


def open_loop(
    model: Strnn, seeds: Tensor, frames: int, noise: float, data: Prepared, real: Real,
    clips: Sequence[Tensor],
) -> dict:  # fmt: skip
    """What becomes of frames that go on from seeds, and how far their first ones are from clips."""
    generator = torch.Generator().manual_seed(0)
    made = model.extrapolate(seeds, frames, noise=noise, generator=generator)
    found = opened(made, data, real, model.predict)
    return found | {"manifold": manifold(made, data, real, clips)}


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
    long = [clip for clip in clips if len(clip) >= 4 / 3 * fps]
    for source, distance in zip(_sources(long, data), each, strict=True):
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
    """Of each clip the source in its name."""
    places = {}
    for name, its in zip(data.names, data.features.split(data.lengths.tolist()), strict=True):
        places[its.data_ptr()] = name.partition("/")[0]
    return [places[clip.data_ptr()] for clip in clips]


if __name__ == "__main__":
    record.run(main)
