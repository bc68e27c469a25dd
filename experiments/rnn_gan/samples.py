"""W1: does the generator walk without end, in many ways, like people, and not like a tape?

    python -m experiments.rnn_gan.samples [--model lstm-gmm] [--starts 100] [--frames 18000]
    python -m experiments.rnn_gan.samples --sampling results/lstm_gmm_memory.json --output ...

The noise is white, as the paper's, if it isn't said otherwise. What is measured and how it is judged stands in claims.yaml. Batches of rollouts are kept in
runs/samples/: stopped and started again, it goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

import motionlab
from motionlab import contacts, metrics
from motionlab.encodings import BodyFrame, Encoding, Normalizer
from motionlab.training import Prepared
from motionlab.training.checkpoints import write_whole
from motionlab.training.evaluation import measured, over_all
from motionlab.training.finish import fit_temperature
from motionlab.weights import find

from ..common import record, rollouts
from ..common.recorded import recorded_clips
from ..common.rollouts import KINDS, OBSERVED, Judge

SAMPLES, AFTER = 100, 5.0  # from one start; seconds after which it is forgotten
SLOW = 0.2  # m/s; slower is standing about
TAIL = 10.0  # seconds at the end that rollouts are compared in
QUANTITIES = ("speed (m/s)", "turn rate (rad/s)", "step length (m)")
# Actions that begin so, and seconds that are compared: nearly all recorded clips are as long.
GAITS = {"walk": (("walk",), 3.0), "run": (("run", "dash"), 2.0)}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm", help="shipped name, or file of weights")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--frames", type=int, default=18_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--temperature", type=float, help="another than fits the weights best")
    parser.add_argument("--sampling", help="result whose `sampling` is taken, such as memory.py's")
    parser.add_argument("--output", help="results/MODEL_samples.json if left out")
    chosen = parser.parse_args(arguments)
    output = chosen.output or f"results/{Path(chosen.model).stem.replace('-', '_')}_samples.json"
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    weights = record.about_weights(model, path)
    full = Prepared.find(chosen.data)
    data = full.matching(model.encoding)
    sampling = white(model, data)
    if chosen.sampling:
        sampling = json.loads(Path(chosen.sampling).read_text(encoding="utf-8"))["sampling"]
    if chosen.temperature:
        sampling["temperature"] = chosen.temperature
    judge = rollouts.judge_of(data)
    seen = round(OBSERVED * model.fps)
    clips = [clip for clip in data.clips("test") if len(clip) >= seen]
    clips = [clips[i] for i in rollouts.spread_evenly(len(clips), chosen.starts)]
    begun = torch.stack([clip[:seen] for clip in clips])
    rows, heads, tails = endless(
        model, begun, data.hash, judge, chosen, weights["sha256"], sampling
    )
    alive = [all(row[kind] is None or row[kind] > 60 for kind in KINDS) for row in rows]
    result = {
        "weights": weights, "sampling": sampling, "fps": model.fps,
        "variety": variety(model, data, judge, chosen.seed, sampling),
        "endless": told(rows, tails, model, judge, chosen.frames),
        "likeness": likeness(heads, rows, alive, clips, model.encoding),
        "novelty": novelty(heads[torch.tensor(alive)], full, model.encoding),
    }  # fmt: skip
    record.write(record.provenance(begin, chosen.seed, data) | result, output)


def white(model: nn.Module, data: Prepared) -> dict[str, float]:
    """What suits the weights with the paper's white noise: how they are used, or else as is fitted.

    A temperature that goes with a memory is none for white noise.
    """
    if not model.sampling.get("memory"):
        return dict(model.sampling)
    return {"temperature": fit_temperature(model, data.clips("val"))}


# -- from one start -------------------------------------------------------------------------------

People = dict[str, dict[tuple[str, str, str], list[list[float]]]]


def people(data: Prepared, judge: Judge) -> People:
    """Quantities of all training clips, by how long a gait's are and by source, action and style."""
    points, found = data.encoding.positions, {}
    for gait, (_, seconds) in GAITS.items():
        piece, found[gait] = round(seconds * judge.fps), defaultdict(list)
        for clip_of, its_split, clip in recorded_clips(data):
            if its_split == "train" and len(clip) >= piece:
                key = clip_of.source, clip_of.action, clip_of.style
                found[gait][key].append(quantities(points(clip[:piece]), judge))
    return found


