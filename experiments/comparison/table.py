"""All methods of three papers on one table: the same body, data, starts and measures.

    python -m experiments.comparison.table [--as-it-is] [--only ROW ...] [--output results/comparison.json]

Trains what is missing of `trainings`, then measures. With --as-it-is trainings, survival and what is searched
for are taken as far as they are there, and what is missing is said. What is measured stands
in columns.py, when one training is better than another in significance.py. What was measured of a method stays
in runs/comparison/measured/, by its weights and the source: stopped and started again, it goes on. So do
samples, to be looked at.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import torch

from motionlab import metrics
from motionlab.training import Prepared

from ..claims.comparison import METHODS as RATED
from ..common import record
from . import columns, measures, methods, significance, speed, trainings
from .columns import COLUMNS, FEW, GAITS, MILLISECONDS
from .measures import JERK, SKATE
from .methods import EQUAL, SHIPS, Method
from .order import CRITIC, FRECHET, MANIFOLD, order
from .real import Gait, Real

KEPT = trainings.FOLDER / "measured"
ALIVE, VARIETY = "alive", "variety"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="locomotion")
    parser.add_argument(
        "--as-it-is", action="store_true", help="of what takes long only what is there"
    )
    parser.add_argument(
        "--only", nargs="+", metavar="TITLE", help="measure these, and write nothing"
    )
    parser.add_argument("--output", default="results/comparison.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    if not chosen.as_it_is and not chosen.only:
        trainings.main(["--data", chosen.data])
    data = Prepared.find(chosen.data)
    real = Real(data)
    gaits = {name: real.of(name) for name in GAITS}
    each = [*methods.shipped(), *methods.trained(data)]
    if chosen.only:
        each = [method for method in each if method.title in chosen.only]
    elif chosen.as_it_is:
        each = [method for method in each if not method.few or made_before(method)]
    found = {}
    for method, gait in itertools.product(each, gaits.values()):
        found[method, gait.name] = all_of(method, real, gait)
        print(f"{method.title} {method.seed}, {gait.name}: {time.perf_counter() - begin:.0f} s",
              flush=True)  # fmt: skip
    for method in each:  # what takes longest comes last
        if chosen.as_it_is and not path_of(method, ALIVE).is_file():
            continue
        if ALIVE not in method.without:
            lasted = kept(method, ALIVE, lambda method=method: measures.lasting(
                method.go_on, real, list(gaits.values())))  # fmt: skip
            print(f"{method.title} {method.seed}, {ALIVE}: {time.perf_counter() - begin:.0f} s",
                  flush=True)  # fmt: skip
            for gait, its in lasted.items():
                found[method, gait][ALIVE] = its
    if chosen.only is None:
        result = told(each, found, real, gaits)
        record.write(record.provenance(begin, 0, data) | result, chosen.output)


# -- one method -----------------------------------------------------------------------------------


def all_of(method: Method, real: Real, gait: Gait) -> dict:
    """All that is measured of a method in a gait, start by start."""
    few = FEW if method.few else len(gait.begun["test"])
    made = {
        split: kept(method, f"{gait.name}-{split}", lambda split=split: method.go_on(
            gait.begun[split][spread(len(gait.begun[split]), few)], measures.length(real), seed=0))
        for split in ("test", "val")
    }  # fmt: skip
    which = spread(len(gait.begun["test"]), few)
    quiet = kept(method, f"{gait.name}-quiet", lambda: method.go_on(
        gait.begun["test"][which], gait.came.shape[1], seed=0, quiet=True)
        if not method.few else made["test"])  # fmt: skip
    good = [
        points for points, ok in zip(made["test"], measures.sound(made["test"]), strict=True) if ok
    ]
    learned = [
        points for points, ok in zip(made["val"], measures.sound(made["val"]), strict=True) if ok
    ]
    found = {
        "errors": measures.errors(quiet, gait.came[which], real.fps),
        "sound": len(good) / len(made["test"]),
    } | kept(method, f"{gait.name}-qualities", lambda: measures.qualities(good, gait))
    found[CRITIC] = kept(
        method, f"{gait.name}-critic", lambda: critics(method, gait, learned, good)
    )
    if VARIETY not in method.without:
        found[VARIETY] = kept(
            method, f"{gait.name}-{VARIETY}", lambda: measures.variety(method.go_on, real, gait)
        )
    return found


def critics(method: Method, gait: Gait, learned: list, made: list) -> list[float]:
    """Accuracy of each start, mean over critics: one a training, or some of what was trained once."""
    seeds = range(columns.CRITICS) if method.seed is None else [method.seed]
    return np.mean([measures.asked(gait, learned, made, seed) for seed in seeds], axis=0).tolist()


def spread(count: int, wanted: int) -> list[int]:
    """Numbers of starts, evenly."""
    return torch.linspace(0, count - 1, min(count, wanted)).round().long().tolist()


def made_before(method: Method) -> bool:
    """Whether a method's samples of all gaits and splits are kept."""
    return all(
        path_of(method, f"{gait}-{split}").is_file() for gait in GAITS for split in ("test", "val")
    )


