"""Z6: does a network that learned two dances mix them? A classifier says which one it dances when.

    python -m experiments.aclstm.hybrid [--model aclstm-hybrid]

What is measured and how it is judged stands in claims.yaml.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

import motionlab
from motionlab import metrics
from motionlab.weights import find

from ..common import record, rollouts
from . import dances
from .rollouts import LASTING

STYLES = ("indian", "salsa")
SECONDS, STEP = 2.0, 0.5  # of a window, and from one to the next of those that are learned from
MINUTE = 60.0
SHRINK = 1e-2  # weight of the squared coefficients beside the mean loss


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="aclstm-hybrid", help="shipped name, or file of weights")
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=MINUTE, help="of each rollout")
    parser.add_argument("--output", default="results/dances_hybrid.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = dances.of("hybrid", model.fps)
    clips = {
        split: [
            (STYLES.index(style), data.encoding.positions(clip))
            for clip, name in zip(data.clips(split), _names(data, split), strict=True)
            for style in STYLES if style in name
        ]
        for split in ("train", "val", "test")
    }  # fmt: skip
    skeleton, fps = data.encoding.skeleton, model.fps
    learned, labels = windows_of(clips["train"], skeleton, fps)
    is_salsa = logistic(learned, labels)
    held_out, truth = windows_of(clips["val"] + clips["test"], skeleton, fps)
    right = (is_salsa(held_out) > 0.5) == truth
    each = [float(right[truth == number].float().mean()) for number in range(len(STYLES))]

    seeds = dances.seeds("hybrid", chosen.starts, fps)
    judge = replace(rollouts.judge_of(data), lasting=LASTING)
    said, whole = [], []
    for _, batch in rollouts.sampled(model, seeds.seen, round(chosen.seconds * fps), seed=0):
        for features in batch:
            points = rollouts.points_of(model.encoding, features)
            finite = points.isfinite().flatten(1).all(1)
            said.append(is_salsa(described(points[finite], skeleton, fps, SECONDS)))
            failed = min(min(judge.failures(points).values()), chosen.seconds)
            whole.append(said[-1][: int(failed / SECONDS)])
    result = {
        "weights": record.about_weights(model, path), "seconds of a rollout": chosen.seconds,
        "learned from": _counts(labels), "held out": _counts(truth),
        "right": dict(zip(STYLES, each, strict=True)) | {"mean": sum(each) / len(each)},
        **mixed(said), "until they fail": mixed(whole),
        "rollouts": [
            {"begins in": clip, "salsa": [round(float(p), 3) for p in its]}
            for clip, its in zip(seeds.clips, said, strict=True)
        ],
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def _names(data, split: str) -> list[str]:
    return [name for name, its in zip(data.names, data.splits, strict=True) if its == split]


def _counts(labels: Tensor) -> dict[str, int]:
    return {style: int((labels == number).sum()) for number, style in enumerate(STYLES)}


# -- the classifier -------------------------------------------------------------------------------


def windows_of(clips: Sequence[tuple[int, Tensor]], skeleton, fps: float) -> tuple[Tensor, Tensor]:
    """What describes windows (windows, dim) of clips, and the numbers of their styles."""
    found = [(number, described(points, skeleton, fps, STEP)) for number, points in clips]
    labels = torch.cat([torch.full((len(rows),), number) for number, rows in found])
    return torch.cat([rows for _, rows in found]), labels


def described(points: Tensor, skeleton, fps: float, step: float) -> Tensor:
    """Mean places and deviations of points in the body's frame, and their mean speeds.

    One row for each window of points (frames, points, 3), one every `step` seconds.
    """
    length, stride = round(SECONDS * fps), round(step * fps)
    if len(points) < length:
        return points.new_zeros(0, 7 * points.shape[1])
    pose = metrics.heading_frame(points, skeleton)[0]
    pose = pose.unfold(0, length, stride)  # (windows, points, 3, frames)
    speed = points.unfold(0, length, stride).diff(dim=-1).norm(dim=2).mean(-1) * fps
    return torch.cat([pose.mean(-1).flatten(1), pose.std(-1).flatten(1), speed], dim=1)


def logistic(rows: Tensor, labels: Tensor) -> Callable[[Tensor], Tensor]:
    """Logistic regression: from rows (n, dim) to the chance that each is of style 1.

    Both styles weigh alike, however many windows there are of each.
    """
    mean, std = rows.mean(0), rows.std(0).clamp(min=1e-3)  # a millimetre
    inputs, aims = (rows - mean) / std, labels.float()
    share = aims.mean()
    weigh = torch.where(aims > 0, 0.5 / share, 0.5 / (1 - share))
    weights = torch.zeros(rows.shape[1] + 1, requires_grad=True)
    optimizer = torch.optim.LBFGS([weights], max_iter=200, line_search_fn="strong_wolfe")

    def loss() -> Tensor:
        optimizer.zero_grad()
        said = inputs @ weights[:-1] + weights[-1]
        value = binary_cross_entropy_with_logits(said, aims, weigh)
        value = value + SHRINK * weights[:-1].square().sum()
        value.backward()
        return value

    optimizer.step(loss)
    found = weights.detach()
    return lambda new: (((new - mean) / std) @ found[:-1] + found[-1]).sigmoid()


# -- what the rollouts do -------------------------------------------------------------------------


def mixed(said: Sequence[Tensor]) -> dict:
    """Shares of the windows of all rollouts, and of the rollouts that visit both styles.

    said : chances (windows,) of salsa, of windows one after the other. To visit is to stay for two
        windows in a row.
    """
    salsa = [(chances > 0.5).tolist() for chances in said]
    total = sum(map(len, salsa))
    share = sum(map(sum, salsa)) / total if total else 0.0
    visits = lambda its, style: any(a == b == style for a, b in zip(its, its[1:], strict=False))
    both = [visits(its, True) and visits(its, False) for its in salsa]
    return {
        "windows": total,
        "share of windows": {"indian": 1 - share if total else 0.0, "salsa": share},
        "visit both": sum(both) / len(both),
    }


if __name__ == "__main__":
    record.run(main)
