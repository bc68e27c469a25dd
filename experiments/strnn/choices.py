"""Three choices of STRNN's authors: LSTM over GRU, no attention, positions over angles. Claims S10.

    python -m experiments.strnn.choices [--data runs/everything.npz] [--preset table|smoke] [--list]
        [--seeds 2] [--as-it-is] [--split test] [--output results/strnn_choices.json]

Temporal_20_20_MSE of `experiments.strnn.ablations` beside the same with one choice made otherwise, kept
in runs/strnn_choices/: stopped and started again, a training goes on. Updates, windows, frames, noise
and width are equal; the number of weights is told. How it is judged stands in claims.yaml.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from motionlab import metrics
from motionlab.encodings import BodyFrame, Encoding
from motionlab.models import Strnn
from motionlab.training import Prepared
from motionlab.training.checkpoints import read_checkpoint
from motionlab.training.strnn import StrnnPreset, in_body_frame
from motionlab.training.windows import Windows

from ..common import record, rollouts
from ..common.trainings import Run, show
from . import ablations, extrapolation
from .ablations import FAR, FRAMES, POSES, STARTS, Row
from .other_decoders import AttentiveStrnn, GruStrnn

FOLDER = Path("runs/strnn_choices")
PLAIN = "Temporal_20_20_MSE"
WINDOW = 20  # frames that all rows read, and foretell
SEEDS = 2  # what 40 minutes of a shared core hold
ROWS = (
    Row("GRU", "GRU cells instead of LSTM cells"),
    Row("attention", "decoder and predictor look back at all frames that were read"),
    Row("angles", "frames are joint angles, not positions"),
)
KINDS = {"GRU": GruStrnn, "attention": AttentiveStrnn}
# words in names; of the first prefix from such a clip poses are kept to look at
LOOKED_AT = {"walk": "_walk_", "dance": "salsa"}


@dataclass(frozen=True)
class ChoicePreset(StrnnPreset):
    """Settings of a training of one of `ROWS`."""

    choice: str = "GRU"

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of a split, of the rows that data have."""
        return Windows(data.clips(split), self.frames)

    def model(self, data: Prepared) -> Strnn:
        """An untrained network for some data."""
        sizes = self.width, self.frames - self.predict, self.predict
        if self.choice in KINDS:
            return KINDS[self.choice](data.encoding, data.normalizer, *sizes)
        return Strnn(
            data.encoding, data.normalizer, *sizes, spatial=False, residual=False, drop=self.drop
        )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default="runs/everything.npz")
    parser.add_argument("--preset", default="table", choices=("table", "smoke"))
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--as-it-is", action="store_true", help="judge what is done, train nothing")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--output", help="by default that of results/")
    chosen = parser.parse_args(arguments)
    output = chosen.output or ("results/strnn_choices.json" if chosen.preset == "table" else None)
    if not output:
        parser.error(f"the preset {chosen.preset} is not the result: name an --output")
    begin = time.perf_counter()
    runs = in_order(chosen.preset, chosen.seeds)
    if chosen.list:
        show(runs)
        return
    angles = Prepared.find(chosen.data)
    body = in_body_frame(angles)
    for run in runs:
        if not run.done and not chosen.as_it_is:
            run.train(rows_for(run, angles, body), run.row.name)
    runs = [run for run in runs if run.done]
    result = {"preset": chosen.preset, "split": chosen.split, "starts": STARTS, "frames": FRAMES}
    result |= judged(runs, angles, body, chosen.split)
    record.write(record.provenance(begin, 0, body) | result, output)


# -- trainings ------------------------------------------------------------------------------------


def in_order(preset: str = "table", seeds: int = SEEDS) -> list[Run]:
    """All trainings, those of a seed side by side; those without a choice are of the ablations."""
    plain = [run for run in ablations.in_order([PLAIN], preset) if run.seed < seeds]
    folder = FOLDER if preset == "table" else FOLDER / preset
    others = [
        Run(row, run.seed, ChoicePreset(**vars(run.preset) | {"choice": row.name}),
            folder / row.name / f"seed-{run.seed}")
        for run in plain for row in ROWS
    ]  # fmt: skip
    return sorted(plain + others, key=lambda run: run.seed)


def rows_for(run: Run, angles: Prepared, body: Prepared) -> Prepared:
    """The clips as a row learns from them."""
    return angles if run.row.name == "angles" else body


