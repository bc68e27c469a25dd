"""Motion of an STRNN under control along paths: the claim S5, and speed for S7.

    python -m experiments.strnn.control WEIGHTS [--data everything] [--split val] [--starts 10]
        [--frames 1000] [--output results/strnn_control.json]

Each run begins in a clip of walking and goes on along a path at the clip's speed. Rows differ in what
is fitted, the weights or the encoder's state, and in what costs. Then `to_motion` puts the runs of the
first row on a skeleton, which ends errors of bones.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor

import motionlab
from motionlab import metrics
from motionlab.contacts import label_positions
from motionlab.errors import DataError
from motionlab.models import Strnn
from motionlab.paths import Path as Way
from motionlab.paths import Piece
from motionlab.solvers.manifold_control import RATES, Controlled, Costs, along, control
from motionlab.training import Prepared
from motionlab.training.strnn import in_body_frame

from ..common import record, rollouts
from ..rnn_gan.curves import bent, circle, cut, sine

SPEEDS = 0.8, 1.8  # m/s, of clips in which runs begin
RADIUS = 2.0  # m
PUT_ON = 4  # runs that are put on a skeleton by IK
ROWS = {
    "weights": {},
    "weights, control alone": {"costs": Costs(bones=0.0, contacts=0.0)},
    "state": {"fit": "state"},
    "state, control alone": {"fit": "state", "costs": Costs(bones=0.0, contacts=0.0)},
    "no control": {"fit": "state", "steps": 0},
}


class Run(NamedTuple):
    """What a run begins with: frames (encode, dim), the path, and m/s along it."""

    seed: Tensor
    way: Way
    speed: float


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--data", default="everything")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--frames", type=int, default=1_000)
    parser.add_argument("--output", default="results/strnn_control.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model = motionlab.load(chosen.weights)
    if not isinstance(model, Strnn):
        raise DataError(f"{chosen.weights}: is a {type(model).__name__}, no STRNN.")
    data = in_body_frame(Prepared.find(chosen.data)).matching(model.encoding)
    runs = runs_of(data, chosen.split, chosen.starts, model.encode, chosen.frames)
    judge = rollouts.judge_of(data)
    rows = {}
    for title, how in ROWS.items():
        rows[title], made = of_one(model, runs, chosen.frames, judge, **how)
        if title == "weights":
            few = Controlled(made.features[:PUT_ON], made.places[:PUT_ON])
            rows["weights, put on the skeleton"] = put_on(model, few, runs)
    result = {
        "split": chosen.split, "starts": chosen.starts, "frames": chosen.frames,
        "rates": RATES, "costs": Costs()._asdict(), "steps": 20,
        "weights": record.about_weights(model, chosen.weights), "rows": rows,
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def paths(length: float) -> dict[str, Tensor]:
    """Curves (n, 2) of so many metres, which begin at the origin and lead ahead."""
    half = math.pi * RADIUS
    return {
        "line": torch.tensor([[0.0, 0.0], [0.0, length]], dtype=torch.float64),
        "circle": circle(RADIUS, length),
        "sine": sine(RADIUS / 2, 3 * RADIUS, length),
        "half circles": cut(
            bent(lambda arc: torch.where(arc % (2 * half) < half, 1.0, -1.0) / RADIUS, length),
            length,
        ),
    }


def runs_of(data: Prepared, split: str, starts: int, encode: int, frames: int) -> list[Run]:
    """The paths in turn, each from the middle of another clip of walking, spread over all there are.

    Raises DataError if there is none.
    """
    names = [n for n, its in zip(data.names, data.splits, strict=True) if its == split]
    ahead, walks = data.encoding.slices["root"].start + 7, []
    for name, clip in zip(names, data.clips(split), strict=True):
        middle = clip[len(clip) // 2 - encode :][:encode]
        if "walk" in name.lower() and len(clip) >= 2 * encode:
            speed = float(middle[:, ahead].mean())
            walks += [(middle, speed)] * (SPEEDS[0] < speed < SPEEDS[1])
    if not walks:
        raise DataError(f"No clip of walking among {len(names)} of the split {split}.")
    found = []
    for number, i in enumerate(rollouts.spread_evenly(len(walks), starts)):
        seed, speed = walks[i]
        curves = list(paths(1.2 * speed * frames / data.encoding.fps + 1.0).values())
        found.append(Run(seed, Way.through(curves[number % len(curves)]), speed))
    return found


def of_one(
    model: Strnn, runs: Sequence[Run], frames: int, judge: rollouts.Judge, **how
) -> tuple[dict, Controlled]:  # fmt: skip
    """One row, and the motion."""
    before = {name: its.clone() for name, its in model.state_dict().items()}
    seeds = torch.stack([run.seed for run in runs])
    wish = along([run.way for run in runs], torch.tensor([run.speed for run in runs]), model.fps)
    begin = time.process_time()
    made = control(model, seeds, wish, frames, **how)
    seconds = time.process_time() - begin
    restored = all(torch.equal(its, before[name]) for name, its in model.state_dict().items())
    points = model.encoding.positions(made.features, made.places)
    each = [told(some, run, model) for some, run in zip(points, runs, strict=True)]
    failed = [min(judge.failures(some).values()) for some in points]
    alone = along([runs[0].way], torch.tensor([runs[0].speed]), model.fps)
    begin = time.process_time()
    few = min(frames, 200)
    control(model, runs[0].seed[None], alone, few, **how)
    single = few / (time.process_time() - begin)
    median = lambda key: float(torch.tensor([row[key] for row in each]).nanmedian())
    far = [row["root to path (cm)"] for row in each]
    found = {
        "runs": len(runs), "alive": sum(map(math.isinf, failed)) / len(runs),
        "weights restored": restored,
        "root to path, median (cm)": median("root to path (cm)"),
        "root to path, worst (cm)": max(far),
        "frames a second, all": len(runs) * frames / seconds,
        "frames a second, one character": single,
    }  # fmt: skip
    return found | {key: median(key) for key in each[0] if key != "root to path (cm)"}, made


def told(points: Tensor, run: Run, model: Strnn) -> dict[str, float]:
    """Of one run, positions (frames, points, 3)."""
    skeleton, fps = model.encoding.skeleton, model.fps
    ground = points[:, 0][:, [0, 2]].double()
    piece = Piece(run.way.places[None], run.way.arcs[None])
    off = ground - piece.nearest(ground[None]).places[0]
    bones = metrics.bone_length_error(points, skeleton)
    down = label_positions(points, skeleton, fps)
    change = metrics.motion_change(points - points[:, :1], fps)
    return {
        "root to path (cm)": 100 * float(off.square().sum(1).mean().sqrt()),
        "speed over asked": float(metrics.speed(points, fps).mean()) / run.speed,
        "foot skate (cm/s)": float(metrics.foot_skate(points, down, skeleton, fps)),
        "bones, mean (cm)": float(bones.mean), "bones, worst (cm)": float(bones.worst),
        "acceleration (m/s²)": float(metrics.acceleration(points, fps)),
        "movement (m/s)": float(change.mean()),
        "movement, last third, over first": float(
            change[-len(change) // 3 :].mean() / change[: len(change) // 3].mean()
        ),
    }  # fmt: skip


def put_on(model: Strnn, made: Controlled, runs: Sequence[Run]) -> dict[str, float]:
    """Means over runs, when IK has put them on the skeleton."""
    rows = []
    for features, place, run in zip(made.features, made.places, runs, strict=False):
        motion = model.encoding.to_motion(features, place.tolist())
        rows.append(told(motion.positions(), run, model))
    return {key: sum(row[key] for row in rows) / len(rows) for key in rows[0]}


if __name__ == "__main__":
    record.run(main)
