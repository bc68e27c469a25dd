"""W5: whose root follows a drawn curve more closely, ours or PFNN's?

    python -m experiments.rnn_gan.following [--seeds 0 1 2] [--pfnn runs/pfnn-ship/best.safetensors]

What is measured and how it is judged stands in claims.yaml. Ours begins in held-out motion, another
one for each seed. PFNN's authors' network is taken as it is, and led so fast that it comes to the
same mean speed; beside that, out of the judgement, at the speed at which it errs least. A network of the
same architecture, trained here by `motionlab train pfnn --preset ship`, is measured beside if it is
there. What is solved is kept in runs/following/, by the weights and the search that it was solved with:
stopped and started again, it goes on, and can be looked at.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor, nn

import motionlab
from motionlab import Motion, Skeleton, metrics
from motionlab.feet import contacts
from motionlab.metrics import broken_frames
from motionlab.models import pfnn
from motionlab.paths import Path as Way
from motionlab.paths import Piece
from motionlab.solvers import design, path_control
from motionlab.solvers.design import SETTLED, STRIDE
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from .curves import shapes, splines
from .keeping_pace import starts
from .refined_samples import Variant, asked, clips_of

NAME = "lstm-gmm-contacts"
OURS, REFINED = "ours", "ours, refined and locked"
AUTHORS, TRAINED = "PFNN, the authors'", "PFNN, trained here"
EASE = "PFNN, the authors', at its ease"
LED = 4  # times that PFNN is led anew, faster or slower, towards the same mean speed
EASY = {"walk": (0.8, 1.0, 1.2, 1.4), "jog": (1.6, 2.0, 2.4, 2.8)}  # m/s, tried for its ease
FASTEST = 1.6  # times the speed that is wanted: beyond, PFNN is asked for another gait


class Gait(NamedTuple):
    """Curves that are walked, or run, at one speed."""

    speed: float  # m/s
    size: float  # m, radius of the smallest circle
    length: float  # m, of each curve
    splines: int


GAITS = {"walk": Gait(1.2, 2.0, 18.0, 20), "run": Gait(3.0, 5.0, 36.0, 10)}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--gaits", nargs="+", choices=list(GAITS), default=list(GAITS))
    parser.add_argument("--pfnn", type=Path, default=Path("runs/pfnn-ship/best.safetensors"))
    parser.add_argument("--runs", type=Path, default=Path("runs/following"))
    parser.add_argument("--output", default="results/following.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, refiner = motionlab.load(NAME), motionlab.load("refiner-contacts")
    data = Prepared.find("locomotion").matching(model.encoding)
    rivals = {AUTHORS: pfnn.load_authors()}
    if chosen.pfnn.is_file():
        rivals[TRAINED] = motionlab.load(chosen.pfnn)
    weights = {
        OURS: record.about_weights(model, find(NAME)),
        REFINED: record.about_weights(refiner, find("refiner-contacts")),
    }
    if TRAINED in rivals:
        weights[TRAINED] = record.about_weights(rivals[TRAINED], chosen.pfnn)
    gaits = {
        gait: of_gait(
            gait, model, refiner, rivals, data, chosen.seeds, chosen.runs / made_with(model)
        )
        for gait in chosen.gaits
    }
    result = {"weights": weights, "gaits": gaits}
    record.write(
        record.provenance(begin, chosen.seeds[0], data, seeds=chosen.seeds) | result, chosen.output
    )


def curves_of(gait: str) -> dict[str, Tensor]:
    its = GAITS[gait]
    return shapes(its.size, its.length) | splines(its.splines, its.size, its.length)


def of_gait(
    gait: str, model: nn.Module, refiner: nn.Module, rivals: dict[str, nn.Module], data: Prepared,
    seeds: Sequence[int], runs: Path,
) -> dict:  # fmt: skip
    """All curves by all methods, in one gait."""
    ways = {name: Way.through(curve) for name, curve in curves_of(gait).items()}
    raw = [
        kept(runs / f"{gait}-{seed}.pt",
             lambda seed=seed: walked(gait, model, data, "test", ways, seed))
        for seed in seeds
    ]  # fmt: skip
    solved = {OURS: raw, REFINED: [finished(each, refiner) for each in raw]}
    rows = {
        method: {
            name: [row_of(each[name][0], way) | each[name][1] for each in found]
            for name, way in ways.items()
        }
        for method, found in solved.items()
    }
    pace = {name: mean(each, "mean speed (m/s)") for name, each in rows[REFINED].items()}
    for method, network in rivals.items():
        motions, speeds = led(network, ways, pace)
        rows[method] = {
            name: [row_of(motions[name], way) | {"led at (m/s)": speeds[name]}]
            for name, way in ways.items()
        }
    motions, speed = at_ease(rivals[AUTHORS], ways, "jog" if gait == "run" else gait)
    rows[EASE] = {
        name: [row_of(motions[name], way) | {"led at (m/s)": speed}] for name, way in ways.items()
    }
    few = {name: way for name, way in ways.items() if not name.startswith("spline")}
    learnt = kept(runs / f"{gait}-val.pt", lambda: walked(gait, model, data, "val", few, 0))
    learnt = {OURS: learnt, REFINED: finished(learnt, refiner)}
    return {
        "speed asked (m/s)": GAITS[gait].speed,
        "curves": rows,
        "methods": {method: summary(each, rows[AUTHORS]) for method, each in rows.items()},
        "critic": critics(gait, model, refiner, data, solved, learnt, few),
        "recorded": recorded(gait, data),
    }


# -- motion along curves ----------------------------------------------------------------------------

Solved = dict[str, tuple[Motion, dict]]  # by the name of the curve


def walked(
    gait: str, model: nn.Module, data: Prepared, split: str, ways: dict[str, Way], seed: int
) -> Solved:
    """Ours along all curves, begun in held-out motion, as the search leaves it."""
    begun, *_ = starts(data, gait, split, 3)
    with torch.no_grad():
        model.starts = model.observe(begun[seed % len(begun)][None], doubt=False)
    model.start_names = (f"{gait} {GAITS[gait].speed} m/s",)
    found = design.design_all(
        list(ways.values()), GAITS[gait].speed, 0, model, seed=seed, progress=True
    )
    told = ("finished", "begun again", "seconds", "broken frames")
    return {
        name: (motion, {key: its[key] for key in told} | {"late (s)": late(its)})
        for name, (motion, its) in zip(ways, found, strict=True)
    }


@torch.no_grad()
def finished(solved: Solved, refiner: nn.Module) -> Solved:
    """The same, refined and with feet locked, as `motionlab.design` does it when it is asked to."""
    made = {}
    for name, (raw, its) in solved.items():
        motion = design.finished(raw, refiner, lock=True)
        made[name] = motion, its | {"broken frames": int(broken_frames(motion).sum())}
    return made


def late(told: dict) -> float:
    return told["timing"]["walked (s)"] - told["timing"]["asked (s)"]


def led(
    network: nn.Module, ways: dict[str, Way], pace: dict[str, float]
) -> tuple[dict[str, Motion], dict[str, float]]:
    """PFNN along all curves, at a mean speed as near to `pace` as can be, and how fast it was led.

    It need not be as fast as it is led: the speed is corrected by what came of it.
    """
    speeds = dict(pace)
    for attempt in range(LED):
        lines = [way.places.float() for way in ways.values()]
        seconds = max(way.length / pace[name] for name, way in ways.items())
        made = pfnn.follow(network, lines, list(speeds.values()), seconds=seconds)
        motions = {
            name: motion[: round(way.length / pace[name] * motion.fps)]
            for (name, way), motion in zip(ways.items(), made, strict=True)
        }
        if attempt < LED - 1:
            for name, motion in motions.items():
                faster = speeds[name] * pace[name] / pace_of(motion)
                speeds[name] = min(faster, FASTEST * pace[name])
    return motions, speeds


def at_ease(network: nn.Module, ways: dict[str, Way], gait: str) -> tuple[dict[str, Motion], float]:
    """PFNN in one gait along all curves, led at the speed at which it errs least: all in its favour."""
    lines, tried = [way.places.float() for way in ways.values()], []
    for speed in EASY[gait]:
        motions = dict(zip(ways, pfnn.follow(network, lines, speed, gait=gait), strict=True))
        errors = [row_of(motion, ways[name])["rms (cm)"] for name, motion in motions.items()]
        tried.append((median(errors), speed, motions))
    _, speed, motions = min(tried, key=lambda each: each[0])
    return motions, speed


def pace_of(motion: Motion) -> float:
    """Mean speed over the ground, m/s."""
    root = motion.positions()[:, motion.skeleton.roles.get("hips", 0)][:, [0, 2]]
    return float(root.diff(dim=0).norm(dim=1).mean() * motion.fps)


def made_with(model: nn.Module) -> str:
    """What solved motion depends on: the weights, and the source of the search."""
    source = Path(path_control.__file__).parent.glob("*.py")
    code = b"".join(path.read_bytes() for path in sorted(source))
    return f"{model.hash[:8]}-{hashlib.sha256(code).hexdigest()[:8]}"


def kept(path: Path, solve: Callable[[], Solved]) -> Solved:
    """What was solved before, or is now; as tensors and plain values."""
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        found = {
            name: (motion.root_positions, motion.rotations, motion.contacts, its)
            for name, (motion, its) in solve().items()
        }
        torch.save(found, path)
    skeleton, fps = motionlab.load(NAME).encoding.skeleton, motionlab.load(NAME).fps
    return {
        name: (Motion(skeleton, root, turns, fps, name=name, contacts=down), its)
        for name, (root, turns, down, its) in torch.load(path, weights_only=True).items()
    }


# -- how near it is, and how good -------------------------------------------------------------------


def row_of(motion: Motion, way: Way) -> dict[str, float]:
    """What is told of one motion along one curve; PFNN's at our rate, so that jerk is comparable."""
    motion = motion.resample(30.0)
    points, fps, skeleton = motion.positions(), motion.fps, motion.skeleton
    root = points[round(SETTLED * fps) :, skeleton.roles.get("hips", 0)]
    ground = root[:, [0, 2]].double()
    off = 100 * (ground - Piece(way.places[None], way.arcs[None]).nearest(ground[None]).places[0])
    sway_free = off.unfold(0, round(STRIDE * fps), 1).mean(-1)
    square = off.square().sum(1)
    return {
        "rms (cm)": float(square.mean().sqrt()),
        "mean square (cm²)": float(square.mean()),
        "largest (cm)": float(square.max().sqrt()),
        "rms of the stride's mean (cm)": float(sway_free.square().sum(1).mean().sqrt()),
        "rms to the drawn line (cm)": float(metrics.root_path_error(root[:, None], way.drawn).rms),
        "mean speed (m/s)": pace_of(motion),
    } | quality(points, skeleton, fps)


