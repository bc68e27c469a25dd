"""From a line on the ground to a walk along it: `motionlab.design`.

    motion, record = motionlab.design([[0, 0], [0, 4], [3, 6]], speed=1.2)
    print(record["notes"])   # what was wished and could not be, by how much, and where

The motion stands where the path stands: x to the left of one who looks along z, metres, y up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from numbers import Real

import torch
from torch import Tensor, nn

from ..encodings import JointAngles
from ..encodings.base import drawn_as_canonical
from ..errors import SolverError
from ..feet.contacts import label
from ..feet.lock import lock_feet
from ..metrics import broken, broken_frames, root_path_error
from ..models import LstmGmm, Refiner
from ..models.sampler import Chance
from ..motion import Motion
from ..paths import CORNER, Curves, Path
from ..weights import load
from .path_control import Followed, follow
from .run_up import begin_with, run_up
from .windows import News

STRIDE = 1.1  # seconds, of a walk
DEEPEST = 0.05  # m that a lock may lower the body: who is held to a line has legs that can't reach
HASTE = 3.0  # deviations above the data's mean step: nobody is faster
SETTLED = 1.0  # seconds after which a path should be kept
FAR, LATE, SLOWER = 0.05, 0.5, 0.15  # m, s, share of the speed: what is told


def design(
    points: Tensor | Sequence | Path,
    speed: float | None = None,
    start: str | int | Motion | None = None,
    model: str | nn.Module = "lstm-gmm-contacts",
    *,
    times: Tensor | Sequence | None = None,
    spline: bool = False,
    corner: float = CORNER,
    refiner: nn.Module | None = None,
    lock: bool = False,
    seed: int = 0,
    watch: Callable[[Motion, float], None] | None = None,
    progress: bool = False,
    **settings,
) -> tuple[Motion, dict]:
    """The likeliest motion whose root follows a path (RNN-GAN, section 5.2), and how well it does.

    Parameters
    ----------
    points : (n, 2) metres, x and z: corners of a line, or places of a curve. Or a `Path`.
    speed : m/s, less in sharp bends; 1.2 if nothing is said. Not with times.
    start : what the character does when the path begins: number or beginning of the name of one of
        the model's starts, such as "run"; or a motion on its body at its rate, whose end it has just
        done. None: what suits the speed.
    model : name of shipped weights, or a model as `motionlab.load` gives it.
    times : (n,) seconds at which to be at the points, rising; the motion lasts from the first to the
        last.
    spline : a smooth curve through the points.
    corner : metres, radius to which sharper corners are rounded, as people do.
    refiner : corrects the motion behind the search; the root stays over the way that was found.
    lock : hold toes still while they are in contact, at the very end; the root may sink, and no more.
    seed : of all chance.
    watch : called behind each window as ``watch(motion, done)`` with the frames that newly stand fast,
        where they stand in the world, and the share of the path that is done, 0 to 1. Put together they
        are what is given in the end, before refiner and lock. KeyboardInterrupt in it leaves off.
    progress : show a bar. Interrupted (Ctrl-C), what is solved so far is given.
    settings : of `path_control.follow`, such as weights, method, steps, candidates.

    Returns
    -------
    The motion, and a record: a dict with "error (cm)", "timing", "largest error", "terms",
    "evaluations", "seconds", "notes", ...; see `recorded`.

    Raises
    ------
    WayError : no path, or times that go back.
    SolverError : a speed that is none, no such start, a model or a refiner that can't do it.
    EncodingError : a motion to start with that has another skeleton or rate.
    ModelError : there are no such weights.
    """
    path = points if isinstance(points, Path) else Path.through(points, times, spline, corner)
    one = None if watch is None else lambda number, motion, done: watch(motion, done)
    return design_all([path], speed, start, model, refiner=refiner, lock=lock, seed=seed, watch=one,
                      progress=progress, **settings)[0]  # fmt: skip


def design_all(
    paths: Sequence[Path],
    speed: float | None = None,
    start: str | int | Motion | None = None,
    model: str | nn.Module = "lstm-gmm-contacts",
    *,
    refiner: nn.Module | None = None,
    lock: bool = False,
    seed: int = 0,
    watch: Callable[[int, Motion, float], None] | None = None,
    progress: bool = False,
    **settings,
) -> list[tuple[Motion, dict]]:
    """`design` for many paths side by side, which takes far less time than one after the other.

    watch is called as ``watch(number of the path, motion, done)``.
    """
    name = model if isinstance(model, str) else getattr(model, "about", {}).get("name", "")
    model = checked(load(model) if isinstance(model, str) else model, refiner)
    speed = _speed(speed, paths)
    fastest = fastest_of(model)
    tables = [path.timetable(speed, fastest, model.fps) for path in paths]
    paces = [_pace(table, model.fps) for table in tables]
    begun, names = begin_with(model, start, paces)
    sampling = getattr(model, "sampling", {})
    chance = Chance(torch.Generator().manual_seed(seed), **sampling)
    before = run_up(model, begun, paths, paces, chance)
    seen = None if watch is None else _shown(model, watch)
    found = follow(
        model, paths, before, tables, fastest=fastest, chance=chance, watch=seen, progress=progress,
        **settings,
    )  # fmt: skip
    made = []
    for path, walked, begin, table in zip(paths, found, names, tables, strict=True):
        motion = model.encoding.to_motion(
            walked.features, walked.place, f"path {path.length:.1f} m", name
        )
        motion = finished(motion, refiner, lock)
        made.append((motion, recorded(motion, path, table, speed, fastest, walked)))
        made[-1][1]["start"] = begin
    return made


def _shown(model: LstmGmm, watch: Callable[[int, Motion, float], None]) -> Callable[[News], None]:
    """News of features as motion; the frame that a path begins with comes with its first."""
    begun = set()

    def seen(news: News) -> None:
        motion = model.encoding.to_motion(news.features, news.place)
        watch(news.path, motion[news.path in begun :], news.done)
        begun.add(news.path)

    return seen


@torch.no_grad()
def finished(motion: Motion, refiner: Refiner | None = None, lock: bool = False) -> Motion:
    """A motion as `design` gives it: its body refined, its toes held still while they are in contact.

    The refiner knows of no path and would leave it by some millimetres a step: the root stays over the
    way it has. Nor does it know what joints can do: what it turns beyond the range of the data is
    brought back to its edge. A lock lowers the root at most.
    """
    if refiner is not None:
        encoding = refiner.encoding
        features = refiner(encoding.encode(motion)[None])[0]
        if broken.knows(encoding):
            features = broken.within(encoding, features)
        body = encoding.to_motion(features, encoding.start_of(motion), motion.name, motion.source)
        root = motion.root_positions.clone()
        root[:, 1] = body.root_positions[:, 1]
        motion = replace(body, root_positions=root)
    if lock:
        found = label(motion)  # the network tells a frame late now and then, the refiner another
        found = found if motion.contacts is None else found | motion.contacts
        motion = lock_feet(motion, found, floor=None, deepest=DEEPEST)
    return motion


def fastest_of(model: LstmGmm) -> float:
    """Metres a second that no motion of the model's data goes far beyond."""
    mean, std = model.normalizer.mean[1], model.normalizer.std[1]
    return float(model.fps * (mean + HASTE * std))


