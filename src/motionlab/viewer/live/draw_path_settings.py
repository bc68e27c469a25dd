"""What both forms of a drawn path share: what may be chosen, and the paths that were solved before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from torch import nn

from ...encodings import JointAngles
from ...errors import ViewerError, WayError
from ...motion import Motion
from ...paths import Path
from ..pictures.palette import CYCLE, PATH
from .dream_settings import REFINED, Control, check_starts, sampled_tracks
from .network_weights import check_refiner
from .player import Track, payload

SPEED = Control("speed", "Speed (m/s)", "Less in sharp bends", 0.4, 4, 0.1, 1.2)
START = Control("start", "Start", "What the character does when the path begins", -1, 0, 1, -1)
SEED = Control("seed", "Seed", "The same seed gives the same motion", 0, 9999, 1, 0)
SOLVED = CYCLE[4]  # of what was solved beforehand, beside what walks now
MOST = 40  # paths that were solved beforehand
FLOOR_SECONDS = 1.0


def check_model(model: nn.Module) -> None:
    """Raise ViewerError if a model can't be led along a path."""
    if type(model).__name__ != "LstmGmm" or not isinstance(model.encoding, JointAngles):
        raise ViewerError(
            "draw_path: a path is followed by an LstmGmm on JointAngles, such as lstm-gmm-contacts; "
            f"this is {type(model).__name__}."
        )
    check_starts(model)


def sampled(model: nn.Module, color: str) -> list[Track]:
    """A little motion from each start: it tells where the floor is, and how tall the body."""
    frames = round(FLOOR_SECONDS * model.fps)
    return sampled_tracks(
        model, model.starts, frames, seed=0, color=color, **getattr(model, "sampling", {})
    )


def content_of(
    model: nn.Module,
    solved: Sequence[Sequence],
    speed: float,
    height: int,
    floor: float,
    refiner: nn.Module | None = None,
) -> dict[str, Any]:
    """What the figure reads in a page and in a kernel; parameters as of `draw_path`."""
    lowest, highest = SPEED.min, SPEED.max
    if not isinstance(speed, int | float) or not lowest <= speed <= highest:
        raise ViewerError(
            f"draw_path: speed is {speed!r}; the slider goes from {lowest:g} to {highest:g} m/s."
        )
    if not isinstance(height, int) or not 120 <= height <= 2000:
        raise ViewerError(f"draw_path: height is {height!r}; give pixels, from 120 to 2000.")
    if refiner is not None:
        check_refiner(model, refiner)
    controls = (START, SEED) if refiner is None else (START, SEED, REFINED)
    names = list(model.start_names)
    known = [_read(number, item, names, model.fps) for number, item in enumerate(solved)]
    if len(known) > MOST:
        raise ViewerError(f"draw_path: {len(known)} solved paths; a page holds at most {MOST}.")
    tracks = [
        Track(m.positions().detach().cpu(), m.skeleton, "", SOLVED, m.contacts, about["name"], m)
        for about, m in known
    ]
    return {
        "controls": [asdict(SPEED) | {"value": speed}, *map(asdict, controls)],
        "starts": names,
        "solved": [about for about, _ in known],
        "walks": payload(tracks, model.fps) if tracks else None,
        "fps": model.fps,
        "floor": floor,
        "height": height,
        "pathColor": PATH,
        "facts": [],
    }


def _read(
    number: int, item: Any, starts: Sequence[str], fps: float
) -> tuple[dict[str, Any], Motion]:
    """What the page knows of a path that was solved beforehand, and its motion."""
    where = f"draw_path: solved path {number + 1}"
    if not isinstance(item, list | tuple) or len(item) not in (3, 4):
        raise ViewerError(
            f"{where} is a {type(item).__name__}; give (name, points, motion) or (name, points, "
            "motion, record), motion and record as motionlab.design gives them."
        )
    name, points, motion, record = [*item, None][:4]
    if not isinstance(motion, Motion):
        raise ViewerError(f"{where} ({name}): its motion is a {type(motion).__name__}, no Motion.")
    if abs(motion.fps - fps) > 0.01:
        raise ViewerError(
            f"{where} ({name}) has {motion.fps:g} fps and the model {fps:g}, but they share a clock; "
            f"bring it to that rate first, as in motion.resample({fps:g})."
        )
    record = record if isinstance(record, Mapping) else {}
    speed = record.get("timing", {}).get("asked (m/s)")
    start = record.get("start")
    return {
        "name": str(name),
        "points": _points(points, f"{where} ({name})"),
        "speed": min(max(speed, SPEED.min), SPEED.max) if speed is not None else None,
        "start": starts.index(start) if start in starts else None,
    }, motion


def _points(points: Any, where: str) -> list[list[float]]:
    """Places [x, z] of the line as it was drawn: the page rounds its corners anew."""
    try:
        path = points if isinstance(points, Path) else Path.through(points)
    except WayError as error:
        raise ViewerError(f"{where}: {error}") from error
    return path.drawn.numpy().round(4).tolist()
