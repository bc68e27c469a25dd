"""Moments to start from, for weights that ship: of the validation clips, each with a name."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from motionlab import MotionLabError, contacts
from motionlab.training import Prepared
from motionlab.training.dances import DanceWindows

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
    """The starts that are wanted, as far as there are any, each of another clip."""
    chosen: list[Start] = []
    for gait, turn, quantiles in WANTED:
        alike = [start for start in found if (start.gait, start.turn) == (gait, turn)]
        for quantile in quantiles:
            alike = [
                start for start in alike
                if start.clip not in {other.clip for other in chosen}
                and start.name not in {other.name for other in chosen}
            ]  # fmt: skip
            if alike:
                speeds = torch.tensor([start.speed for start in alike], dtype=torch.float64)
                nearest = (speeds - speeds.quantile(quantile)).abs().argmin()
                chosen.append(alike[nearest])
    if not chosen:
        raise MotionLabError("The validation clips hold nothing to start from.")
    return chosen


def of_dances(data: Prepared, fps: float, most: int = 12) -> tuple[Tensor, list[str]]:
    """A second (starts, frames, dim) of dancing before each start, spread evenly, and names."""
    seen, found = round(OBSERVED * fps), []
    for name, split, clip in zip(
        data.names, data.splits, data.features.split(data.lengths.tolist()), strict=True
    ):
        if split != "val" or name.endswith("_2/2"):  # nearly the same as its other half
            continue
        windows = DanceWindows([clip], seen, data.encoding.fps / fps, tempo=0.0, turn=False)
        (windows,) = windows.tiles(10_000)
        title = name.split("/")[1].removesuffix("_1")
        found += [(window, f"{title}, {i + 1} s") for i, window in enumerate(windows)]
    if not found:
        raise MotionLabError("The validation clips hold nothing to start from.")
    chosen = torch.linspace(0, len(found) - 1, min(most, len(found))).round().long().tolist()
    windows, names = zip(*(found[i] for i in chosen), strict=True)
    return torch.stack(windows), list(names)