# -- what came of it ------------------------------------------------------------------------------


def recorded(
    motion: Motion, path: Path, table: Tensor, speed: float, fastest: float, walked: Followed
) -> dict:
    """How near a motion came to what was wished, fit for JSON.

    "error (cm)" : root mean square and largest distance of the root from the curve that was to be
    walked, after the first second; "rms to the drawn line" is that to the line before its corners
    were rounded; "rms of the stride's mean" is that of the mean error over a stride: sway, which comes and
    goes with each step, is left out.
    "largest error" : where that was, and when. "timing" : speeds, and how late or early it was.
    "broken frames" : those with a pose that nobody in the data holds (`metrics.broken_frames`), or None
    for a body of which this is not known. "terms" : nats a frame. "notes" : sentences on what was not reached.
    """
    root = motion.positions()[:, motion.skeleton.roles.get("hips", 0)]
    settled = min(round(SETTLED * motion.fps), len(root) - 1)
    off = root_path_error(root[:, None, None], path.drawn).rms  # (frames,)
    worst = settled + int(off[settled:].argmax())
    aside = _aside(root[settled:, [0, 2]], path)
    stride = round(STRIDE * motion.fps)
    mean = aside.unfold(0, stride, 1).mean(-1) if len(aside) > stride else None
    seconds = (len(root) - 1) / motion.fps
    broken = None
    if drawn_as_canonical(motion.skeleton):
        broken = int(broken_frames(motion).sum())
    way = float(root[:, [0, 2]].diff(dim=0).norm(dim=-1).sum())
    asked = (len(table) - 1) / motion.fps
    record = {
        "path (m)": path.length,
        "error (cm)": {
            "rms": 100 * _rms(aside),
            "rms to the drawn line": 100 * _rms(off[settled:, None] / 100),
            "rms of the stride's mean": None if mean is None else 100 * _rms(mean),
            "largest": float(off[worst]),
        },
        "largest error": {
            "seconds": worst / motion.fps,
            "place (m)": [round(float(x), 2) for x in root[worst, [0, 2]]],
        },
        "timing": {
            "asked (m/s)": None if path.times is not None else speed,
            "fastest (m/s)": fastest,
            "walked (m/s)": way / seconds if seconds else None,
            "asked (s)": asked if path.times is None else float(path.times[-1] - path.times[0]),
            "walked (s)": seconds,
            "missing at the end (m)": float((root[-1, [0, 2]] - path.places[-1]).norm()),
        },
        "terms (nats a frame)": walked.parts,
        "evaluations": walked.evaluations,
        "begun again": walked.retries,
        "broken frames": broken,
        "seconds": walked.seconds,
        "finished": walked.finished,
        "interrupted": walked.interrupted,
    }
    return record | {"notes": _notes(record)}