def path_of(method: Method, what: str) -> Path:
    folder = f"{method.name.replace(' ', '_')}-{method.hash}-{source()}"
    return KEPT / folder / f"{what}.pt"


@torch.no_grad()
def kept(method: Method, what: str, measure: Callable):
    """What was measured before of these weights by this source, or is now."""
    path = path_of(method, what)
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        found = measure()
        beside = path.with_suffix(".part")
        torch.save(found, beside)
        beside.replace(path)
        return found
    return torch.load(path, weights_only=False)


@cache
def source() -> str:
    """Of the files of this folder that make and measure motion, as they were when this began."""
    names = ("begun", "columns", "going_on", "led", "measures", "real")
    code = b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in names)
    return hashlib.sha256(code).hexdigest()[:8]


# -- all of them ----------------------------------------------------------------------------------


def told(each: Sequence[Method], found: dict, real: Real, gaits: dict[str, Gait]) -> dict:
    """The whole result."""
    rows: dict[str, list[Method]] = {}
    for method in each:
        rows.setdefault(method.title, []).append(method)
    firsts = [its[0] for its in rows.values()]
    reference = next(method for method in firsts if method.title == speed.REFERENCE)
    ratios = {
        method.title: kept(method, "speed", lambda method=method: speed.ratios(
            method, reference, gaits["walk"].begun["test"]))
        for method in firsts
    }  # fmt: skip
    floor = {name: floor_of(gait) for name, gait in gaits.items()}
    told_rows = {
        title: about(its, found) | {"frames a second, over the reference's": ratios[title], "gaits": {
            gait: {column.name: cell(column.name, [found[m, gait] for m in its], gaits[gait])
                   for column in COLUMNS if column.name not in its[0].without}
            for gait in gaits}}
        for title, its in rows.items()
    }  # fmt: skip
    by_name = {method.name: method for method in each if method.kind == SHIPS}
    return {
        "budget": {"frames seen": trainings.BUDGET, "seeds": len(trainings.SEEDS)},
        "sizes": {
            "starts": {name: len(gait.begun["test"]) for name, gait in gaits.items()},
            "seconds seen": columns.SEEN, "seconds made": columns.SECONDS,
            "long rollouts": columns.LONG_STARTS, "their frames": columns.LONG,
            "from one start": columns.SAMPLES, "starts of what takes minutes": FEW,
        },
        "speed": {"reference": speed.REFERENCE, "frames": speed.FRAMES, "turns": speed.TURNS},
        "columns": {column.name: {"better": column.better, "what": column.what} for column in COLUMNS},
        "floor": floor, "rows": told_rows, "compared": compared(told_rows, floor),
        "stands in": {
            name: {
                "critic": {rated: {
                    "accuracy": metrics.bootstrap(found[by_name[rated], name][CRITIC]),
                    "p": measures.by_chance(found[by_name[rated], name][CRITIC]),
                } for rated in RATED},
                "order": order({rated: found[by_name[rated], name] for rated in RATED},
                               recorded(gait), gait),
            } for name, gait in gaits.items()
        },
    }  # fmt: skip


def about(its: Sequence[Method], found: dict) -> dict:
    """What a row is, whatever it does."""
    first, missing = its[0], {}
    if any(ALIVE not in found[method, gait] for method in its for gait in GAITS):
        missing[ALIVE] = "not measured yet"
    seeds = [method.seed for method in its if method.seed is not None]
    return {"name": first.name, "kind": first.kind, "what": first.what, "seeds": seeds,
            "parameters": first.parameters, "bytes": first.bytes, "frames seen": first.seen,
            "left out": missing | first.without}  # fmt: skip


def cell(column: str, seeds: Sequence[dict], gait: Gait) -> dict | None:
    """Value of a row in a column with its interval over starts, and each seed's value."""
    if any(column in (ALIVE, VARIETY) and column not in its for its in seeds):
        return None
    if column == VARIETY:
        each = [its[VARIETY]["value"] for its in seeds]
        return {"value": float(np.mean(each)), "seeds": each}
    if column == ALIVE:
        return survived([its[ALIVE] for its in seeds])
    if column == FRECHET:
        each = [metrics.jackknife(its["moments"], gait.frechet.distance)._asdict() for its in seeds]
        ends = {end: float(np.mean([its[end] for its in each])) for end in ("value", "low", "high")}
        return ends | {"seeds": [its["value"] for its in each]}
    by_start = [starts_of(column, its) for its in seeds]
    values = [mean(one) for one in by_start]
    if len({len(one) for one in by_start}) == 1:
        by_start = [[mean(start) for start in zip(*by_start, strict=True)]]
    each = np.concatenate(by_start)
    if np.isnan(each).all():  # feet that never rest have no skate
        return None
    interval = metrics.bootstrap(each)
    return {"value": mean(values), "low": interval.low, "high": interval.high, "seeds": values}


