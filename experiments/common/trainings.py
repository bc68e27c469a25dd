"""Trainings in folders of their own: what the experiments share that compare many of them.

Stopped and started again, a training goes on where it was.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from motionlab.errors import DivergedError
from motionlab.training import Prepared, Preset, build


@dataclass(frozen=True)
class Row:
    """Trainings that differ in their seed only."""

    name: str
    what: str
    changes: dict = field(default_factory=dict)  # of the preset
    data: str = ""


@dataclass(frozen=True)
class Run:
    """One training."""

    row: Row
    seed: int
    preset: Preset
    folder: Path
    first: Path | None = None  # weights it begins with

    @property
    def curve(self) -> list[dict]:
        """What every validation found so far."""
        path = self.folder / "curve.json"
        return json.loads(path.read_text()) if path.exists() else []

    @property
    def made(self) -> int:
        """Updates that are done."""
        return self.curve[-1]["update"] if self.curve else 0

    @property
    def validation(self) -> float:
        """The lowest loss on validation clips so far; infinite if none is finite."""
        found = [point["val"] for point in self.curve if math.isfinite(point["val"])]
        return min(found, default=math.inf)

    @property
    def fell_apart(self) -> bool:
        return (self.folder / "failed.txt").exists()

    @property
    def done(self) -> bool:
        """A training that fell apart is done with what it has."""
        return self.made >= self.preset.updates or self.fell_apart

    def train(self, data: Prepared, name: str) -> None:
        """Train the model of some name, or go on."""
        from motionlab.training.loop import train

        print(f"\n{self.folder}: {self.row.what}", flush=True)
        model = build(data, self.preset, self.first)
        try:
            train(model, data, self.preset, self.folder, name=name, start=self.first, progress=True)
        except DivergedError as error:
            (self.folder / "failed.txt").write_text(str(error), encoding="utf-8")


def show(runs: Iterable[Run]) -> None:
    """Print how far they are."""
    for run in runs:
        print(f"{run.made:6} of {run.preset.updates:6}  {run.folder}")