def enlarged(record: dict, larger: float) -> dict:
    """What `recorded` says, of the same motion on a body whose ways are so many times as long."""

    def times(values: dict, units: tuple[str, ...]) -> dict:
        return {
            name: larger * value if value is not None and name.endswith(units) else value
            for name, value in values.items()
        }

    error = {name: None if cm is None else larger * cm for name, cm in record["error (cm)"].items()}
    worst = record["largest error"]
    place = [round(larger * metres, 2) for metres in worst["place (m)"]]
    record = times(record, ("(m)",)) | {
        "error (cm)": error,
        "largest error": worst | {"place (m)": place},
        "timing": times(record["timing"], ("(m)", "(m/s)")),
    }
    return record | {"notes": _notes(record)}


def _aside(root: Tensor, path: Path) -> Tensor:
    """From the nearest places of the curve that was to be walked to the root (frames, 2), metres."""
    zero = torch.zeros(1, dtype=torch.float64)
    piece = Curves([path]).piece(zero, zero + path.length, torch.tensor([0]))
    return root.double() - piece.nearest(root[None].double()).places[0]


def _rms(off: Tensor) -> float:
    return float(off.square().sum(1).mean().sqrt())


def _notes(record: dict) -> list[str]:
    said, timing, error = [], record["timing"], record["error (cm)"]
    asked, walked = timing["asked (m/s)"], timing["walked (m/s)"]
    if record["interrupted"]:
        said.append(f"interrupted: this is the way to {timing['walked (s)']:.1f} s")
    elif not record["finished"]:
        said.append(f"did not come to the end within {timing['walked (s)']:.1f} s")
    if record["broken frames"]:
        said.append(f"{record['broken frames']} frames hold a pose that nobody in the data holds")
    if asked is not None and asked > timing["fastest (m/s)"]:
        said.append(
            f"{asked:g} m/s is faster than anybody in the data; {timing['fastest (m/s)']:.1f} m/s "
            "was asked for"
        )
    elif asked is not None and walked is not None and abs(walked / asked - 1) > SLOWER:
        said.append(f"{walked:.2f} m/s on average where {asked:g} was asked")
    if asked is None and timing["missing at the end (m)"] > FAR + 0.15:
        said.append(f"at the last moment it is {timing['missing at the end (m)']:.1f} m from there")
    if error["largest"] > 100 * FAR:
        x, z = record["largest error"]["place (m)"]
        said.append(
            f"up to {error['largest']:.0f} cm from the drawn line, at "
            f"{record['largest error']['seconds']:.1f} s near x {x:g}, z {z:g}"
        )
    return said


# -- what is given --------------------------------------------------------------------------------


def checked(model: nn.Module, refiner: nn.Module | None) -> LstmGmm:
    if not isinstance(model, LstmGmm) or not isinstance(model.encoding, JointAngles):
        raise SolverError(
            f"What is steered is an LstmGmm on JointAngles, such as lstm-gmm-contacts; this is "
            f"{type(model).__name__}."
        )
    if refiner is not None and not isinstance(refiner, Refiner):
        raise SolverError(f"refiner is {type(refiner).__name__}; load one, as refiner-contacts.")
    if refiner is not None and refiner.encoding.config() != model.encoding.config():
        raise SolverError("The refiner corrects features of another kind than the model's.")
    return model


def _speed(speed: float | None, paths: Sequence[Path]) -> float:
    if speed is not None and any(path.times is not None for path in paths):
        raise SolverError("A path with times has its speeds; leave the speed out.")
    speed = 1.2 if speed is None else speed
    if not isinstance(speed, Real) or not 0.1 <= speed < math.inf:
        raise SolverError(f"speed is {speed!r}; it must be metres a second, 0.1 or more.")
    return float(speed)


def _pace(table: Tensor, fps: float) -> float:
    """Metres a second that a timetable begins with."""
    some = min(len(table) - 1, round(fps / 2))
    return float(table[some] - table[0]) * fps / some
