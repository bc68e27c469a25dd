"""What every metric says of real motion: writes results/noise_floor.json.

    MOTIONLAB_DATA=folder python -m experiments.data.noise_floor [--output results/noise_floor.json]

The training clips of a set are split in two halves by performance, so that both have all actions
and styles. Metrics of one clip are given for each half, distances of sets for each half from the
other: differences between the halves are what no model's number can be trusted below. Intervals
are bootstrapped over clips, that of the Fréchet distance is a jackknife's. Validation clips tell
how often the detectors, fitted on the training clips, raise an alarm on real motion; planted
failures, how often and how late they find one. Test clips are not opened.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import motionlab
from motionlab import Motion, Skeleton, contacts, datasets, metrics
from motionlab.datasets import splits
from motionlab.datasets.registry import choose
from motionlab.encodings import BodyFrame, Normalizer

from ..common import record

FPS = 30.0
WALK, RUN = ("walk",), ("run", "dash")  # actions that begin so
SETS = {
    "locomotion": ("locomotion", ("",)),
    "locomotion walking": ("locomotion", WALK),
    "locomotion running": ("locomotion", RUN),
    "aclstm-cmu": ("aclstm-cmu", ("",)),
}
SEED = 0
MILLISECONDS = (80, 160, 320, 400, 560)
PAST, FUTURE = 20, 18  # frames: what is alike in two clips, and what is compared after it


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", default="results/noise_floor.json")
    output = Path(parser.parse_args().output)
    torch.set_num_threads(1)  # a clip is too small to share
    begin = time.perf_counter()
    rows = [(c.source, c.where, c.split) for name, _ in SETS.values() for c in choose(name)]
    result = {
        "command": " ".join(record.command()),
        "code_version": motionlab.__version__,
        "data_hash": splits.digest(rows),
        "seed": SEED,
        "fps": FPS,
        "sets": {title: _measured(*which) for title, which in SETS.items()},
        "machine": platform.platform(),
        "torch": torch.__version__,
    }
    result["seconds"] = round(time.perf_counter() - begin, 1)
    output.parent.mkdir(exist_ok=True)
    output.write_text(json.dumps(_rounded(result), indent=1) + "\n")
    print(f"{output}: {result['seconds']} s")


def _measured(name: str, actions: tuple[str, ...]) -> dict:
    halves = _halves(_chosen(name, "train", actions), name)
    motions = halves["A"] + halves["B"]
    clip_wise = {half: _of_clips(some) for half, some in halves.items()}
    between = {half: {} for half in halves}
    for half, other in (("A", "B"), ("B", "A")):
        between[half] |= _manifold(halves[half], halves[other])
        between[half] |= _frechet(halves[half], halves[other])
        between[half] |= _futures(halves[half], halves[other])
    limits = metrics.Limits.fit(
        [m.positions() for m in motions], fps=FPS, skeleton=motions[0].skeleton
    )
    held_out = _chosen(name, "val", actions)
    recorded = {"as recorded": _as_recorded(motions)} if name == "locomotion" else {}
    return recorded | {
        "clips": {half: len(some) for half, some in halves.items()},
        "minutes": {half: sum(m.seconds for m in some) / 60 for half, some in halves.items()},
        "halves": clip_wise,
        "half from the other half": between,
        "limits": {"still (cm)": 100 * limits.still, "patience (s)": limits.patience}
        | {"heights (m)": limits.heights, "speed (m/s)": limits.speed},
        "alarms on validation clips": _alarms(held_out, motions, limits),
        "planted": _planted(held_out, limits),
    }


# -- clips ----------------------------------------------------------------------------------------


def _chosen(name: str, split: str, actions: tuple[str, ...]) -> list[Motion]:
    """Clips of some actions at one rate; those below two seconds are too short for most metrics."""
    action = {clip.name: clip.action for clip in choose(name)}
    motions = datasets.load(name, split)
    motions = [m.resample(FPS) for m in motions if action[m.name].startswith(actions)]
    return [m for m in motions if m.seconds >= 2]


def _halves(motions: list[Motion], name: str) -> dict[str, list[Motion]]:
    """Every second performance of an action and style, so that the halves share none."""
    about = {clip.name: clip for clip in choose(name)}
    performances = defaultdict(list)
    for motion in motions:
        clip = about[motion.name]
        performances[clip.source, clip.performance].append(motion)
    order = sorted(
        performances,
        key=lambda key: (*_kind(about[performances[key][0].name]), *key),
    )
    return {
        half: [motion for key in order[first::2] for motion in performances[key]]
        for first, half in enumerate("AB")
    }


def _kind(clip) -> tuple[str, str, str]:
    return clip.source, clip.action, clip.style


# -- metrics --------------------------------------------------------------------------------------


def _of_clips(motions: list[Motion]) -> dict[str, metrics.Interval]:
    """Intervals of every metric that one clip has a value for."""
    values = defaultdict(list)
    for motion in motions:
        for metric, value in _of_clip(motion).items():
            values[metric].append(float(value))
    return {
        metric: metrics.bootstrap(numbers, seed=SEED)
        for metric, numbers in values.items()
        if not np.isnan(numbers).all()
    }


def _as_recorded(motions: list[Motion]) -> dict[str, dict[str, metrics.Interval]]:
    """The clips before retargeting planted their feet, and after, by source."""
    rows = defaultdict(lambda: defaultdict(list))
    for source in sorted({motion.source for motion in motions}):
        after = {motion.name: motion for motion in motions if motion.source == source}
        for motion in datasets.load(source, clips=list(after)):
            for when, clip in (("recorded", motion.resample(FPS)), ("planted", after[motion.name])):
                p, skeleton, down = clip.positions(), clip.skeleton, contacts.label(clip)
                skate = metrics.foot_skate(p, down, skeleton, FPS)
                rows[source][f"foot skate, {when} (cm/s)"].append(float(skate))
                rows[source][f"jerk, {when} (m/s³)"].append(float(metrics.jerk(p, FPS)))
    return {
        source: {metric: metrics.bootstrap(values, seed=SEED) for metric, values in row.items()}
        for source, row in rows.items()
    }


def _of_clip(motion: Motion) -> dict[str, Tensor]:
    p, skeleton = motion.positions(), motion.skeleton
    down = contacts.label(motion)
    ratio = metrics.repetition(p, fps=FPS, skeleton=skeleton)
    found = {
        "motion change (m/s)": metrics.motion_change(p, FPS).mean(),
        "foot skate (cm/s)": metrics.foot_skate(p, down, skeleton, FPS),
        "foot skate ratio": metrics.foot_skate_ratio(p, down, skeleton, FPS),
        "acceleration (m/s²)": metrics.acceleration(p, FPS),
        "jerk (m/s³)": metrics.jerk(p, FPS),
        "speed (m/s)": metrics.speed(p, FPS).mean(),
        "turn rate, unsigned (rad/s)": metrics.turn_rate(p, skeleton, FPS).abs().mean(),
        "cadence (steps/min)": metrics.cadence(down, FPS),
        "step length (m)": metrics.step_length(p, down, skeleton, FPS),
        "repetition": ratio if ratio.isfinite() else ratio * torch.nan,
        "stagnant share": _stagnant(p, skeleton),
    }
    if skeleton.matches(Skeleton.canonical()):  # its rest pose stands on the floor, others' may not
        found |= {
            "foot skate, weighted (cm/s)": metrics.foot_skate_weighted(p, skeleton, FPS),
            "penetration (cm)": metrics.penetration(p, skeleton).mean(),
            "floating (cm)": metrics.floating(p, skeleton, contacts=down).nanmean(),
        }
    return found


def _stagnant(positions: Tensor, skeleton: Skeleton) -> Tensor:
    """Share of half seconds in which the pose moves less than 1 cm."""
    extent = metrics.pose_extent(positions, fps=FPS, skeleton=skeleton)
    return (extent < 0.01).double().mean()


def _features(motions: list[Motion], reference: list[Motion]) -> tuple[list, list]:
    """BodyFrame features of both, standardised by the reference's."""
    encoding = BodyFrame(motions[0].skeleton, fps=FPS)
    ours, theirs = ([encoding.encode(m) for m in some] for some in (motions, reference))
    normalizer = Normalizer.fit(theirs)
    return [normalizer(f) for f in ours], [normalizer(f) for f in theirs]