def trained(run: Run, data: Prepared) -> Strnn:
    """The network of a training, with the weights that were best in validation."""
    model = run.preset.model(data)
    model.load_state_dict(read_checkpoint(ablations.weights_of(run))[0])
    return model.eval()


# -- what they are worth --------------------------------------------------------------------------


@torch.no_grad()
def judged(runs: Sequence[Run], angles: Prepared, body: Prepared, split: str) -> dict:
    """Every training's numbers on the clips of a split, and the pairs of the claims."""
    clips, real = body.clips(split), extrapolation.real_of(body)
    kinds = extrapolation._sources(clips, body)
    places = {clip.data_ptr(): i for i, clip in enumerate(clips)}
    chosen = extrapolation.long_clips(clips, kinds, STARTS, 2 * WINDOW)  # as in the ablations
    which = [places[clip.data_ptr()] for clip in chosen]
    starts = [len(clip) // 2 for clip in chosen]
    named = [name for name, its in zip(body.names, body.splits, strict=True) if its == split]
    looked_at = first_of([named[i] for i in which])
    rows: dict[str, dict] = {}
    for run in runs:
        data = rows_for(run, angles, body)
        model, own = trained(run, data), data.clips(split)
        seeds = torch.stack([own[i][at - WINDOW : at] for i, at in zip(which, starts, strict=True)])
        made = in_body(model.extrapolate(seeds, FRAMES), data.encoding, body.encoding)
        weights = sum(its.numel() for its in model.parameters())
        row = rows.setdefault(run.row.name, {"what": run.row.what, "weights": weights, "seeds": {}})
        if run.seed == 0:
            row["poses (m)"] = {name: poses(made[i], body) for name, i in looked_at.items()}
        row["seeds"][str(run.seed)] = (
            of_rollouts(made, clips, body, real, data is body)
            | of_windows(model, own, clips, body)
        ) | {
            "updates": run.made, "seconds of training": run.curve[-1]["seconds"],
            "loss in training": run.curve[-1]["train"], "validation": run.validation,
        }  # fmt: skip
        print(run.folder, flush=True)
    follows = [clip[at:][:FRAMES] for clip, at in zip(chosen, starts, strict=True)]
    return {
        "rows": rows,
        "real": of_real([clip for clip in follows if len(clip) >= 2 * WINDOW], body, real),
        "pairs": {
            f"{PLAIN} < {row.name}": compared(rows[PLAIN], rows[row.name], row.name)
            for row in ROWS if {row.name, PLAIN} <= rows.keys()
        },
    }  # fmt: skip


def first_of(names: Sequence[str]) -> dict[str, int]:
    """Which of some clips are looked at."""
    each = {kind: [word in name for name in names] for kind, word in LOOKED_AT.items()}
    return {kind: its.index(True) for kind, its in each.items() if any(its)}


def in_body(features: Tensor, encoding: Encoding, body: BodyFrame) -> Tensor:
    """Features (batch, frames, dim) as rows of `BodyFrame`; what is not finite becomes far away."""
    features = features.nan_to_num(0.0, 1e3, -1e3).clamp(-1e3, 1e3)
    if isinstance(encoding, BodyFrame):
        return features
    return torch.stack([body.encode(encoding.to_motion(some)) for some in features])


def without_contacts(features: Tensor, body: Prepared) -> Tensor:
    """Normalised (..., kept) without contacts, which come last."""
    first = body.encoding.slices["contacts"].start
    return body.normalizer(features)[..., body.normalizer.kept < first]


def of_rollouts(
    made: Tensor, clips: Sequence[Tensor], body: Prepared, real: extrapolation.Real,
    contacts: bool = True,
) -> dict:  # fmt: skip
    """Of rows (starts, frames, dim): nearness to real motion, with and without contacts, and liveliness.

    contacts : False: not all four are said, so that there is no distance with them.
    """
    fps, long = body.encoding.fps, [clip[:FRAMES] for clip in clips if len(clip) >= 2 * WINDOW]
    points = [rollouts.points_of(body.encoding, some) for some in made]
    bare = [without_contacts(clip, body) for clip in long]
    distance = lambda ours, theirs: metrics.manifold_distance(ours, theirs, fps).clamp(max=FAR)
    failures = [real.judge.failures(some) for some in points]
    whole = {"to real": distance(body.normalizer(made), real.clips).tolist()} if contacts else {}
    return whole | {
        "to real, without contacts":
            distance(without_contacts(made, body), bare_of(body, real)).tolist(),
        "of real, without contacts": float(distance(bare, without_contacts(made, body)).mean()),
        "failed": {kind: sum(its[kind] < FRAMES / fps for its in failures) for kind in rollouts.KINDS},
    } | lively(points, body, real)  # fmt: skip


def bare_of(body: Prepared, real: extrapolation.Real) -> list[Tensor]:
    """The training clips of the manifold without contacts, which come last."""
    bare = int((body.normalizer.kept < body.encoding.slices["contacts"].start).sum())
    return [clip[:, :bare] for clip in real.clips]


def lively(points: Sequence[Tensor], body: Prepared, real: extrapolation.Real) -> dict:
    """How much joints (frames, joints, 3) move and accelerate about the root; medians over rollouts.

    Acceleration within windows leaves out the seams where a network reads anew.
    """
    fps = body.encoding.fps
    moves = [float(extrapolation.changes(some, fps).mean()) for some in points]
    bent = lambda some: float(metrics.acceleration(some - some[:, :1], fps))
    bends = [bent(some) for some in points]
    within = [statistics.fmean(bent(its) for its in some.split(WINDOW) if len(its) == WINDOW)
              for some in points]  # fmt: skip
    return {
        "movement (m/s)": statistics.median(moves),
        "acceleration (m/s²)": statistics.median(bends),
        "acceleration within windows (m/s²)": statistics.median(within),
        "movement over real": statistics.median(moves) / real.change,
    }


def of_real(follows: Sequence[Tensor], body: Prepared, real: extrapolation.Real) -> dict:
    """The same of what people did next, as far as it has a meaning there."""
    fps, points = body.encoding.fps, [body.encoding.positions(clip) for clip in follows]
    far = metrics.manifold_distance([body.normalizer(clip) for clip in follows], real.clips, fps)
    bare = [without_contacts(clip, body) for clip in follows]
    bare = metrics.manifold_distance(bare, bare_of(body, real), fps)
    return {
        "clips": len(follows), "to real": float(far.mean()),
        "to real, without contacts": float(bare.mean()),
    } | lively(points, body, real)  # fmt: skip


def of_windows(
    model: Strnn, own: Sequence[Tensor], clips: Sequence[Tensor], body: Prepared
) -> dict:  # fmt: skip
    """Errors on windows: of joints, in cm, and of channels, normalised, if those are positions'.

    own : the clips as the network reads them; clips : as rows of `BodyFrame`.
    """
    joints, channels, encoding = [], [], body.encoding
    for seen, true in zip(*(Windows(its, model.frames).tiles(256) for its in (own, clips)), strict=True):  # fmt: skip
        said = model(seen[:, : model.encode])
        # windows end to end: where one begins, no joint knows
        flat = in_body(said.flatten(0, 1)[None], model.encoding, encoding)[0]
        off = encoding._points(flat) - encoding._points(true.flatten(0, 1))
        joints.append(100 * off.norm(dim=-1).mean(-1).unflatten(0, said.shape[:2]))
        if isinstance(model.encoding, BodyFrame):
            off = body.normalizer(said) - body.normalizer(true)
            channels.append(off.square().mean(-1))
    found = {"joint error (cm)": by_part(torch.cat(joints), model.encode)}
    return found | (
        {"squared error": by_part(torch.cat(channels), model.encode)} if channels else {}
    )


def by_part(errors: Tensor, encode: int) -> dict[str, float]:
    """Means of errors (windows, frames): of decoded frames, of predicted ones, of all."""
    each = errors.mean(0)
    return {"decoded": float(each[:encode].mean()), "predicted": float(each[encode:].mean()),
            "all": float(each.mean())}  # fmt: skip


def poses(made: Tensor, body: Prepared) -> list:
    """Poses (POSES, joints, 3) of rows (frames, dim), in metres, kept in place."""
    points = body.encoding._points(made[:: FRAMES // POSES].clamp(-10.0, 10.0))
    return (points * 1000).round().div(1000).tolist()


def compared(one: dict, other: dict, name: str) -> dict:
    """How much nearer one row is than that of a choice; angles without contacts, both of them."""
    far = "to real, without contacts" if name == "angles" else "to real"
    each = [{"seeds": {seed: {"to real": its[far]} for seed, its in row["seeds"].items()}}
            for row in (one, other)]  # fmt: skip
    return ablations.compared(*each)


if __name__ == "__main__":
    record.run(main)