def variety(
    model: nn.Module, data: Prepared, judge: Judge, seed: int, sampling: dict, split: str = "test",
    known: People | None = None, at: float = 0.5, samples: int = SAMPLES,
) -> dict[str, dict]:  # fmt: skip
    """How samples from one start differ, beside how people do who do one thing again.

    known : from `people`, if it is there. at : which start, as a quantile of their speeds.
    """
    fps, points = model.fps, model.encoding.positions
    seen, after = round(OBSERVED * fps), round(AFTER * fps)
    known, clips, result = known or people(data, judge), recorded_clips(data), {}
    for gait, (actions, seconds) in GAITS.items():
        piece, real = round(seconds * fps), known[gait]
        everything = np.concatenate(list(map(np.array, real.values())))
        least, most = np.nanmin(everything, 0), np.nanmax(everything, 0)
        held = [
            (float(metrics.speed(points(clip), fps).mean()), clip_of.name, clip)
            for clip_of, its_split, clip in clips
            if its_split == split and clip_of.action.startswith(actions)
        ]
        speed, name, start = sorted(held, key=lambda h: h[0])[int(at * len(held))]
        begun = start[:seen].expand(samples, -1, -1)
        ((_, features),) = rollouts.sampled(model, begun, 2 * after, seed, **sampling)
        paths, found, sound = [], [], 0
        for motion in features:
            body = rollouts.points_of(model.encoding, motion)
            failed = np.isfinite(list(judge.failures(body).values())).any()
            paths.append(body[:: round(fps / 3), 0, [0, 2]].tolist())
            if bool(body.isfinite().all()):
                found.append(quantities(body[after : after + piece], judge))
                within = (least <= found[-1]) & (found[-1] <= most) | np.isnan(found[-1])
                sound += not failed and bool(within.all())
        groups = [np.array(v) for key, v in real.items() if key[1].startswith(actions)]
        again = same_again(groups)
        result[gait] = {
            "start": name, "start's speed (m/s)": speed, "samples": samples,
            "sound": sound / samples, "clips": sum(map(len, again)), "groups": len(again),
            "quantities": {
                quantity: {
                    "samples": _quantiles(np.array(found)[:, i]),
                    "the same again": _quantiles(np.concatenate(again)[:, i]),
                    "all": _quantiles(np.concatenate(groups)[:, i]),
                }
                for i, quantity in enumerate(QUANTITIES)
            },
            "root paths (m), three points a second": [
                [[round(x, 2) for x in point] for point in path] for path in paths
            ],
        }  # fmt: skip
    return result


def same_again(groups: list[np.ndarray]) -> list[np.ndarray]:
    """How quantities (clips, quantities) of people who do one thing again are off their mean."""
    return [(g - np.nanmean(g, 0)) * (len(g) / (len(g) - 1)) ** 0.5 for g in groups if len(g) >= 3]


def over_people(variety: dict[str, dict]) -> dict[str, float]:
    """Spreads of samples over those of people who do the same again, of what `variety` found."""
    return {
        f"{gait}, {quantity}": spreads["samples"]["spread"] / spreads["the same again"]["spread"]
        for gait, found in variety.items()
        for quantity, spreads in found["quantities"].items()
    }


def quantities(positions: Tensor, judge: Judge) -> list[float]:
    """Mean speed, mean turn rate, step length of one motion."""
    skeleton, fps = judge.limits.skeleton, judge.fps
    down = contacts.label_positions(positions, skeleton, fps)
    return [
        float(metrics.speed(positions, fps).mean()),
        float(metrics.turn_rate(positions, skeleton, fps).mean()),
        float(metrics.step_length(positions, down, skeleton, fps)),
    ]


def _quantiles(values: np.ndarray) -> dict[str, float]:
    found = dict(zip(("5%", "10%", "50%", "90%", "95%"),
                     np.nanquantile(values, [0.05, 0.1, 0.5, 0.9, 0.95]).tolist(), strict=True))  # fmt: skip
    return found | {"spread": found["90%"] - found["10%"]}


# -- without end ----------------------------------------------------------------------------------