def quality(points: Tensor, skeleton: Skeleton, fps: float) -> dict[str, float]:
    """What can be told of any body, also of one whose rest pose does not stand on the floor."""
    down = contacts.label_positions(points, skeleton, fps)
    return {
        "foot skate (cm/s)": float(metrics.foot_skate(points, down, skeleton, fps)),
        "acceleration (m/s²)": float(metrics.acceleration(points, fps)),
        "jerk (m/s³)": float(metrics.jerk(points, fps)),
    }


def mean(rows: Sequence[dict], key: str) -> float:
    values = [row[key] for row in rows if math.isfinite(row[key])]
    return sum(values) / len(values) if values else math.nan


def median(values: Sequence[float]) -> float:
    return float(torch.tensor(list(values), dtype=torch.float64).median())


def summary(rows: dict[str, list[dict]], rivals: dict[str, list[dict]]) -> dict:
    """Over all curves, each the mean of its seeds; intervals over curves."""
    keys = [key for key in next(iter(rows.values()))[0] if key != "finished"]
    found: dict = {
        key: metrics.bootstrap([mean(each, key) for each in rows.values()], median) for key in keys
    }
    ratios = [
        mean(each, "rms (cm)") / mean(rivals[name], "rms (cm)") for name, each in rows.items()
    ]
    ours = [row for each in rows.values() for row in each if "finished" in row]
    told = {
        "finished": lambda row: row["finished"],
        "without broken frames": lambda row: not row["broken frames"],
    }
    return {
        "median": found,
        "rms over PFNN's": metrics.bootstrap(ratios, median),
        "nearer than PFNN": sum(ratio < 1 for ratio in ratios) / len(ratios),
    } | {key: sum(map(its, ours)) / len(ours) for key, its in told.items() if ours}


