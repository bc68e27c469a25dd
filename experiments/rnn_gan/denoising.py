"""W7, W8: does a prior clean better than a filter, and is there a hop at the first frame?

    python -m experiments.rnn_gan.denoising [--data runs/everything.npz] [--clips 10] [--split test]

What is made wrong stands in noises.py, the rivals in rivals.py, the rules in claims.yaml. Settings are
chosen on validation clips, for each noise and kind by itself. Each noise of each kind is kept in
runs/denoising/, by the weights and the source that it was made with: stopped and started again, it
goes on, and can be looked at.
"""

from __future__ import annotations

import argparse
import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import torch
from torch import nn

import motionlab
from motionlab import Motion, corrupt, filters, metrics, solvers
from motionlab.errors import DataError
from motionlab.solvers.denoise import clean_jobs, job_of, see
from motionlab.solvers.denoise_seen import motion_of
from motionlab.solvers.denoise_windows import Settings
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record
from . import noises, rivals
from .noises import KINDS, NOISES, Case, cases, measure, pieces
from .rivals import families, tuned

NAME = "lstm-gmm-contacts"
TUNED_ON = 3  # validation clips of a kind
ERROR, HIT = "joint error (cm)", "error where it was hit (cm)"
OURS, ALWAYS, SEEN, FILLED = "ours", "the network always", "as seen", "filled"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="everything")
    parser.add_argument("--clips", type=int, default=10)
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--noises", nargs="+", choices=list(NOISES), default=list(NOISES))
    parser.add_argument("--runs", type=Path, default=Path("runs/denoising"))
    parser.add_argument("--output", default="results/denoising.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model = motionlab.load(NAME).requires_grad_(False)
    data = Prepared.find(chosen.data).matching(model.encoding)
    of = f"{model.hash[:8]}-{data.hash[:8]}-{chosen.split}-{chosen.clips}"
    base = hashed(Path(noises.__file__), Path(rivals.__file__), Path(filters.__file__),
                  Path(corrupt.__file__))  # fmt: skip
    theirs = chosen.runs / f"rivals-{of}-{base}"
    code = sorted(Path(solvers.__file__).parent.glob("*.py"))
    ours = chosen.runs / f"ours-{of}-{hashed(Path(__file__), Path(noises.__file__), *code)}"
    kinds = {}
    for kind in KINDS:
        tuning = pieces(data, kind, "val", TUNED_ON)
        judged = pieces(data, kind, chosen.split, chosen.clips)
        if not tuning or not judged:
            raise DataError(f"{chosen.data} has no clips of the kind {kind!r} in val or test.")
        kinds[kind] = {}
        for noise in chosen.noises:
            seen = [cases(some, kind, noise, split)
                    for some, split in ((tuning, "val"), (judged, chosen.split))]  # fmt: skip
            methods = kept(theirs / f"{kind}, {noise}.pt", by_rivals, model, *seen)
            own = kept(ours / f"{kind}, {noise}.pt", by_ours, model, seen[1])
            kinds[kind][noise] = compared(methods | own["rows"])
            print(f"{kind}, {noise}: {_told(kinds[kind][noise])}", flush=True)
    gaits = [m for kind in KINDS[:2] for m in pieces(data, kind, chosen.split, chosen.clips)]
    result = {
        "weights": record.about_weights(model, find(NAME)), "split": chosen.split,
        "frames": noises.FRAMES, "tuned on": TUNED_ON, "tries": rivals.TRIES, "kinds": kinds,
        "first frame": kept(ours / "first frame.pt", first_frame, model, gaits),
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def hashed(*source: Path) -> str:
    """Of source that results depend on."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in source)).hexdigest()[:8]


def kept(path: Path, make: Callable[..., dict], *of) -> dict:
    """What was made of something before, or is now."""
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        torch.save(make(*of), path)
    return torch.load(path, weights_only=True)


# -- one noise ------------------------------------------------------------------------------------


def by_rivals(model: nn.Module, tuning: list[Case], judged: list[Case]) -> dict[str, dict]:
    """What was seen, and what each rival makes of it, by the setting that is best on `tuning`."""
    methods = {
        SEEN: row_of([case.seen for case in judged], judged, 0.0),
        FILLED: row_of([filters.filled(c.seen, c.missing) for c in judged], judged, 0.0),
    }
    for name, ways in families(model):
        best, said = tuned(ways, tuning)
        begin = time.process_time()
        found = [best(case) for case in judged]
        methods[name] = row_of(found, judged, time.process_time() - begin) | {"chosen": said}
    return methods


@torch.no_grad()
def by_ours(model: nn.Module, judged: list[Case]) -> dict:
    """As `solvers.denoise`, told what is missing and nothing else; and what it would say if it never
    stepped back. Each with its motions, to be looked at."""
    encoding, begin = model.encoding, time.process_time()
    jobs = [job_of(encoding, *see(encoding, case.seen, None, case.missing)) for case in judged]
    done = clean_jobs(model, jobs, Settings())
    seconds = time.process_time() - begin
    found = {OURS: [its.rows for its in done],
             ALWAYS: [(its.cleaned or its).rows for its in done]}  # fmt: skip
    made = {name: [motion_of(encoding, rows) for rows in its] for name, its in found.items()}
    rows = {name: row_of(motions, judged, seconds) for name, motions in made.items()}
    rows[OURS] |= {
        "ways": [its.way for its in done], "noise": [job.noise._asdict() for job in jobs]
    }  # fmt: skip
    return {
        "rows": rows,
        "motions": {k: [(m.root_positions, m.rotations) for m in its] for k, its in made.items()},
    }


def compared(methods: dict[str, dict]) -> dict:
    """All methods on one noise, and ours beside the filter that errs least on the clips judged."""
    best = min(rivals.FILTERS, key=lambda name: sum(methods[name]["each"][ERROR]))
    against = lambda what, who=OURS: ratio(methods[who], methods[best], what)
    means = {
        name: {"means": {k: metrics.bootstrap(its) for k, its in row["each"].items()}}
        | {key: its for key, its in row.items() if key != "each"}
        for name, row in methods.items()
    }
    found = {"clips": len(methods[OURS]["ways"]), "methods": means, "best filter": best,
             "error over the best filter's": against(ERROR),
             "the network's error over the best filter's": against(ERROR, ALWAYS)}  # fmt: skip
    if HIT in methods[OURS]["each"]:
        found["error where it was hit, over the best filter's"] = against(HIT)
    return record.rounded(found)


def row_of(found: list[Motion], judged: list[Case], seconds: float) -> dict:
    """Each clip's numbers, and what they cost."""
    each = [measure(motion, case) for motion, case in zip(found, judged, strict=True)]
    return {
        "each": {key: [its[key] for its in each] for key in each[0]},
        "seconds a second": seconds / sum(motion.seconds for motion in found),
    }


def ratio(ours: dict, theirs: dict, measure: str) -> metrics.Interval:
    """Of means, with an interval over clips, each clip of the one drawn with that of the other."""
    pairs = list(zip(ours["each"][measure], theirs["each"][measure], strict=True))
    return metrics.bootstrap(
        pairs, lambda drawn: sum(a for a, _ in drawn) / sum(b for _, b in drawn)
    )


def _told(cell: dict) -> str:
    error = {name: its["means"][ERROR]["value"] for name, its in cell["methods"].items()}
    return ", ".join(f"{name} {value:.2f}" for name, value in error.items())


# -- the first frame ------------------------------------------------------------------------------


@torch.no_grad()
def first_frame(model: nn.Module, truths: list[Motion]) -> dict:
    """Acceleration at frame 1 and in the middle second of what the network always says, over the
    truth's, medians over clips."""
    of, encoding = cases(truths, "first frame", "white, mid", "test"), model.encoding
    ways = {"zeros": Settings(), "found": replace(Settings(), first_state=True)}
    found = {}
    for name, settings in ways.items():
        jobs = [job_of(encoding, *see(encoding, case.seen, noises.MID, None)) for case in of]
        done = clean_jobs(model, jobs, settings)
        motions = [motion_of(encoding, (its.cleaned or its).rows) for its in done]
        hops = [hop(motion, case.truth) for motion, case in zip(motions, of, strict=True)]
        middle = torch.tensor(hops).quantile(0.5, dim=0).tolist()
        found[name] = dict(zip(("frame 1", "middle"), middle, strict=True))
    return record.rounded({"clips": len(of), "acceleration over the truth's": found})


def hop(motion: Motion, truth: Motion) -> tuple[float, float]:
    """Mean size of the points' acceleration at frame 1, and in the middle second, over the truth's."""
    at = lambda m: m.positions().diff(n=2, dim=0).norm(dim=-1).mean(-1)
    ours, real, middle = at(motion), at(truth), len(truth) // 2
    second = slice(middle - round(truth.fps / 2), middle + round(truth.fps / 2))
    return float(ours[0] / real[0]), float(ours[second].mean() / real[second].mean())


if __name__ == "__main__":
    record.run(main)
