"""Moments to start from, of the validation clips: each named by what follows it, or by its clip.

What follows is a gait, or a change of it that has just begun (`training.changes`).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from ..encodings import RootRelative
from ..errors import TrainingError
from ..feet import contacts
from .changes import NAMES, changing
from .dances import DanceWindows
from .prepared import Prepared

OBSERVED = 1.0  # seconds that the network sees before a start
AFTER = 1.0  # seconds that the start is named after
STEP = 10  # frames from one candidate to the next

# What is looked for: gait, turn (-1 to the right, 0, 1 to the left), and which of all that do this,
# as quantiles of their speed.
WANTED = (
    ("walk", 0, (0.5, 0.1, 0.9)),
    ("walk", 1, (0.25, 0.75)),
    ("walk", -1, (0.25, 0.75)),
    ("run", 0, (0.2, 0.5, 0.9)),
    ("run", 1, (0.5,)),
    ("run", -1, (0.5,)),
    ("stand", 0, (0.5,)),
    ("backwards", 0, (0.5,)),
    ("sidestep left", 0, (0.5,)),
    ("sidestep right", 0, (0.5,)),
)
TURNS = {-1: ", turn right", 0: "", 1: ", turn left"}
MOST = 12  # of starts that are named by their clips


@dataclass(frozen=True)
class Start:
    """A moment in a clip, and what the body does in the second after it."""

    clip: int
    frame: int  # the first that the network has not seen
    gait: str
    turn: int
    speed: float  # m/s over the ground

    @property
    def name(self) -> str:
        speed = "" if self.gait == "stand" else f" {self.speed:.1f} m/s"
        return f"{self.gait}{speed}{TURNS[self.turn]}"


@dataclass(frozen=True)
class Change:
    """A moment in a clip at which something else has just begun: the name says what."""

    clip: int
    frame: int  # the first that the network has not seen
    name: str
    share: float  # of the change, seen before it


def before_starts(data: Prepared, fps: float) -> tuple[Tensor, list[str]]:
    """What a network sees before it goes on: a second (starts, frames, dim) each, and names.

    data : as the network has them; fps : its frames a second, fewer than those of data of dances.

    Raises
    ------
    TrainingError : there is no validation clip to start from.
    """
    if isinstance(data.encoding, RootRelative):
        return of_dances(data, fps)
    chosen, seen = choose(candidates(data)) + changes(data), round(OBSERVED * fps)
    if not chosen:
        return of_clips(data, seen)
    clips = data.clips("val")
    before = torch.stack([clips[s.clip][s.frame - seen : s.frame] for s in chosen])
    return before, [start.name for start in chosen]


def candidates(data: Prepared) -> list[Start]:
    """Moments of the validation clips, each with what follows it."""
    encoding, found = data.encoding, []
    before, after = round(OBSERVED * encoding.fps), round(AFTER * encoding.fps)
    for number, clip in enumerate(data.clips("val")):
        points = encoding.positions(clip)
        down = contacts.label_positions(points, encoding.skeleton, encoding.fps)
        for frame in range(before, len(clip) - after + 1, STEP):
            span = slice(frame, frame + after)
            steps = clip[span, :3].mean(0) * encoding.fps  # to the left, ahead, turn; a second
            found.append(Start(number, frame, *doing(steps.tolist(), down[span])))
    return found


def doing(steps: list[float], down: Tensor) -> tuple[str, int, float]:
    """Gait, turn and speed; from m/s to the left, m/s ahead, rad/s, and contacts (frames, 4)."""
    left, ahead, turn = steps
    speed = (left**2 + ahead**2) ** 0.5
    flight = (~down.any(1)).double().mean().item()
    if speed < 0.15:
        gait = "stand"
    elif abs(left) > abs(ahead):
        gait = "sidestep left" if left > 0 else "sidestep right"
    elif ahead < 0:
        gait = "backwards"
    else:
        gait = "run" if flight > 0.1 else "walk"  # who runs is in the air now and then
    return gait, 0 if abs(turn) < 0.5 else 1 if turn > 0 else -1, speed


def choose(found: list[Start]) -> list[Start]:
    """The starts that are wanted, as far as there are any, each of another clip if there is one."""
    chosen: list[Start] = []
    for gait, turn, quantiles in WANTED:
        alike = [start for start in found if (start.gait, start.turn) == (gait, turn)]
        for quantile in quantiles:
            alike = [start for start in alike if start.name not in {s.name for s in chosen}]
            unseen = [start for start in alike if start.clip not in {s.clip for s in chosen}]
            if some := unseen or alike:
                speeds = torch.tensor([start.speed for start in some], dtype=torch.float64)
                nearest = (speeds - speeds.quantile(quantile)).abs().argmin()
                chosen.append(some[nearest])
    return chosen


def changes(data: Prepared) -> list[Change]:
    """Of each kind of change that the validation clips hold, the moment that sees least of it."""
    encoding, freshest = data.encoding, {}
    for number, clip in enumerate(data.clips("val")):
        points = encoding.positions(clip)
        for name, shares in changing(points, encoding.skeleton, encoding.fps).items():
            if not shares.isfinite().any():
                continue
            frame = int(shares.nan_to_num(torch.inf).argmin())
            found = Change(number, frame, name, float(shares[frame]))
            if name not in freshest or found.share < freshest[name].share:
                freshest[name] = found
    return [freshest[name] for name in NAMES if name in freshest]


def of_clips(data: Prepared, seen: int) -> tuple[Tensor, list[str]]:
    """The first frames (starts, at most `seen`, dim) of clips, where what follows has no name."""
    rows = zip(data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True)
    clips = {_title(name): clip for name, split, clip in rows if split == "val"}
    if not clips:
        raise TrainingError("There are no validation clips to start from.")
    seen = min(seen, max(map(len, clips.values())))
    clips = {name: clip[:seen] for name, clip in clips.items() if len(clip) >= seen}
    names = _spread(list(clips), MOST)
    return torch.stack([clips[name] for name in names]), names


def of_dances(data: Prepared, fps: float) -> tuple[Tensor, list[str]]:
    """A second (starts, frames, dim) of dancing before each start, spread evenly, and names."""
    seen, found = round(OBSERVED * fps), []
    for name, split, clip in zip(
        data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True
    ):
        if split != "val" or name.endswith("_2/2"):  # nearly the same as its other half
            continue
        windows = DanceWindows([clip], seen, data.encoding.fps / fps, tempo=0.0, turn=False)
        (windows,) = windows.tiles(10_000)
        title = _title(name).removesuffix("_1/2")
        found += [(window, f"{title}, {i + 1} s") for i, window in enumerate(windows)]
    if not found:
        raise TrainingError("The validation clips hold nothing to start from.")
    windows, names = zip(*_spread(found, MOST), strict=True)
    return torch.stack(windows), list(names)


def _title(name: str) -> str:
    """Of a clip, without its source."""
    return name.partition("/")[2]


def _spread(items: list, most: int) -> list:
    """At most so many of them, spread evenly."""
    chosen = torch.linspace(0, len(items) - 1, min(most, len(items))).round().long()
    return [items[i] for i in chosen.tolist()]
