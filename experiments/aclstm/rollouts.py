"""Z1, Z3, Z4, Z5, Z7: what becomes of dances that go on for 20 000 frames.

    python -m experiments.aclstm.rollouts [--only ROW ...] [--preset smoke] [--frames 20000]

Of every training of trainings.py that is done, and of every dancer that ships. What is
measured and how it is judged stands in claims.yaml. What was found of some weights is kept in
runs/dances-rollouts/: stopped and started again, it goes on.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

import motionlab
from motionlab import metrics, weights
from motionlab.encodings import Normalizer
from motionlab.training.checkpoints import write_whole
from motionlab.training.dances import METHODS

from ..common import record, rollouts
from . import dances
from .trainings import PLAIN, ROWS, run_of, snapshots, weights_of

SHIPPED = "shipped"  # instead of a row: the dancers that ship
STARTS, FRAMES = 20, 20_000
SHORT = 1000  # frames of the paper's figure 7
SOON = 5.0  # seconds within which a stagnation ends that recovers
MINUTES = (1, 2, 5, 11)  # at which rollouts are compared with each other
TAIL = 10.0  # seconds before, of which they are compared
LASTING = 1.0  # seconds for which a body that is only points must have diverged
ELASTIC = "if bones may have any length"  # told beside what the claims ask
NOISES = (0.1,)  # on what a dancer sees of itself: the choice of noise.py
POINTS = 60  # of a curve over frames
STRIP, POSES = 4.0, 8  # of a film strip before the latest failure: seconds, and poses
GIVEN_AWAY = 2.0  # seconds from one window of a rollout to the next that is looked for in the data


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="table", choices=list(METHODS["aclstm"]))
    parser.add_argument(
        "--only", nargs="+", metavar="ROW", choices=[*(r.name for r in ROWS), SHIPPED]
    )
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--output", help="results/dances_rollouts.json if left out")
    chosen = parser.parse_args(arguments)
    whole = (chosen.preset, chosen.starts, chosen.frames) == ("table", STARTS, FRAMES)
    if not (whole or chosen.output):
        parser.error("other trainings, fewer starts or frames are not the result: name an --output")
    begin = time.perf_counter()
    follow = lambda path, style: followed(path, style, chosen.starts, chosen.frames)
    rows = {}
    for row in ROWS:
        done = [
            run
            for run in (run_of(row, seed, chosen.preset) for seed in row.seeds)
            if weights_of(run)
        ]
        if not done or (chosen.only and row.name not in chosen.only):
            continue
        rows[row.name] = {"what": row.what, "method": row.method, "style": row.data, "seeds": {}}
        for run in done:
            found = follow(weights_of(run), row.data)
            if row.name in PLAIN:
                kept = snapshots(run).items()
                found |= {"after updates": {n: _short(follow(p, row.data)) for n, p in kept}}
            rows[row.name]["seeds"][str(run.seed)] = found
    dancers = {}
    for name in weights.names():
        if name.startswith("aclstm-") and (chosen.only is None or SHIPPED in chosen.only):
            path, style = weights.find(name), name.partition("-")[2]
            judge = real_of(style, motionlab.load(path).fps).judge
            dancers[name] = follow(path, style) | {"limits": judge.config()}
            dancers[name]["with noise"] = {
                f"{noise:g}": followed(path, style, chosen.starts, chosen.frames, noise)
                for noise in NOISES
            }
    result = {
        "preset": chosen.preset, "starts": chosen.starts, "frames": chosen.frames,
        "curves are at frames": middles(chosen.frames), "rows": rows, "dancers": dancers,
    }  # fmt: skip
    styles = sorted({r["style"] for r in rows.values()} | {n.partition("-")[2] for n in dancers})
    hashes = {style: dances.of(style).hash for style in styles}
    facts = record.provenance(begin, 0, dances.of("indian"), data_hashes=hashes)
    record.write(facts | result, chosen.output or "results/dances_rollouts.json")


def _short(found: dict) -> dict:
    """What is told of weights on the way."""
    keys = ("median seconds until failure", "alive", "failed")
    pick = lambda its: (
        {k: its[k] for k in keys} | {"change, last minute": its["change"]["last minute"]}
    )
    return pick(found) | {ELASTIC: pick(found[ELASTIC])}


def followed(path: Path, style: str, starts: int, frames: int, noise: float = 0.0) -> dict:
    """What became of the rollouts of some weights; kept, since they take minutes."""
    sha = hashlib.sha256(path.read_bytes()).hexdigest()
    model = motionlab.load(path)
    real = real_of(style, model.fps)
    name = f"{sha[:12]}-{dances.of(style, model.fps).hash[:6]}-{model.fps:g}-{starts}-{frames}"
    name += f"-{noise:g}" * (noise > 0)
    kept = Path("runs") / "dances-rollouts" / f"{name}.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    print(f"{path} -> {kept}", flush=True)
    found = {"update": model.about.get("update"), "sha256": sha}
    found |= told(model, real, dances.seeds(style, starts, model.fps).seen, frames, noise)
    found = record.rounded(found)
    write_whole(kept, lambda stream: stream.write(json.dumps(found).encode()))
    return found


# -- what real motion does ------------------------------------------------------------------------


class Real(NamedTuple):
    """What the training clips of a style say of real motion, and how new held-out clips are."""

    judge: rollouts.Judge
    elastic: rollouts.Judge  # whose bones may have any length
    tolerance: float  # of `metrics.loop`
    change: float  # mean motion change of points relative to the root
    acceleration: float  # m/s², mean
    normalizer: Normalizer  # of poses as `_poses` gives them
    poses: list[Tensor]
    held_out: Tensor  # distances of held-out windows to the nearest of these


@cache
def real_of(style: str, fps: float) -> Real:
    data = dances.of(style, fps)
    encoding, judge = data.encoding, replace(rollouts.judge_of(data), lasting=LASTING)
    training, test = (
        [_poses(encoding.positions(clip), judge) for clip in data.clips(split)]
        for split in ("train", "test")
    )
    normalizer = Normalizer.fit(training)
    training, test = (
        [normalizer(clip) for clip in clips if len(clip) >= 2 * fps] for clips in (training, test)
    )
    change = [changes(clip, encoding) for clip in data.clips("train")]
    limits = replace(judge.limits, bones=torch.full_like(judge.limits.bones, math.inf))
    return Real(
        judge,
        replace(judge, limits=limits),
        metrics.loop_tolerance(
            [encoding.positions(clip) for clip in data.clips("train")], encoding.skeleton, fps
        ),
        float(np.concatenate(change).mean()),
        _lively([encoding.positions(clip) for clip in data.clips("train")], fps),
        normalizer,
        training,
        metrics.nearest_window_distance(test, training, fps, reference_step=0).distance,
    )  # fmt: skip


def _lively(motions: Sequence[Tensor], fps: float) -> float:
    """Mean acceleration (m/s²) of motions, each as long as it is."""
    each = [float(metrics.acceleration(points, fps)) for points in motions]
    return float(np.average(each, weights=[len(points) for points in motions]))


def changes(features: Tensor, encoding) -> np.ndarray:
    """Motion change (frames - 1,) of the points relative to the root; metres a second."""
    return metrics.feature_change(features[:, encoding.slices["pose"]], encoding.fps).numpy()


def _poses(points: Tensor, judge: rollouts.Judge) -> Tensor:
    """Points in the heading frame (frames, 3 points): the same however the body is turned."""
    return metrics.heading_frame(points, judge.limits.skeleton)[0].flatten(1)


# -- one rollout ----------------------------------------------------------------------------------


class Rollout(NamedTuple):
    """What became of one rollout; times in seconds, infinite if never."""

    failures: dict[str, float]
    whole: dict[str, float]  # the same if bones may have any length
    short: float  # time of failure when only the first `SHORT` frames are watched
    change: np.ndarray  # over real, of each step until it diverged in another way than by its bones
    pauses: list[tuple[float, float]]  # stagnations until it diverged
    sound: int  # frames until it diverged
    period: float  # of the loop on which it ends
    head: Tensor  # points of its first minute
    strip: Tensor  # ... of some moments before it failed, or of the first `SHORT` frames' last ones
    tails: dict[float, Tensor]  # ... of the seconds before some times

    @property
    def failed(self) -> float:
        return min(self.failures.values())


def judged(features: Tensor, encoding, real: Real) -> Rollout:
    """Follow one rollout, features (frames, dim)."""
    judge, fps, frames = real.judge, encoding.fps, len(features)
    skeleton = judge.limits.skeleton
    points = rollouts.points_of(encoding, features)
    failures, whole = judge.failures(points), real.elastic.failures(points)
    until = lambda gone: frames if math.isinf(gone) else round(gone * fps)
    sound, finite = until(failures["diverged"]), until(whole["diverged"])
    change, pauses, period = np.zeros(0), [], math.inf
    if finite >= 2:
        change = changes(features[:finite], encoding) / real.change
    if sound > fps:
        pauses = metrics.stagnations(points[:sound], judge.limits, fps)
    minute, tail = round(60 * fps), round(TAIL * fps)
    if sound == frames and frames >= 4 * fps:
        period = metrics.loop(points[-minute:], skeleton, fps, real.tolerance).period
    short = min(judge.failures(points[:SHORT]).values())
    last = min(until(short), SHORT, frames) - 1
    moments = torch.linspace(last - STRIP * fps, last, POSES).round().long().clamp(0)
    ends = [m * minute for m in MINUTES if m * minute <= frames] + [frames]
    return Rollout(
        failures, whole, short, change, pauses, sound, period,
        points[:minute].clone(), points[moments],
        {end / fps: points[max(0, end - tail) : end].clone() for end in ends},
    )  # fmt: skip


def edges(frames: int) -> np.ndarray:
    """Frames at which the pieces of a curve begin and end: ever longer ones."""
    return np.unique(np.geomspace(1, frames, POINTS + 1).round().astype(int))


def middles(frames: int) -> list[float]:
    """Where the points of a curve lie."""
    found = edges(frames)
    return np.sqrt(found[:-1] * found[1:]).round(1).tolist()


# -- all rollouts of one network ------------------------------------------------------------------


def told(model: nn.Module, real: Real, seeds: Tensor, frames: int, noise: float = 0.0) -> dict:
    """What became of the rollouts that go on from seeds (starts, seen, dim)."""
    fps, each = model.fps, []
    sampling = {"noise": noise} if noise else {}
    for _, batch in rollouts.sampled(model, seeds, frames, seed=0, **sampling):
        each += [judged(features, model.encoding, real) for features in batch]
    horizon = frames / fps
    lasted = np.array([one.failed for one in each])
    alive = np.isinf(lasted)
    curve = metrics.survival(lasted, horizon)
    short = np.array([one.short for one in each])
    found = {
        "fps": fps, "rollouts": len(each), "seconds each": horizon, "alive": float(alive.mean()),
        "alive, 95 %": [float(curve.low[-1]), float(curve.high[-1])],
        "failed (s)": lasted.tolist(),
        "how": [min(one.failures, key=one.failures.get) if math.isfinite(one.failed) else None
                for one in each],
        "failed": _counts(one.failures for one in each),
        "median seconds until failure": float(np.median(lasted.clip(max=horizon))),
        "survival": {name: values.tolist() for name, values in curve._asdict().items()},
        f"first {SHORT} frames": {
            "failed": int(np.isfinite(short).sum()),
            "mean seconds until failure": float(short.clip(max=min(frames, SHORT) / fps).mean()),
            "latest (s)": float(short.max()),
            "poses before the latest (m)": each[int(short.argmax())].strip.tolist(),
        },
        "change": change_over_time([one.change[: max(0, one.sound - 1)] for one in each], frames, fps),
        "real change (m/s)": real.change,
    }  # fmt: skip
    elastic = np.array([min(one.whole.values()) for one in each])
    found[ELASTIC] = {
        "alive": float(np.isinf(elastic).mean()), "failed (s)": elastic.tolist(),
        "failed": _counts(one.whole for one in each),
        "median seconds until failure": float(np.median(elastic.clip(max=horizon))),
        "change": change_over_time([one.change for one in each], frames, fps),
    }  # fmt: skip
    end = shared(each, horizon, real)
    living = [one for one in each if math.isinf(one.failed)]
    again = [np.isfinite(one.period) for one in living]
    found["cycles"] = {
        "in a loop": int(sum(again)),
        "periods (s)": sorted(one.period for one, is_loop in zip(living, again, strict=True) if is_loop),
        "same end as another": int(sum(end)),
        "either, of those alive": float(np.logical_or(again, end).mean()) if living else None,
    }  # fmt: skip
    found["share their motion"] = {
        f"{at / 60:.3g} min": told_of(shared(each, at, real)) for at in each[0].tails
    }
    found["stagnations"] = stagnant([(one.pauses, one.sound / fps) for one in each])
    at_first = [one.head for one in each if one.failed > min(60, horizon)]
    at_last = [one.tails[horizon] for one in living]
    if at_first:
        found["acceleration over real, first minute"] = _lively(at_first, fps) / real.acceleration
    found["novelty"] = {"first minute": novelty(at_first, real), "end": novelty(at_last, real)}
    return found


def _counts(failures: Iterable[dict[str, float]]) -> dict[str, int]:
    """How many rollouts fail in each way."""
    failures = list(failures)
    return {kind: sum(math.isfinite(its[kind]) for its in failures) for kind in rollouts.KINDS}


def change_over_time(changes: Sequence[np.ndarray], frames: int, fps: float) -> dict:
    """Motion change over that of the training clips: a curve, its last minute, and all of it.

    changes : of each rollout (frames - 1,), or fewer if it diverged. It counts until then, and in
        the last minute with its mean.
    """
    at, minute = edges(frames), round(60 * fps)
    curve = [
        [change[a - 1 : b - 1].mean() for change in changes if len(change) >= b - 1]
        for a, b in zip(at[:-1], at[1:], strict=True)
    ]
    last = [_mean(change[-minute:] if len(change) == frames - 1 else change) for change in changes]
    return {
        "over real": [float(np.mean(piece)) if piece else None for piece in curve],
        "last minute": float(np.mean(last)),
        "whole": float(np.mean([_mean(change) for change in changes])),
    }


def _mean(change: np.ndarray) -> float:
    """0 of a rollout that diverged at once: it made no motion."""
    return float(change.mean()) if len(change) else 0.0


def shared(each: Sequence[Rollout], at: float, real: Real) -> list[bool]:
    """Of each rollout that has not failed at some second: is another in the same motion then?"""
    tails = [one.tails[at] for one in each if one.failed > at]
    if len(tails) < 2 or len(tails[0]) < 4 * real.judge.fps:
        return [False] * len(tails)
    groups = metrics.converged(
        torch.stack(tails), real.judge.limits.skeleton, real.judge.fps, real.tolerance
    )
    return (groups.bincount()[groups] > 1).tolist()


def told_of(with_others: Sequence[bool]) -> dict:
    return {"alive": len(with_others), "in the motion of another": sum(with_others)}


def stagnant(pauses: Sequence[tuple[list[tuple[float, float]], float]]) -> dict:
    """Stagnations of rollouts, each with the seconds for which it was watched.

    Of one that was cut off before it had lasted for `SOON`, nobody knows whether it would have.
    """
    lengths, recovered, cut = [], 0, 0
    for found, watched in pauses:
        for start, end in found:
            ended, lasted = end < watched - 1e-6, end - start
            cut += not ended and lasted < SOON
            recovered += ended and lasted <= SOON
            lengths.append(lasted)
    quantiles = np.quantile(lengths, [0.1, 0.5, 0.9, 1.0]).tolist() if lengths else []
    return {
        "number": len(lengths), "rollouts with any": sum(bool(found) for found, _ in pauses),
        "cut off": cut, f"recovered within {SOON:g} s": recovered,
        "seconds, 10 50 90 100 %": quantiles,
    }  # fmt: skip


def novelty(motions: Sequence[Tensor], real: Real) -> dict | None:
    """How far windows of motions are from the nearest training window; None of none."""
    fps = real.judge.fps
    poses = [real.normalizer(_poses(points, real.judge)) for points in motions]
    poses = [pose for pose in poses if len(pose) >= 2 * fps]
    if not poses:
        return None
    near = metrics.nearest_window_distance(
        poses, real.poses, fps, step=GIVEN_AWAY, reference_step=0
    ).distance
    middle, held = float(near.median()), float(real.held_out.median())
    return {
        "windows": len(near), "median distance": middle, "of held-out clips": held,
        "over that of held-out clips": middle / held,
        "replays": metrics.replay_share(near, real.held_out),
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
