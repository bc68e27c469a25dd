"""Offline motion design (RNN-GAN, section 5.2): the likeliest motion whose root follows a path.

Window after window of 34 frames, 17 of which are solved again with the next: those at the end of a
window do not know yet what comes. In each,

1. a few ways to go on are sampled, and the one of least energy is the first guess;
2. `window.solve` descends from there, and goes on where that has not led near the path (`windows.LONGER`);
3. who fell off his path, off his feet, or far behind begins again from guided samples (`retries` times);
4. the first 17 frames stand fast, and the network's state goes on exactly behind them.

All paths go side by side, as one batch.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from tqdm import tqdm

from ..errors import SolverError
from ..metrics import broken
from ..models import LstmGmm
from ..models.sampler import Chance
from ..paths import Path
from . import terms
from .energy import Before
from .window import METHODS
from .windows import RETRIES, Job, News, Settings, Stretch, Way, Wishes

WINDOW, OVERLAP = 34, 17  # frames, the paper's
CANDIDATES, STEPS = 4, 25
PATIENCE = 2.0  # times the frames of the timetable, after which nobody waits any longer


def wishes(stretch: Stretch) -> dict[str, terms.Term]:
    """The terms of a root that follows a path in time; the toes' if the model tells contacts."""
    encoding = stretch.model.encoding
    found = {
        "path": terms.path(stretch.piece),
        "time": terms.time(stretch.piece, stretch.arcs),
        "ahead": terms.ahead(stretch.piece, encoding.fps),
        "resting": terms.resting(encoding.skeleton, encoding.fps),
    }
    if "contacts" in encoding.slices:
        found["contact"] = terms.contact(encoding.skeleton)
    if broken.knows(encoding):
        found["poses"] = terms.poses(encoding)
    return found


@dataclass
class Followed:
    """Motion of one path, and how it was found.

    features : (frames, dim), raw units; the first frame is the one that was given, and stands at
    place : (3,), x, z in metres and yaw in radians.
    parts : nats a frame of each term, mean over the windows.
    evaluations : of the energy of a window; retries : windows that began again from other samples.
    seconds : of the processor, this path's share of the batch.
    finished : whether it came to the end of its path; interrupted : whether somebody stopped it.
    """

    features: Tensor
    place: Tensor
    parts: dict[str, float]
    evaluations: int
    retries: int
    seconds: float
    finished: bool
    interrupted: bool


def follow(
    model: LstmGmm,
    paths: Sequence[Path],
    before: Before,
    tables: Sequence[Tensor],
    *,
    fastest: float,
    wish: Wishes = wishes,
    weights: Mapping[str, float | Tensor] | None = None,
    method: str = "adam",
    steps: int = STEPS,
    candidates: int = CANDIDATES,
    guide: bool = False,
    retries: int = RETRIES,
    window: int = WINDOW,
    overlap: int = OVERLAP,
    chance: Chance | None = None,
    watch: Callable[[News], None] | None = None,
    progress: bool = False,
) -> list[Followed]:
    """Motion along paths, side by side.

    Parameters
    ----------
    model : on `JointAngles`.
    paths : (n), and before : (n), the frame that each begins with, where the path begins.
    tables : of each path, metres (frames + 1,) behind the root, as `Path.timetable` gives them.
    fastest : m/s that who is late does not go beyond.
    wish : what is wished in a window.
    weights : of its terms, by name: a number, or one for each path
        (n,).
    method, steps : of `window.solve`.
    candidates : samples that the first guess is chosen from.
    guide : whether they are `guided` to the
        path, or free. Guided ones are nearer to it, and less of a walk: what the push bends stays bent,
        and the end is no better.
    retries : times that a window which came to nothing begins again, from
        guided samples: free ones keep their own pace, and do not wait where one is to wait.
    window, overlap : frames; with a window of 1 and no overlap nobody looks ahead.
    chance : how samples are drawn; None: as the model's `sampling` says, from seed 0.
    watch : called behind each window, for each path that is still walked, with what newly stands fast.
    progress : show a bar.

    Interrupted (Ctrl-C, or a KeyboardInterrupt in `watch`), it gives what it has, and says so.

    Raises
    ------
    SolverError : settings that make no sense, or a term that the model can't have.
    """
    if chance is None:
        chance = Chance(torch.Generator().manual_seed(0), **getattr(model, "sampling", {}))
    how = Settings(fastest, wish, weights or {}, chance, method, steps, candidates, guide, retries,
                   window, overlap)  # fmt: skip
    _check(how, len(paths))
    ways = [
        Way(table.double(), [frame])
        for table, frame in zip(tables, before.frame[:, None], strict=True)
    ]
    job = Job(model, list(paths), before, ways, how)
    begin, longest, interrupted = time.process_time(), max(map(len, tables)) - 1, False
    with tqdm(total=longest, unit="frame", disable=not progress, leave=False) as bar:
        try:
            while len(job.which) and job.first < PATIENCE * longest + window:
                fast = job.go_on()
                bar.update(min(window - overlap, longest - bar.n))
                for news in fast if watch else ():
                    watch(news)
        except KeyboardInterrupt:
            if not job.first:
                raise
            interrupted = True
            job.leave_off()
    seconds = (time.process_time() - begin) / len(paths)
    return [
        Followed(torch.cat(way.frames), place, _means(way.parts), way.evaluations, way.retries,
                 seconds, way.finished, interrupted and not way.finished)
        for way, place in zip(job.ways, before.place, strict=True)
    ]  # fmt: skip


def _means(parts: list[dict[str, float]]) -> dict[str, float]:
    return (
        {name: sum(row[name] for row in parts) / len(parts) for name in parts[0]} if parts else {}
    )


def _check(how: Settings, paths: int) -> None:
    if how.method not in METHODS:
        raise SolverError(f"method is {how.method!r}; it must be one of {', '.join(METHODS)}.")
    if how.steps < 1 or how.candidates < 1 or how.retries < 0:
        raise SolverError(
            f"{how.steps} steps, {how.candidates} candidates, {how.retries} retries: at least 1, 1 and 0."
        )
    for name, weight in how.weights.items():
        if isinstance(weight, Tensor) and weight.ndim and weight.shape != (paths,):
            raise SolverError(
                f"The weights of {name!r} have shape {tuple(weight.shape)}; there must be a number, or "
                f"weights for {paths} path{'s' if paths > 1 else ''}."
            )
    if not 0 <= how.overlap < how.window or (how.window > 1 and how.overlap < 1):
        raise SolverError(
            f"Windows of {how.window} frames that share {how.overlap}: they must share at least 1 and "
            "go on by at least 1. A window of 1 frame shares none."
        )


# What a search is compared with: settings of `follow` and of `motionlab.design`.
BASELINES: dict[str, dict] = {
    "best of 64 free samples": {"method": "none", "candidates": 64, "retries": 0},
    "guided sampling": {"method": "none", "guide": True, "candidates": 1, "retries": 0},
    "swarm": {"method": "swarm", "candidates": 1, "retries": 0, "steps": 30},
    "L-BFGS": {"method": "lbfgs", "candidates": 1, "retries": 0, "steps": 60},
    "swarm, then L-BFGS": {"method": "paper", "candidates": 1, "retries": 0, "steps": 60},
    "frame by frame": {"window": 1, "overlap": 0, "retries": 0},
}
