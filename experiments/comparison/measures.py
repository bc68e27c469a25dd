"""What is measured of motion that a method made, start by start."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from motionlab import metrics
from motionlab.encodings import RootRelative
from motionlab.training.evaluation import measured
from motionlab.training.judging import critic

from ..common import rollouts
from ..rnn_gan import samples
from .begun import Begun
from .columns import AFTER, LONG, LONG_STARTS, MILLISECONDS, PIECE, SAMPLES, SECONDS, SHUFFLES
from .going_on import GoOn
from .real import Gait, Real
from .trainings import joints_alone, rows_of

SKATE, JERK = "foot skate (cm/s)", "jerk (m/s³)"


def sound(points: Tensor) -> list[bool]:
    """Which motions (motions, frames, joints, 3) are numbers throughout."""
    return points.isfinite().flatten(1).all(1).tolist()


def errors(made: Tensor, came: Tensor, fps: float) -> list[list[float]]:
    """Centimetres of each start at `MILLISECONDS`, mean over joints; infinite where there is no number."""
    good, rows = sound(made[:, : came.shape[1]]), []
    for said, true, whole in zip(made, came, good, strict=True):
        if whole:
            off = metrics.mean_joint_error(said[: len(true)], true)
            rows.append(metrics.at_milliseconds(off, fps, MILLISECONDS).tolist())
        else:
            rows.append([math.inf] * len(MILLISECONDS))
    return rows


def qualities(motions: Sequence[Tensor], gait: Gait) -> dict[str, list]:
    """Skate, jerk, manifold distance and Fréchet's moments of motions (frames, joints, 3) of numbers."""
    each = [measured(points, gait.real.skeleton, gait.real.fps) for points in motions]
    return {
        SKATE: [its[SKATE] for its in each],
        JERK: [its[JERK] for its in each],
        "manifold distance": gait.off_manifold(list(motions)),
        "moments": [gait.moments(points) for points in motions],
    }


def lasting(go_on: GoOn, real: Real, gaits: Sequence[Gait], frames: int = LONG) -> dict[str, dict]:
    """What became of long rollouts of each gait, all of them side by side."""
    starts = [
        gait.begun["test"][rollouts.spread_evenly(len(gait.begun["test"]), LONG_STARTS)]
        for gait in gaits
    ]
    together = Begun(torch.cat([some.rows for some in starts]), starts[0].encoding)
    made = go_on(together, frames, seed=0).split([len(some) for some in starts])
    return {gait.name: fates(points, real) for gait, points in zip(gaits, made, strict=True)}


def fates(made: Tensor, real: Real) -> dict:
    """When and how rollouts (rollouts, frames, joints, 3) failed."""
    failed, seconds = [real.judge.failures(p.contiguous()) for p in made], made.shape[1] / real.fps
    lasted = np.array([min(its.values()) for its in failed])
    curve = metrics.survival(lasted, seconds)
    return {
        "rollouts": len(failed), "seconds each": seconds,
        "alive": {"value": float(np.isinf(lasted).mean()), "low": float(curve.low[-1]),
                  "high": float(curve.high[-1])},
        "failed": {kind: sum(math.isfinite(its[kind]) for its in failed) for kind in rollouts.KINDS},
        "seconds until failure": lasted.tolist(),
    }  # fmt: skip