def mean(values: Sequence[float]) -> float:
    """NaN left out; NaN of nothing."""
    defined = [value for value in values if not np.isnan(value)]
    return float(np.mean(defined)) if defined else float("nan")


def survived(seeds: Sequence[dict]) -> dict:
    """Of all long rollouts of some trainings, taken together, those that are alive at the end."""
    lasted = np.concatenate([its["seconds until failure"] for its in seeds])
    curve = metrics.survival(lasted, seeds[0]["seconds each"])
    return {
        "value": float(np.isinf(lasted).mean()),
        "low": float(curve.low[-1]), "high": float(curve.high[-1]),
        "seeds": [its["alive"]["value"] for its in seeds], "rollouts": len(lasted),
        "failed": {kind: sum(its["failed"][kind] for its in seeds) for kind in seeds[0]["failed"]},
        "median seconds until failure": float(np.median(lasted.clip(max=seeds[0]["seconds each"]))),
    }  # fmt: skip


def starts_of(column: str, its: dict) -> list[float]:
    for number, ms in enumerate(MILLISECONDS):
        if column == f"error, {ms} ms (cm)":
            return [row[number] for row in its["errors"]]
    return its[column]


# -- recorded motion ------------------------------------------------------------------------------


def recorded(gait: Gait) -> dict[str, list[float]]:
    """Skate and jerk of the clips that were begun in."""
    real = gait.real
    each = [measures.measured(clip, real.skeleton, real.fps) for clip in gait.clips["test"]]
    return {key: [its[key] for its in each] for key in (SKATE, JERK)}


def floor_of(gait: Gait) -> dict[str, dict]:
    """Real against real: validation clips where a method's motion stands elsewhere.

    Of forecasts: the validation clip that was most like what was seen goes on. Of variety: people. Of
    survival: the share of test clips that are not called failed.
    """
    real, clips = gait.real, gait.clips
    held = measures.qualities(clips["val"], gait)
    found = {key: metrics.bootstrap(values)._asdict() for key, values in recorded(gait).items()}
    found[MANIFOLD] = metrics.bootstrap(gait.off_manifold(clips["test"]))._asdict()
    found[FRECHET] = metrics.jackknife(held["moments"], gait.frechet.distance)._asdict()
    fates = [min(real.judge.failures(clip.contiguous()).values()) for clip in clips["test"]]
    found[ALIVE] = metrics.bootstrap([float(np.isinf(fate)) for fate in fates])._asdict()
    found[VARIETY] = {"value": 1.0, "by definition": "people who do the same again"}
    half = lambda some: (some[0::2], some[1::2])
    (mine, learned), (true, made) = half(clips["val"]), half(clips["test"])
    each = [
        measures.told_apart(gait, (mine, learned), (true, made), s) for s in range(columns.CRITICS)
    ]
    found[CRITIC] = metrics.bootstrap(np.mean(each, axis=0))._asdict()
    for number, off in enumerate(np.transpose(measures.errors(
            measures.nearest_goes_on(gait), gait.came, real.fps))):  # fmt: skip
        found[f"error, {MILLISECONDS[number]} ms (cm)"] = metrics.bootstrap(off)._asdict()
    return found


# -- trainings beside each other -------------------------------------------------------------------


def compared(rows: dict[str, dict], floor: dict[str, dict]) -> dict:
    """Pairs of rows that were trained for the table, column by column, by the rule of `significance`."""
    trained = [title for title, row in rows.items() if row["kind"] == EQUAL]
    found: dict[str, dict] = {"pairs": {}}
    said = []
    for ours, theirs in itertools.combinations(trained, 2):
        its = found["pairs"][f"{ours} / {theirs}"] = {}
        for gait, real in floor.items():
            its[gait] = {}
            for column in COLUMNS:
                cells = [rows[t]["gaits"][gait].get(column.name) for t in (ours, theirs)]
                us, them = (one or {"seeds": []} for one in cells)
                wished = real[column.name]["value"]
                off = lambda one, c=column, w=wished: [columns.off(c, v, w) for v in one["seeds"]]
                least = (
                    real[column.name].get("high", wished) - real[column.name].get("low", wished)
                ) / 2
                its[gait][column.name] = significance.compared(off(us), off(them), least)
                said.append(its[gait][column.name])
    parted = sum(word in (significance.BETTER, significance.WORSE) for word in said)
    tested = sum(word != significance.NOT_TESTED for word in said)
    return found | {
        "tested": tested,
        "parted": parted,
        "by chance": significance.BY_CHANCE * tested,
    }


if __name__ == "__main__":
    record.run(main)