def endless(
    model: nn.Module, begun: Tensor, data: str, judge: Judge, chosen: argparse.Namespace,
    weights: str, sampling: dict,
) -> tuple[list[dict], Tensor, Tensor]:  # fmt: skip
    """What became of each rollout; features of their first minutes and of their last seconds."""
    settings = "-".join(f"{key}-{value:g}" for key, value in sorted(sampling.items()))
    folder = Path("runs") / "samples" / "-".join(
        [weights[:12], data[:6], str(len(begun)), str(chosen.frames), str(chosen.seed), settings]
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    done = [int(path.stem) for path in folder.glob("*.npz")]
    minute, tail = (round(s * model.fps) for s in (60, TAIL))
    for number, features in rollouts.sampled(
        model, begun, chosen.frames, chosen.seed, done, **sampling
    ):
        rows = [_became(rollouts.points_of(model.encoding, f), judge, minute) for f in features]
        kept = {"heads": features[:, :minute].numpy(), "tails": features[:, -tail:].numpy(),
                "rows": np.array(json.dumps(rows))}  # fmt: skip
        write_whole(folder / f"{number}.npz", lambda stream, kept=kept: np.savez(stream, **kept))
        print(f"{folder}: batch {number}", flush=True)
    rows, heads, tails = [], [], []
    for path in sorted(folder.glob("*.npz"), key=lambda path: int(path.stem)):
        with np.load(path, allow_pickle=False) as kept:
            rows += json.loads(str(kept["rows"]))
            heads.append(torch.from_numpy(kept["heads"]))
            tails.append(torch.from_numpy(kept["tails"]))
    return rows, torch.cat(heads), torch.cat(tails)


def _became(points: Tensor, judge: Judge, minute: int) -> dict:
    """One rollout: when it failed, and every minute's speed and motion change."""
    fps, skeleton = judge.fps, judge.limits.skeleton
    row = judge.failures(points)
    whole = points.isfinite().flatten(1).all(1)
    pieces = [p for p in points[whole].split(minute) if len(p) >= fps]
    pose = [p - p[:, :1] for p in pieces]
    row["speed (m/s)"] = [float(metrics.speed(p, fps).mean()) for p in pieces]
    row["motion change (m/s)"] = [float(metrics.motion_change(p, fps).mean()) for p in pose]
    if whole.all() and len(points) >= 3 * fps:
        row["loop (s)"] = metrics.loop(points[-minute:], skeleton, fps).period
    return record.rounded(row)


def told(rows: list[dict], tails: Tensor, model: nn.Module, judge: Judge, frames: int) -> dict:
    """The rollouts together."""
    horizon, fps = frames / model.fps, model.fps
    lasted = np.array(
        [min(row[k] if row[k] is not None else np.inf for k in KINDS) for row in rows]
    )
    alive = np.isinf(lasted)
    curve = metrics.survival(lasted, horizon)
    found = {
        "rollouts": len(rows), "seconds each": horizon, "alive": float(alive.mean()),
        "alive, 95 %": [float(curve.low[-1]), float(curve.high[-1])],
        "failed": {kind: sum(row[kind] is not None for row in rows) for kind in KINDS},
        "survival": {name: values.tolist() for name, values in curve._asdict().items()},
        "limits": {"still (cm)": 100 * judge.limits.still, "lowest foot (cm)": [judge.low, judge.high]},
    }  # fmt: skip
    if not alive.any():
        return found
    living = [row for row, is_alive in zip(rows, alive, strict=True) if is_alive]
    for what in ("speed (m/s)", "motion change (m/s)"):
        each = np.array([row[what] for row in living])  # (rollouts, minutes)
        found[f"{what} by minute"] = {
            "mean": each.mean(0).tolist(),
            "10%": np.quantile(each, 0.1, axis=0).tolist(),
            "90%": np.quantile(each, 0.9, axis=0).tolist(),
        }
    speeds = np.array([row["speed (m/s)"] for row in living])
    points = [rollouts.points_of(model.encoding, t) for t, a in zip(tails, alive, strict=True) if a]
    groups = metrics.converged(torch.stack(points), judge.limits.skeleton, fps).bincount()
    found |= {
        "last minute's speed over the first's": float(speeds[:, -1].mean() / speeds[:, 0].mean()),
        "in a loop": float(np.mean([row.get("loop (s)") is not None for row in living])),
        "same end as another": float(groups[groups > 1].sum() / len(living)),
        "standing about": float((speeds[:, -1] < SLOW).mean()),
    }
    return found


# -- like people, not like a tape -----------------------------------------------------------------


def likeness(
    heads: Tensor, rows: list[dict], alive: list[bool], clips: list[Tensor], encoding: Encoding
) -> dict:
    """First minutes beside the clips they began in, one of each, so that as many walk and run."""
    measure = lambda points: measured(points, encoding.skeleton, encoding.fps)
    data = over_all([measure(encoding.positions(clip)) for clip in clips], [1] * len(clips))
    found = {"failed in the first minute": 1 - sum(alive) / len(rows), "data": data}
    kept = [measure(encoding.positions(head)) for head, ok in zip(heads, alive, strict=True) if ok]
    if kept:
        samples = over_all(kept, [1] * len(kept))
        ratios = {key: samples[key].value / data[key].value for key in samples}
        found |= {"samples": samples, "samples over data": ratios}
    return found


def novelty(heads: Tensor, data: Prepared, encoding: Encoding, split: str = "test") -> dict:
    """How far windows of samples, and of held-out clips, are from the nearest training window."""
    if not len(heads):
        return {}
    body, fps = BodyFrame(encoding.skeleton, fps=encoding.fps), encoding.fps
    of = lambda clips, encoding: [
        body.encode(encoding.to_motion(clip)) for clip in clips if len(clip) >= 2 * fps
    ]
    training, held_out = (of(data.clips(some), data.encoding) for some in ("train", split))
    normalizer = Normalizer.fit(training)
    training, held_out, samples = (
        list(map(normalizer, some)) for some in (training, held_out, of(heads, encoding))
    )
    near = [
        metrics.nearest_window_distance(some, training, fps, step=1.0, reference_step=0).distance
        for some in (samples, held_out)
    ]
    middle = [float(distance.median()) for distance in near]
    return {
        "windows": {"samples": len(near[0]), "held out": len(near[1])},
        "distance": {
            name: _quantiles(distance.numpy())
            for name, distance in zip(("samples", "held out"), near, strict=True)
        },
        "median over that of held-out clips": middle[0] / middle[1],
        "replays": metrics.replay_share(*near),
    }


if __name__ == "__main__":
    record.run(main)
