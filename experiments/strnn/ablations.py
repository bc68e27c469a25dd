"""What parts and lengths of an STRNN are worth, by manifold distance: the claims S1, S2, S8, S9, S10.

    python -m experiments.strnn.ablations [--data runs/everything.npz] [--list] [--only ROW ...]
        [--preset table|long|smoke] [--as-it-is] [--output results/strnn_ablations.json]

Trains a list of networks, each kept in runs/strnn_ablations/: stopped and started again, it goes on.
All make the same number of updates, 600 or, with the preset "long", 2000; what they took of time is
told beside. The first seed of all rows comes first. Then each goes on for 200 frames from prefixes of
test clips. How it is judged stands in claims.yaml.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from motionlab import metrics
from motionlab.models import Strnn
from motionlab.training import PRESETS, Prepared, Preset
from motionlab.training.checkpoints import load_weights
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

from ..common import record, rollouts, trainings
from ..common.trainings import Run
from . import extrapolation
from .rivals import METHODS, RivalPreset

FOLDER = Path("runs/strnn_ablations")
STARTS, FRAMES = 50, 200
POSES = 10  # of a rollout, that are kept to look at
FAR = 10.0  # at most; what has left all bounds would decide every mean

# A quarter of the paper's widths, and minutes a row.
TABLE = replace(
    PRESETS["strnn"]["table"], updates=600, decay=200, validate_every=200, warmup=50, quiet=300,
    smooth=0.0, alone=0, behind=0,
)  # fmt: skip
LONG = replace(TABLE, updates=2_000, decay=667, validate_every=500, quiet=1_000)
SMOKE = replace(TABLE, updates=4, decay=1, validate_every=2, batch=4, width=32, quiet=2)
BUDGETS = {"table": TABLE, "long": LONG, "smoke": SMOKE}
RESULTS = {"table": "results/strnn_ablations.json", "long": "results/strnn_ablations_long.json"}
LH = {"smooth": 0.1}
TEMPORAL = {"spatial": False, "residual": False}
SPATIOTEMP = {"residual": False}
MAIN = (0, 1, 2)


@dataclass(frozen=True)
class Row(trainings.Row):
    """Trainings of one kind."""

    seeds: tuple[int, ...] = (0,)
    hybrid: bool = False  # in three stages
    method: str = "strnn"


ROWS = (
    Row("Temporal_39_1_MSE", "the baseline: one frame is foretold", {**TEMPORAL, "predict": 1},
        seeds=MAIN),
    Row("Temporal_20_20_MSE", "as many are foretold as are read", TEMPORAL, seeds=MAIN),
    Row("SpatioTemp_20_20_LH", "with the spatial network and the cost of second differences",
        {**SPATIOTEMP, **LH}, seeds=MAIN),
    Row("Composite_20_20_HY", "the full model in three stages", LH, seeds=MAIN, hybrid=True),
    Row("Temporal_20_20_LH", "second differences cost", {**TEMPORAL, **LH}),
    Row("Temporal_30_10_LH", "30 read, 10 foretold", {**TEMPORAL, **LH, "predict": 10}),
    Row("Temporal_30_10_MSE", "30 read, 10 foretold", {**TEMPORAL, "predict": 10}),
    Row("Temporal_35_5_MSE", "35 read, 5 foretold", {**TEMPORAL, "predict": 5}),
    Row("Composite_20_20_LH", "the full model, all of it at once", LH),
    Row("Composite_10_10_HY", "windows of 20 frames", {**LH, "frames": 20, "predict": 10},
        hybrid=True),
    Row("Composite_5_5_HY", "windows of 10 frames", {**LH, "frames": 10, "predict": 5}, hybrid=True),
    Row("Dense_20_20_LH", "layers as large, without parts: ERD's", {**SPATIOTEMP, **LH,
        "spatial": "dense"}),
    Row("Bidirectional_20_20_LH", "plain RNN layers, one from each end", LH,
        method="bidirectional-rnn"),
    Row("unconditional", "Temporal_20_20_MSE, which hears true frames in training",
        {**TEMPORAL, "conditional": False}),
    Row("no noise", "Temporal_20_20_MSE without noise on what it reads", {**TEMPORAL, "noise": 0.0}),
    Row("steady noise", "Temporal_20_20_MSE, noise that does not shrink", {**TEMPORAL, "quiet": 0}),
    Row("narrow", "SpatioTemp_20_20_LH with a code of 32 numbers", {**SPATIOTEMP, **LH, "width": 32}),
    Row("forwards", "Temporal_20_20_MSE, whose decoder says the first frame first",
        {**TEMPORAL, "backward": False}),
    *(Row(method, "foretells one frame at a time", method=method) for method in METHODS),
)  # fmt: skip
# What is to be nearer to real motion, and than what.
PAIRS = {
    "S2": (
        ("Composite_20_20_HY", "Temporal_39_1_MSE"), ("Temporal_20_20_LH", "Temporal_20_20_MSE"),
        ("Temporal_30_10_LH", "Temporal_30_10_MSE"), ("Temporal_30_10_LH", "Temporal_39_1_MSE"),
        ("Temporal_20_20_MSE", "Temporal_39_1_MSE"), ("SpatioTemp_20_20_LH", "Temporal_20_20_LH"),
        ("Composite_20_20_HY", "SpatioTemp_20_20_LH"), ("Composite_20_20_HY", "Composite_20_20_LH"),
    ),
    "S8": (
        ("SpatioTemp_20_20_LH", "Dense_20_20_LH"),
        ("SpatioTemp_20_20_LH", "Bidirectional_20_20_LH"),
    ),
    "S9": (("Temporal_20_20_MSE", "unconditional"),),
    "S10-noise": (("Temporal_20_20_MSE", "no noise"), ("Temporal_20_20_MSE", "steady noise")),
    "S10-narrow": (("SpatioTemp_20_20_LH", "narrow"),),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default="runs/everything.npz")
    parser.add_argument("--preset", default="table", choices=tuple(BUDGETS))
    parser.add_argument("--only", nargs="+", metavar="ROW", choices=[row.name for row in ROWS])
    parser.add_argument("--seeds", type=int, default=3, help="of the main rows, at most")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--as-it-is", action="store_true", help="judge what is done, train nothing")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--output", help="by default the preset's of results/")
    chosen = parser.parse_args(arguments)
    output = chosen.output or RESULTS.get(chosen.preset)
    if not output:
        parser.error(f"the preset {chosen.preset} is not the result: name an --output")
    begin = time.perf_counter()
    runs = [run for run in in_order(chosen.only, chosen.preset) if run.seed < chosen.seeds]
    if chosen.list:
        trainings.show(runs)
        return
    data = in_body_frame(Prepared.find(chosen.data))
    for run in runs:
        if not run.done and not chosen.as_it_is:
            run.train(data, run.row.name)
    runs = [run for run in runs if run.done]
    result = {
        "preset": chosen.preset, "split": chosen.split, "starts": STARTS, "frames": FRAMES,
    } | judged([run for run in runs if run.row.method not in METHODS], data, chosen.split)  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, output)


# -- trainings ------------------------------------------------------------------------------------


def in_order(only: Sequence[str] | None = None, preset: str = "table") -> list[Run]:
    """All trainings, the first seed of every row first; the long ones without the rivals of S6."""
    runs = [
        Run(row, seed, preset_of(row, seed, preset), folder_of(preset) / row.name / f"seed-{seed}")
        for row in ROWS if only is None or row.name in only for seed in row.seeds
        if preset != "long" or row.method not in METHODS
    ]  # fmt: skip
    return sorted(runs, key=lambda run: run.seed)


def folder_of(preset: str) -> Path:
    """Where trainings are kept."""
    return FOLDER if preset == "table" else FOLDER / preset


def preset_of(row: Row, seed: int, name: str = "table") -> Preset:
    """The preset of a row's training; a tenth and a sixth of its updates are the last two stages."""
    base = BUDGETS[name]
    if row.method in METHODS:
        shared = {key: getattr(base, key) for key in Preset.__dataclass_fields__}
        return RivalPreset(**shared | {"noise": 0.0, "seed": seed}, method=row.method)
    if row.method != "strnn":
        base = type(PRESETS[row.method]["table"])(**vars(base))
    stages = {"alone": base.updates // 10, "behind": base.updates // 6} if row.hybrid else {}
    return replace(base, seed=seed, **stages, **row.changes)


def weights_of(run: Run) -> Path:
    """The weights that were best in validation."""
    return run.folder / run.preset.weights


# -- what they are worth --------------------------------------------------------------------------


def judged(runs: Sequence[Run], data: Prepared, split: str) -> dict:
    """Every training's numbers on the clips of a split, and the pairs of the claims."""
    clips = data.clips(split)
    kinds, real = extrapolation._sources(clips, data), extrapolation.real_of(data)
    chosen = extrapolation.long_clips(clips, kinds, STARTS, 20 + 20)
    starts = [len(clip) // 2 for clip in chosen]
    longest = max(run.preset.frames - run.preset.predict for run in runs)
    # networks that read more than 20 frames get more of the same clip
    seeds = torch.stack([clip[at - longest : at] for clip, at in zip(chosen, starts, strict=True)])
    rows: dict[str, dict] = {}
    seen = shown(kinds_of(chosen, clips, kinds))
    for run in runs:
        model, _ = load_weights(weights_of(run))
        row = rows.setdefault(run.row.name, {"what": run.row.what, "seeds": {}})
        if run.seed == 0:
            row["poses (m)"] = strip(model, seeds[seen], data)
        row["seeds"][str(run.seed)] = of_one(model, seeds, clips, data, real) | {
            "updates": run.made, "seconds of training": run.curve[-1]["seconds"],
            "validation": run.validation,
            "curve": {str(point["update"]): point["val"] for point in run.curve},
        }  # fmt: skip
    follows = [clip[at:][:FRAMES] for clip, at in zip(chosen, starts, strict=True)]
    follows = [data.normalizer(clip) for clip in follows if len(clip) >= 40]
    theirs = metrics.manifold_distance(follows, real.clips, data.encoding.fps)
    return {
        "rows": rows,
        "real": {"to real": float(theirs.mean()), "clips": len(follows)},
        "pairs": {
            claim: {f"{one} < {other}": compared(rows[one], rows[other]) for one, other in pairs
                    if one in rows and other in rows}
            for claim, pairs in PAIRS.items()
        },
    }  # fmt: skip


def kinds_of(chosen: Sequence[Tensor], clips: Sequence[Tensor], kinds: Sequence[str]) -> list[str]:
    """The source of each chosen clip."""
    of = {clip.data_ptr(): kind for clip, kind in zip(clips, kinds, strict=True)}
    return [of[clip.data_ptr()] for clip in chosen]


def shown(kinds: Sequence[str]) -> int:
    """Which prefix is looked at: the first of somebody who walks or runs."""
    return kinds.index("bandai-locomotion") if "bandai-locomotion" in kinds else 0


@torch.no_grad()
def strip(model: Strnn, seed: Tensor, data: Prepared) -> list:
    """Poses (POSES, joints, 3) of what follows frames (encode, dim), in metres, kept in place."""
    made = model.extrapolate(seed[None], FRAMES)[0].nan_to_num(0.0, 10.0, -10.0).clamp(-10.0, 10.0)
    points = data.encoding._points(made[:: FRAMES // POSES])
    return (points * 1000).round().div(1000).tolist()


@torch.no_grad()
def of_one(
    model: Strnn, seeds: Tensor, clips: Sequence[Tensor], data: Prepared,
    real: extrapolation.Real,
) -> dict:  # fmt: skip
    """Errors on windows, and what becomes of `FRAMES` frames that go on from seeds."""
    fps, encoding = data.encoding.fps, data.encoding
    made = model.extrapolate(seeds, FRAMES).nan_to_num(0.0, 1e3, -1e3).clamp(-1e3, 1e3)
    ours = data.normalizer(made)
    distance = metrics.manifold_distance(ours, real.clips, fps).clamp(max=FAR)
    theirs = [data.normalizer(clip[:FRAMES]) for clip in clips if len(clip) >= 40]
    points = [rollouts.points_of(encoding, some) for some in made]
    moves = [float(extrapolation.changes(some, fps).mean()) / real.change for some in points]
    found = {
        "errors": errors(model, clips, data), "to real": distance.tolist(),
        "of real": float(metrics.manifold_distance(theirs, ours, fps).mean()),
        "too far": int((distance >= FAR).sum()),
        "movement over real": float(torch.tensor(moves).median()),
    }  # fmt: skip
    if model.predict >= 4:
        jumps = [metrics.seam_jumps(some, model.predict).steps for some in points]
        found["steps across seams"] = float(torch.tensor([float(its) for its in jumps]).median())
    return found


def errors(model: Strnn, clips: Sequence[Tensor], data: Prepared) -> dict[str, float]:
    """Mean squared error of a channel, normalised: of decoded frames, of predicted ones, of all."""
    off = []
    model.eval()
    for windows in Windows(clips, model.frames).tiles(256):
        said = model(windows[:, : model.encode])
        off.append((data.normalizer(said) - data.normalizer(windows)).square().mean(-1))
    each = torch.cat(off).mean(0)
    return {
        "decoded": float(each[: model.encode].mean()),
        "predicted": float(each[model.encode :].mean()), "all": float(each.mean()),
    }  # fmt: skip


def compared(one: dict, other: dict) -> dict:
    """How much nearer one row is than another, over prefixes, by the seeds that both have."""
    both = [seed for seed in one["seeds"] if seed in other["seeds"]]
    apart = torch.stack([
        torch.tensor(one["seeds"][seed]["to real"]) - torch.tensor(other["seeds"][seed]["to real"])
        for seed in both
    ])  # fmt: skip
    interval = metrics.bootstrap(apart.mean(0).tolist())
    by_seed = apart.mean(1).tolist()
    low, high = interval.low, interval.high
    better = high < 0 and max(by_seed) < 0
    worse = low > 0 and min(by_seed) > 0
    return {
        "difference": interval, "by seed": by_seed,
        "found": "better" if better else "worse" if worse else "undecided",
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
