"""W6: characters steered live by scripts, beside people, free samples and the authors' PFNN.

    python -m experiments.rnn_gan.steering [--seeds 20] [--survivors 50] [--minutes 5]

What is measured and how it is judged stands in claims.yaml. Each script is run by all seeds and both
starts as one batch; what was made is kept in runs/steering/, by the weights and the source of the
solvers: stopped and started again, it goes on.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import torch
from torch import nn

import motionlab
from motionlab import Motion, metrics
from motionlab.metrics import broken
from motionlab.models import pfnn
from motionlab.solvers.live_control import LiveControl
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from . import steering_measures as measures
from .following import AUTHORS, kept, made_with, mean, quality
from .keeping_pace import starts
from .steering_pfnn import steered

NAME, REFINER = "lstm-gmm-contacts", "refiner-contacts"
SURVIVORS = 50  # seeds of random commands
BEGINS = 2  # starts, of held-out motion
FIRST = 3.07  # seconds at which a command falls: within a window, which does not hear it
SOUGHT, AHEAD, STRAIGHT = (
    60,
    0.2,
    0.3,
)  # seconds of motion, of which those count that go ahead (rad, rad/s)
WALK, RUN, SLOW, FAST = 1.2, 2.8, 0.9, 1.4  # m/s
OURS = "futures"
WAYS = {"push": {}, "gradient": {"futures": 4}}  # beside ours, on few scripts and seeds
SPEEDS = {"push": {"way": "push"}, "futures, K 4": {"futures": 4}, "futures, K 16": {},
          "futures, K 64": {"futures": 64}, "gradient": {"way": "gradient", "futures": 4}}  # fmt: skip
FEW = ("90° left", "179° left", "walk, run, walk", "stop")
FEW_SEEDS = 5


class Script(NamedTuple):
    """Commands (second, m/s or None, degrees or None), and what is judged: "turn" to a way, "pace" at
    each speed, "stop", or "told" only."""

    begins: str
    commands: tuple[tuple[float, float | None, float | None], ...]
    seconds: float
    kind: str


def _turn(degrees: float, speed: float = WALK, begins: str = "walk") -> Script:
    return Script(begins, ((0, speed, 0), (FIRST, None, degrees)), 9.0, "turn")


def _paces(*speeds: float, begins: str = "walk") -> Script:
    each = [(FIRST + 4 * i, speed, None) for i, speed in enumerate(speeds[1:])]
    return Script(begins, ((0, speeds[0], 0), *each), FIRST + 4 * len(each) + 1, "pace")


SCRIPTS = {
    # not 180: that is one wish from both sides, and would count one experiment twice
    **{f"{d}° {side}": _turn(sign * d) for d in (45, 90, 179) for side, sign in (("left", 1), ("right", -1))},
    "faster": _paces(SLOW, FAST),
    "slower": _paces(FAST, SLOW),
    "walk, run, walk": _paces(WALK, RUN, WALK),
    "start": _paces(0.0, WALK, begins="stand"),
    "stop": Script("walk", ((0, WALK, 0), (FIRST, 0.0, None)), 9.0, "stop"),
    "slalom": Script("walk", ((0, WALK, 0), *((FIRST + 1.5 * i, None, 40 * (-1) ** i) for i in range(4))),
                     11.0, "turn"),
    "run, 90° left": _turn(90, RUN, "run"),
    "run, 90° right": _turn(-90, RUN, "run"),
    "run, 180° left": _turn(180, RUN, "run"),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--survivors", type=int, default=SURVIVORS)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--split", choices=("val", "test"), default="test")
    parser.add_argument("--runs", type=Path, default=Path("runs/steering"))
    parser.add_argument("--output", default="results/steering.json")
    parser.add_argument("--only-speed", action="store_true", help="anew, in a result that is there: "
                        "after a change that leaves all motion as it is")  # fmt: skip
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    model, refiner = motionlab.load(NAME), motionlab.load(REFINER)
    data = Prepared.find("locomotion").matching(model.encoding)
    if chosen.only_speed:
        result = json.loads(Path(chosen.output).read_text())
        result["speed"] = speed(model, refiner)
        result["speed measured by"] = record.provenance(begin, 0, data)
        return record.write(result, chosen.output)
    runs = chosen.runs / f"{made_with(model)}-{chosen.split}-{chosen.seeds}"
    begun = {gait: beginnings(model, data, gait, chosen.split) for gait in ("walk", "run", "stand")}
    rival = pfnn.load_authors()
    own = once(runs / "people.json", lambda: people(data))
    scripts = {
        name: of_script(name, model, refiner, begun, rival, chosen.seeds, runs)
        | {"people's (s)": own.get(name)}
        for name in SCRIPTS
    }
    result = {
        "weights": {
            "generator": record.about_weights(model, find(NAME)),
            "refiner": record.about_weights(refiner, find(REFINER)),
        },
        "seeds": chosen.seeds,
        "starts": BEGINS,
        "split": chosen.split,
        "scripts": scripts,
        "free": once(runs / "free.json", lambda: free(model, refiner, begun)),
        "survival": once(runs / f"survival-{chosen.survivors}-{chosen.minutes:g}.json",
                         lambda: survival(model, begun["walk"], chosen.survivors, chosen.minutes)),
        "speed": once(runs / "speed.json", lambda: speed(model, refiner)),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def once(path: Path, make: Callable[[], dict]) -> dict:
    """What was found before, or is now."""
    if not path.is_file():
        found = record.rounded(make())
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(found))
        print(path.stem, flush=True)
    return json.loads(path.read_text())


@torch.no_grad()
def beginnings(model: nn.Module, data: Prepared, gait: str, split: str):
    """States (BEGINS,) after a second of held-out motion straight ahead; who stands is the model's own."""
    if gait == "stand":
        return model.starts[[model.start_names.index("stand")] * BEGINS]
    begun, *_ = starts(data, gait, split, SOUGHT)
    steps = begun[..., :2].mean(1)
    ahead = torch.atan2(steps[:, 0], steps[:, 1]).abs() <= AHEAD
    straight = (begun[..., 2].mean(1) * model.fps).abs() <= STRAIGHT
    found = begun[ahead & straight]
    return model.observe(found[[0, len(found) // 2]], doubt=False)


def begin_from(model: nn.Module, begun) -> None:
    """States (BEGINS,) are the model's first starts, its own come behind them."""
    own = [i for i, name in enumerate(model.start_names) if not name.startswith("start ")]
    both = zip(begun, model.starts[own], strict=True)
    names = [model.start_names[i] for i in own]
    model.starts = type(begun)(*map(torch.cat, both))
    model.start_names = (*(f"start {i}" for i in range(BEGINS)), *names)


# -- scripts ----------------------------------------------------------------------------------------


def of_script(
    name: str, model: nn.Module, refiner: nn.Module, begun: dict, rival: nn.Module, seeds: int, runs: Path
) -> dict:  # fmt: skip
    """One script by our way, by the others if it is among few, and by PFNN."""
    script, found = SCRIPTS[name], {}
    counts = {OURS: seeds} | ({way: min(seeds, FEW_SEEDS) for way in WAYS} if name in FEW else {})
    for way, count in counts.items():
        make = lambda way=way, count=count: played(
            script, model, refiner, begun[script.begins], way, count
        )
        motions = kept(runs / f"{name.replace(' ', '_')}-{way}.pt", make)
        rows = [row_of(script, motion) | its for motion, its in motions.values()]
        found[way] = {"rows": rows, "summary": summary(rows)}
        print(f"{name}, {way}", flush=True)
    rows = [row_of(script, steered(rival, script.commands, script.seconds))]
    found[AUTHORS] = {"rows": rows, "summary": summary(rows)}
    return {"kind": script.kind, "ways": found}


def played(
    script: Script, model: nn.Module, refiner: nn.Module, begun, way: str, seeds: int,
    settings: dict | None = None,
) -> dict[str, tuple[Motion, dict]]:  # fmt: skip
    """All seeds and starts of a script, as one batch; refined and locked as they come."""
    settings = WAYS.get(way, {}) if settings is None else settings
    begin_from(model, begun)
    count = seeds * BEGINS
    live = LiveControl(
        model, [i % BEGINS for i in range(count)], count, way=way, refiner=refiner, lock=True, **settings
    )  # fmt: skip
    begin = time.process_time()
    obey(live, script.commands, script.seconds)
    took = time.process_time() - begin
    found = {}
    for i in range(count):
        motion = live.motion(i)
        its = {"begun again": live.lost[i], "broken frames": int(metrics.broken_frames(motion).sum()),
               "frames a processor second": count * live.frames / took}  # fmt: skip
        found[f"seed {i // BEGINS}, start {i % BEGINS}"] = motion, its
    return found


def obey(live: LiveControl, commands: Sequence[tuple], seconds: float) -> None:
    """Steer as a script says: a command is given when its second has come, at the next window."""
    waiting = list(commands)
    while live.frames < seconds * live.fps:
        while waiting and waiting[0][0] * live.fps <= live.frames:
            _, pace, degrees = waiting.pop(0)
            live.steer(pace, None if degrees is None else math.radians(degrees))
        live.go_on()


def row_of(script: Script, motion: Motion) -> dict:
    """What came of a script's commands."""
    motion = motion.resample(30.0)
    fps = motion.fps
    points = motion.positions()
    row: dict = {}
    if script.kind == "turn":
        at, _, degrees = script.commands[-1]
        pace = script.commands[0][1]
        row = measures.turned(motion, round(at * fps), math.radians(degrees), pace)
    elif script.kind == "pace":
        rest = [*script.commands[1:], (script.seconds, None, None)]
        each = [
            measures.paced(motion, round(at * fps), pace, round(until * fps) - 15)
            for (at, pace, _), (until, *_) in zip(rest, rest[1:], strict=False)
        ]
        row = {key: max(one[key] for one in each) for key in each[0]}
    else:
        row = measures.stopped(motion, round(script.commands[-1][0] * fps))
    first = round(FIRST * fps)
    return row | quality(points[first:], motion.skeleton, fps)


def summary(rows: list[dict]) -> dict:
    """Medians over seeds; who never settles counts as infinitely late, and is null then."""
    keys = [key for key in rows[0] if isinstance(rows[0][key], float)]
    return {
        key: float(
            torch.tensor([row[key] for row in rows], dtype=torch.double)
            .nan_to_num(math.inf, posinf=math.inf)  # else it would be the largest number
            .median()
        )
        for key in keys
    } | {"broken": mean_share(rows, "broken frames"), "runs": len(rows)}


def mean_share(rows: list[dict], key: str) -> float:
    """Share of the runs in which there are any."""
    return sum(bool(row.get(key)) for row in rows) / len(rows)


# -- what it is compared with -----------------------------------------------------------------------


def people(data: Prepared) -> dict:
    """Medians of people's own times for the same, in all recorded clips."""
    roots = [
        data.encoding.root_path(clip)
        for split in ("train", "val", "test")
        for clip in data.clips(split)
    ]
    fps = data.encoding.fps
    found: dict = {}
    gaits = {"": (0.7, 1.9), "run, ": (1.9, 9.0)}
    turns = {(gait, d): measures.own_turns(roots, fps, d, speeds)
             for gait, speeds in gaits.items() for d in (45, 90, 179, 180)}  # fmt: skip
    for name in SCRIPTS:
        gait, degrees = (
            ("run, " if name.startswith("run") else ""),
            name.removeprefix("run, ").split("°")[0],
        )
        if degrees.isdecimal():
            found[name] = told(turns[gait, int(degrees)])
    changes = {
        "faster": (SLOW, FAST),
        "slower": (FAST, SLOW),
        "start": (0.0, WALK),
        "stop": (WALK, 0.0),
    }
    for name, pair in changes.items():
        found[name] = told(measures.own_changes(roots, fps, *pair))
    both = [told(measures.own_changes(roots, fps, *pair)) for pair in ((WALK, RUN), (RUN, WALK))]
    found["walk, run, walk"] = max(both, key=lambda one: one["median"])
    found["slalom"] = found["90° left"]  # 80 degrees at a time
    return found


def told(times: list[float]) -> dict:
    several = torch.tensor(times or [math.nan], dtype=torch.double)
    return {"median": float(several.median()), "10 %": float(several.quantile(0.1)),
            "90 %": float(several.quantile(0.9)), "found": len(times)}  # fmt: skip


@torch.no_grad()
def free(model: nn.Module, refiner: nn.Module, begun: dict) -> dict:
    """Free samples as they ship, from the same starts, refined and not locked."""
    found = {}
    for gait in ("walk", "run"):
        chance = model.sampling | {"generator": torch.Generator().manual_seed(0)}
        rows = model.generate(round(9 * model.fps), begun[gait][[0, 1] * 10], **chance)
        points = model.encoding.positions(refiner(rows))[:, round(FIRST * model.fps) :]
        each = [quality(one, model.encoding.skeleton, model.fps) for one in points]
        found[gait] = {key: mean(each, key) for key in each[0]}
    return found


def survival(model: nn.Module, begun, seeds: int, minutes: float, seed: int = 0) -> dict:
    """Random commands for some minutes: who falls, glides, freezes, runs away or comes apart?

    seed : of the samples; the commands have another.
    """
    begin_from(model, begun)
    count, fps = seeds * BEGINS, model.fps
    live = LiveControl(model, [i % BEGINS for i in range(count)], count, way=OURS, seed=seed)
    live.behind.go_on = lambda frames: made.append(frames) or [None] * count  # as it is sampled
    chance, made = torch.Generator().manual_seed(seed + 1), []
    asked = []
    while live.frames < minutes * 60 * fps:
        new = (torch.rand(count, generator=chance) < 1 / (3 * fps / live.how.window)).nonzero()[
            :, 0
        ]
        if len(new) or not asked:
            new = new if asked else torch.arange(count)
            draw = torch.rand(len(new), 3, generator=chance)
            pace = torch.where(draw[:, 0] < 0.15, 0.0, 0.5 + 2.7 * draw[:, 1])
            live.steer(pace, 2 * math.pi * draw[:, 2], who=new.tolist())
        live.go_on()
        asked += [live.aim.speed.clone()] * live.how.window
    features, asked = torch.cat(made, 1), torch.stack(asked, 1)
    bad = broken.beyond(model.encoding, features) > 0
    ends, glides = measures.ends(model.encoding, features, bad, asked)
    ends["lost"] = torch.tensor(live.lost) > 0
    alive = ~torch.stack(list(ends.values())).any(0)
    return {"characters": count, "minutes": minutes, "alive": float(alive.double().mean()),
            **{name: int(who.sum()) for name, who in ends.items()},
            "time in glides": float(glides.double().mean()),
            "broken frames": float(bad.double().mean())}  # fmt: skip


@torch.no_grad()
def speed(
    model: nn.Module, refiner: nn.Module, windows: int = 60, each: dict[str, dict] = SPEEDS
) -> dict:  # fmt: skip
    """Frames a processor second of one character on one thread, and seconds a window.

    each : by name, settings of a `LiveControl`.
    """
    found = {}
    model = motionlab.load(NAME)
    begin = time.process_time()
    model.generate(
        300, model.starts[:1], generator=torch.Generator().manual_seed(0), **model.sampling
    )
    found["free"] = {"frames a second": 300 / (time.process_time() - begin)}
    for name, settings in each.items():
        live = LiveControl(model, "walk", refiner=refiner, lock=True, **settings)
        live.steer(WALK, 0.5)
        for _ in range(3):
            live.go_on()
        times = []
        for _ in range(windows):
            begin = time.process_time()
            live.go_on()
            times.append(time.process_time() - begin)
        took = torch.tensor(times, dtype=torch.double)
        found[name] = {
            "frames a second": live.how.window * windows / float(took.sum()),
            "a window, p50 (s)": float(took.quantile(0.5)),
            "a window, p95 (s)": float(took.quantile(0.95)),
            "latency (s)": live.latency,
        }
        found[name]["over free"] = found[name]["frames a second"] / found["free"]["frames a second"]
    return found


if __name__ == "__main__":
    record.run(main)