def _manifold(motions: list[Motion], reference: list[Motion]) -> dict[str, metrics.Interval]:
    distance = metrics.manifold_distance(*_features(motions, reference), fps=FPS)
    return {"manifold distance": metrics.bootstrap(distance, seed=SEED)}


def _frechet(motions: list[Motion], reference: list[Motion]) -> dict[str, metrics.Interval]:
    clips = [m.positions() for m in reference]
    real = metrics.Frechet.fit(clips, fps=FPS, skeleton=reference[0].skeleton)
    moments = [real.moments(m.positions(), fps=FPS) for m in motions]
    return {"Fréchet distance": metrics.jackknife(moments, real.distance)}


def _futures(motions: list[Motion], reference: list[Motion]) -> dict[str, metrics.Interval]:
    """Prediction by the other half: what followed the window most like a clip's first 20 frames.

    How far two real futures of much the same past lie apart.
    """
    enough = PAST + FUTURE
    motions = [m for m in motions if len(m) >= enough]
    reference = [m for m in reference if len(m) >= enough]
    ours, theirs = _features(motions, reference)
    nearest = metrics.nearest_window_distance(
        [f[:PAST] for f in ours],
        [f[: len(f) - FUTURE] for f in theirs],
        fps=FPS,
        window=PAST / FPS,
        reference_step=0,
    )
    errors, joint_errors, spectra = [], [], []
    starts = (nearest.match_time * FPS).round().long()
    for motion, clip, start in zip(motions, nearest.match_clip, starts, strict=True):
        other = reference[int(clip)][int(start) : int(start) + enough]
        true, found = (_aligned(m.positions()[:enough], m.skeleton) for m in (motion, other))
        later = [metrics.position_error(found, true), metrics.mean_joint_error(found, true)]
        for store, error in zip((errors, joint_errors), later, strict=True):
            store.append(metrics.at_milliseconds(error[PAST:], FPS, MILLISECONDS))
        flat = [points[None, PAST:].flatten(2) for points in (found, true)]
        spectra.append(metrics.npss(*flat, FPS))
    result = {"nearest future, NPSS": metrics.bootstrap(torch.stack(spectra), seed=SEED)}
    for what, store in (("error (m)", errors), ("mean joint error (cm)", joint_errors)):
        for ms, column in zip(MILLISECONDS, torch.stack(store).T, strict=True):
            result[f"nearest future, {what} at {ms} ms"] = metrics.bootstrap(column, seed=SEED)
    return result