def variety(go_on: GoOn, real: Real, gait: Gait, count: int = SAMPLES) -> dict:
    """Spread of samples from one start over that of people who do one thing again."""
    fps, begun = real.fps, gait.begun["test"]
    speeds = torch.stack([metrics.speed(points, fps).mean() for points in begun.points])
    middle = int(speeds.argsort()[len(speeds) // 2])
    after, piece = round(AFTER * fps), round(PIECE[gait.name] * fps)
    made = go_on(begun[[middle] * count], after + piece, seed=0)
    found = [
        samples.quantities(points[after:], real.judge)
        for points, good in zip(made, sound(made), strict=True)
        if good
    ]
    known = real.people[gait.name].items()
    again = samples.same_again([np.array(v) for key, v in known if key[1].startswith(gait.actions)])
    ratios = (
        spread(np.array(found)) / spread(np.concatenate(again)) if found else np.full(3, np.nan)
    )
    ratios = np.nan_to_num(ratios)  # who takes no step has none that vary
    return {
        "samples": len(found), "of": count, "value": float(np.prod(ratios) ** (1 / len(ratios))),
        "each": dict(zip(samples.QUANTITIES, ratios.tolist(), strict=True)),
    }  # fmt: skip


def spread(values: np.ndarray) -> np.ndarray:
    """From the 10 % to the 90 % quantile of each quantity (motions, quantities), NaN left out; NaN if all
    are: who takes no step has no length of step."""
    columns = [column[~np.isnan(column)] for column in values.T]
    ends = [np.quantile(some, [0.1, 0.9]) if len(some) else (np.nan, np.nan) for some in columns]
    return np.array([high - low for low, high in ends])


def asked(gait: Gait, learned: Sequence[Tensor], made: Sequence[Tensor], seed: int) -> list[float]:
    """Of each test start the accuracy of a critic: its mean share of right answers about what was
    recorded and about what was made. It learns from validation clips and what was made of them.
    """
    encoding = RootRelative(joints_alone(gait.real.skeleton), gait.real.fps)
    rows = lambda motions: [rows_of(points).float() for points in motions]
    told = critic(
        encoding, (rows(gait.clips["val"]), rows(learned)), (rows(gait.clips["test"]), rows(made)),
        seed,
    )  # fmt: skip
    if len(made) == len(gait.clips["test"]):
        return ((told.real + told.made) / 2).tolist()
    return ((told.real.mean() + told.made) / 2).tolist()


def by_chance(accuracies: Sequence[float], shuffles: int = SHUFFLES, seed: int = 0) -> float:
    """How often a critic that knows nothing would be as often right: p of a permutation test.

    accuracies : of each start. Who exchanges what was recorded and what was made within a start turns
        its accuracy a into 1 - a.
    """
    off = np.asarray(accuracies) - 0.5
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(shuffles, len(off)))
    return float((1 + ((signs * off).mean(1) >= off.mean() - 1e-12).sum()) / (1 + shuffles))


def length(real: Real) -> int:
    """Frames of a sample."""
    return round(SECONDS * real.fps)


# -- recorded motion in the place of what is made ---------------------------------------------------


def told_apart(gait: Gait, learned: tuple, clips: tuple, seed: int) -> list[float]:
    """Accuracy of a critic that is to tell two lots of recorded clips apart, of each clip."""
    encoding = RootRelative(joints_alone(gait.real.skeleton), gait.real.fps)
    rows = lambda motions: [rows_of(points).float() for points in motions]
    told = critic(encoding, tuple(map(rows, learned)), tuple(map(rows, clips)), seed)
    return torch.cat([told.real, told.made]).tolist()


def nearest_goes_on(gait: Gait) -> Tensor:
    """What followed the seen frames of validation clips that were most like those of test clips, put where
    the test clips' bodies are: joints (starts, frames, joints, 3).
    """
    skeleton, seen = gait.real.skeleton, gait.begun["test"].rows.shape[1]
    some, came = round(gait.real.fps / 3), gait.came.shape[1]
    last = [clip[seen - some : seen] for clip in gait.clips["test"]]
    pool = [
        clip[at : at + some + came]
        for clip in gait.clips["val"]
        for at in range(0, len(clip) - some - came + 1, 3)
    ]
    near = lambda clips: torch.stack([metrics.heading_frame(c, skeleton)[0] for c in clips])
    ours, theirs = near(last).flatten(1), near([one[:some] for one in pool]).flatten(1)
    best = torch.cdist(ours.float(), theirs.float()).argmin(1).tolist()
    return torch.stack([
        moved_to(pool[i], points, some, skeleton)[some:]
        for i, points in zip(best, last, strict=True)
    ])  # fmt: skip


def moved_to(points: Tensor, where: Tensor, some: int, skeleton) -> Tensor:
    """Points (frames, joints, 3) turned and moved over the ground so that frame `some` - 1 stands, and
    faces, where the last frame of `where` does."""
    turn = metrics.facing(where, skeleton)[-1] - metrics.facing(points, skeleton)[some - 1]
    cos, sin = turn.cos(), turn.sin()
    x, y, z = (points - points[some - 1, 0] * points.new_tensor([1.0, 0.0, 1.0])).unbind(-1)
    turned = torch.stack([cos * x + sin * z, y, cos * z - sin * x], -1)
    return turned + where[-1, 0] * where.new_tensor([1.0, 0.0, 1.0])