def critics(
    gait: str, model: nn.Module, refiner: nn.Module, data: Prepared, solved: dict[str, list[Solved]],
    learnt: dict[str, Solved], few: dict[str, Way],
) -> dict:  # fmt: skip
    """How often a critic tells recorded motion from ours, and from free samples that begin alike."""
    encoding, clips = model.encoding, {s: clips_of(data, gait, s) for s in ("test", "val")}
    found, counts = {}, {"val": len(few), "test": len(few) * len(solved[OURS])}
    for method in (OURS, REFINED):
        some = [encoding.encode(each[name][0]) for each in solved[method] for name in few]
        own = [encoding.encode(learnt[method][name][0]) for name in few]
        found[method] = asked(Variant(encoding, clips, [some], [own]))
    frames = round(GAITS[gait].length / GAITS[gait].speed * model.fps)
    free = {}
    for split, count in counts.items():
        begun, *_ = starts(data, gait, split, 3)
        begun = begun[torch.arange(count) % len(begun)] if split == "test" else begun[:1]
        with torch.no_grad():
            state = model.observe(begun.expand(count, -1, -1), doubt=False)
            free[split] = model.generate(
                frames, state, generator=torch.Generator().manual_seed(0), **model.sampling
            )
    found["free samples"] = asked(Variant(encoding, clips, [free["test"]], [free["val"]]))
    with torch.no_grad():
        free = {split: refiner(made) for split, made in free.items()}
    found["free samples, refined"] = asked(Variant(encoding, clips, [free["test"]], [free["val"]]))
    return found


def recorded(gait: str, data: Prepared) -> dict:
    """The same measures of held-out clips of the gait: what is to be compared with."""
    encoding = data.encoding
    rows = [
        quality(encoding.positions(clip), encoding.skeleton, encoding.fps)
        for clip in clips_of(data, gait, "test")
    ]
    return {key: metrics.bootstrap([row[key] for row in rows], median) for key in rows[0]}


if __name__ == "__main__":
    record.run(main)
