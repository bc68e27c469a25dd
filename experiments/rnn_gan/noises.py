"""What is made wrong on purpose for W7, on which clips, and what is measured of what was cleaned."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Generator, Tensor

from motionlab import Motion, Skeleton, corrupt, metrics
from motionlab.datasets import registry
from motionlab.feet import contacts
from motionlab.training import Prepared

from ..common.rollouts import spread_evenly
from ..data.everything_table import kind_of

FRAMES = 90  # of a piece, 3 s
LOW, MID, HIGH = (0.01, 0.04), (0.02, 0.08), (0.04, 0.16)  # m, rad
MEMORY = 0.2  # seconds
UNSEEN = ("dance", "martial arts", "basketball")  # kinds that `locomotion` has not
KINDS = ("walking", "running", "unseen")


class Case(NamedTuple):
    """A piece of motion, what was seen of it, and what is known about that.

    missing : bool (frames,) or (frames, joints), known to all; None: nothing.
    hit : bool (frames, joints), where errors are looked at by themselves; None: nowhere.
    level : metres, radians, the noise that a method may be told.
    """

    truth: Motion
    seen: Motion
    missing: Tensor | None
    hit: Tensor | None
    level: tuple[float, float]


def _white(level: tuple[float, float], memory: float = 0.0):
    def make(truth: Motion, chance: Generator) -> Case:
        seen = corrupt.tremble(truth, *level, memory=memory, generator=chance)
        return Case(truth, seen, None, None, level)

    return make


def _outliers(share: float):
    def make(truth: Motion, chance: Generator) -> Case:
        seen = corrupt.tremble(truth, *MID, generator=chance)
        seen, wrong = corrupt.outliers(seen, share, generator=chance)
        return Case(truth, seen, None, _all(wrong, truth), MID)

    return make


def _lost(lose):
    """Low noise, and something that is not there."""

    def make(truth: Motion, chance: Generator) -> Case:
        seen = corrupt.tremble(truth, *LOW, generator=chance)
        seen, missing = lose(seen, generator=chance)
        return Case(truth, seen, missing, _all(missing, truth), LOW)

    return make


def _swaying(truth: Motion, chance: Generator) -> Case:
    seen = corrupt.sway(corrupt.tremble(truth, *LOW, generator=chance), generator=chance)
    return Case(truth, seen, None, None, LOW)


NOISES = {
    "white, low": _white(LOW),
    "white, mid": _white(MID),
    "white, high": _white(HIGH),
    "with a memory": _white(MID, MEMORY),
    "outliers, 1 %": _outliers(0.01),
    "outliers, 5 %": _outliers(0.05),
    "dropped frames": _lost(corrupt.dropped),
    "gap": _lost(corrupt.gap),
    "lost foot": _lost(corrupt.lost_foot),
    "swaying": _swaying,
}


def pieces(data: Prepared, kind: str, split: str, count: int) -> list[Motion]:
    """The middles of clips of a kind, FRAMES long, at most `count`, evenly over the table."""
    table = {f"{clip.source}/{clip.name}": clip for clip in registry.members("everything")}
    clips = zip(data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True)
    found = [
        (name, rows) for name, its, rows in clips
        if its == split and name in table and len(rows) >= FRAMES and is_kind(table[name], kind)
    ]  # fmt: skip
    cut = []
    for index in spread_evenly(len(found), count):
        name, rows = found[index]
        first = (len(rows) - FRAMES) // 2
        cut.append(data.encoding.to_motion(rows[first : first + FRAMES], name=name))
    return cut


def is_kind(clip: registry.Clip, kind: str) -> bool:
    if kind == "unseen":
        return kind_of(clip) in UNSEEN
    return clip.action == {"walking": "walk", "running": "run"}[kind]


def cases(truths: Sequence[Motion], kind: str, noise: str, split: str) -> list[Case]:
    """Each piece with noise of its own, the same in every run."""
    made = []
    for index, truth in enumerate(truths):
        seed = zlib.crc32(f"{kind}, {noise}, {split}, {index}".encode())
        made.append(NOISES[noise](truth, Generator().manual_seed(seed)))
    return made


def _all(mask: Tensor, motion: Motion) -> Tensor:
    """A mask of frames as one of frames and joints."""
    return mask if mask.ndim == 2 else mask[:, None].expand(-1, motion.skeleton.joints)


# -- measures -------------------------------------------------------------------------------------


def measure(found: Motion, case: Case) -> dict[str, float]:
    """How far it is from the truth, how smooth, and what its feet do."""
    points, truth = found.positions(), case.truth.positions()
    skeleton, fps = found.skeleton, found.fps
    off = 100 * (points - truth).norm(dim=-1)
    about = lambda positions: positions - positions[:, :1]
    down = contacts.label(case.truth)
    labels = contacts.label_positions(points, skeleton, fps)
    second = slice(-round(fps), None)
    drift = (points - truth)[second, 0][:, [0, 2]].mean(0)
    result = {
        "joint error (cm)": float(off.mean()),
        "joint error about the hips (cm)": float(
            100 * (about(points) - about(truth)).norm(dim=-1)[:, 1:].mean()
        ),
        "acceleration over the truth's": _over(metrics.acceleration, points, truth, fps),
        "jerk over the truth's": _over(metrics.jerk, points, truth, fps),
        "foot skate (cm/s)": float(metrics.foot_skate(points, down, skeleton, fps)),
        "contact F1": contacts.agreement(labels, down)["all"]["f1"],
        "root drift (cm)": float(100 * drift.norm()),
    }
    if case.hit is not None:
        result["error where it was hit (cm)"] = float(off[moved_by(case.hit, skeleton)].mean())
    return result


def moved_by(joints: Tensor, skeleton: Skeleton) -> Tensor:
    """Points, bool (frames, points), that lie elsewhere if these joints (frames, joints) turn wrongly.

    The root's own place counts as turned with it.
    """
    moved = [joints[:, 0]]
    turned = [joints[:, 0]]
    for point, parent in enumerate(skeleton.point_parents[1:], start=1):
        moved.append(turned[parent])
        if point < skeleton.joints:
            turned.append(turned[parent] | joints[:, point])
    return torch.stack(moved, 1)


def _over(metric, points: Tensor, truth: Tensor, fps: float) -> float:
    return float(metric(points, fps) / metric(truth, fps))