def _aligned(positions: Tensor, skeleton: Skeleton) -> Tensor:
    """Moved and turned so that the last frame of the past stands at the origin, facing +z."""
    _, rotation = metrics.heading_frame(positions[PAST - 1 : PAST], skeleton)
    ground = positions[PAST - 1, 0] * torch.tensor([1.0, 0.0, 1.0])
    return (positions - ground) @ rotation[0]


# -- detectors ------------------------------------------------------------------------------------


def _alarms(held_out: list[Motion], real: list[Motion], limits: metrics.Limits) -> dict:
    """How many real clips that the detectors have not seen they call failed."""
    skeleton = limits.skeleton
    tolerance = metrics.loop_tolerance([m.positions() for m in real], fps=FPS, skeleton=skeleton)
    clips = [m.positions() for m in held_out]
    loops = [metrics.loop(c, fps=FPS, skeleton=skeleton, tolerance=tolerance) for c in clips]
    times = {
        "freeze": [float(metrics.time_to_freeze(c, fps=FPS, limits=limits)) for c in clips],
        "divergence": [float(metrics.time_to_divergence(c, fps=FPS, limits=limits)) for c in clips],
        "loop": [found.period for found in loops],
    }
    pauses = [len(metrics.stagnations(c, fps=FPS, limits=limits)) for c in clips]
    return {
        "clips": len(clips),
        "loop tolerance": tolerance,
        "stagnations": sum(pauses),
        "alarms": {name: int(np.isfinite(found).sum()) for name, found in times.items()},
        "names": {
            name: [m.name for m, t in zip(held_out, found, strict=True) if np.isfinite(t)]
            for name, found in times.items()
        },
    }


def _planted(held_out: list[Motion], limits: metrics.Limits) -> dict:
    """Share of planted failures found, and seconds from the planting to the time that is given."""
    seconds = limits.patience + 2
    at = np.array([_middle(m.positions()) / FPS for m in held_out])
    kinds = {kind: metrics.time_to_freeze for kind in ("freeze", "statue", "tremble")}
    kinds |= {kind: metrics.time_to_divergence for kind in ("explosion", "sinking", "shrinking")}
    result = {}
    for kind, detector in kinds.items():
        late = [
            float(detector(plant(m.positions(), kind, seconds), fps=FPS, limits=limits))
            for m in held_out
        ]
        late = np.array(late) - at
        found = late[np.isfinite(late)]
        result[kind] = {"clips": len(late), "found": len(found)}
        result[kind] |= {"late (s), quantiles 0, 0.5, 1": np.quantile(found, [0, 0.5, 1]).tolist()}
    pauses = [pause(m.positions()) for m in held_out]
    alarms = [metrics.time_to_freeze(p, fps=FPS, limits=limits).isfinite() for p in pauses]
    seen = [
        any(a < begin + 0.3 and b > begin + 0.7 for a, b in some)
        for begin, some in zip(
            at, (metrics.stagnations(p, fps=FPS, limits=limits) for p in pauses), strict=True
        )
    ]
    result["pause of 1 s"] = {
        "clips": len(pauses),
        "called stagnation": sum(seen),
        "called freeze": int(sum(alarms)),
    }
    return result


def plant(positions: Tensor, kind: str, seconds: float) -> Tensor:
    """The first half of the clip, then a failure for some seconds."""
    frame = _middle(positions)
    held = positions[frame].expand(round(seconds * FPS), -1, -1)
    time = torch.arange(len(held))[:, None, None] / FPS
    root, random = held[:, :1], torch.Generator().manual_seed(SEED)
    after = {
        "freeze": held,
        "statue": held + time * torch.tensor([0.5, 0.0, 1.0]),  # slides
        "tremble": held + 0.002 * torch.randn(held.shape, generator=random),
        "explosion": root + (held - root) * torch.exp(2 * time),
        "shrinking": root + (held - root) * torch.exp(-time),
        "sinking": held - time * torch.tensor([0.0, 1.0, 0.0]),
    }[kind]
    return torch.cat([positions[:frame], after])


def pause(positions: Tensor) -> Tensor:
    """The clip with its middle frame held for a second."""
    frame = _middle(positions)
    held = positions[frame].expand(round(FPS), -1, -1)
    return torch.cat([positions[:frame], held, positions[frame:]])


def _middle(positions: Tensor) -> int:
    return len(positions) // 2


def _rounded(value):
    if isinstance(value, metrics.Interval):
        return _rounded(value._asdict())
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
