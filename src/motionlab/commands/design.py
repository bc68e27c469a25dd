"""`motionlab design`: a path in a table becomes a walk along it, as BVH or GLB."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from ..errors import MotionLabError, WayError
from .choices import RootMotion, way_of
from .clips import check_no_fbx
from .programs import ANY
from .rig import Rig, brought_onto
from .sample import check_seed, check_writable, refiner_of

if TYPE_CHECKING:
    from ..motion import Motion

LONG = 60.0  # seconds of motion: some minutes of work
COLUMNS = (["x", "z"], ["t", "x", "z"])


@dataclass(kw_only=True)
class Design(Rig):
    """A walk along a path, as BVH or GLB: it stands where the path stands, in metres, y up."""

    path: Positional[Annotated[Path, arg(metavar="PATH.csv")]]
    """Places on the ground, one a line, under a header x,z, or t,x,z with seconds at which to be there."""
    out: Path
    """File to write; its name ends in .bvh, .glb, .usda or .xml."""
    speed: float | None = None
    """Metres a second, 1.2 if left out; not with times."""
    start: Annotated[str | None, arg(metavar="INDEX|NAME")] = None
    """What the character does at first: start by number or by how its name begins, such as run; if
    left out, what suits the speed."""
    model: Annotated[str, arg(metavar="NAME|WEIGHTS")] = "lstm-gmm-contacts"
    """Shipped weights, or a file of your own."""
    spline: bool = False
    """Lead a smooth curve through the places instead of straight lines."""
    corner: float = 0.4
    """Metres, radius to which sharper corners are rounded; 0 leaves them."""
    refine: bool = False
    """Let the shipped refiner correct it, so that feet slide less."""
    lock_feet: Annotated[bool, arg(name="lock-feet")] = False
    """Hold toes still while they are in contact."""
    seed: int = 0
    """Start of all chance."""
    steps: int = 25
    """Steps of the search in each window; fewer are faster and farther from the path."""
    skeleton: Annotated[str | None, arg(metavar="RIG|canonical")] = None
    """Bring the motion to this rig: a file in which a person stands, at rest or in a frame."""
    root_motion: RootMotion = None
    """ground: a root joint on the floor carries way and heading, as game engines want; in-place:
    these are left out; none, as if left out: they stay with the body."""

    def run(self) -> None:
        from ..paths import Path as Way
        from ..solvers.design import design_all, enlarged
        from ..weights import load

        root_motion = way_of(self.root_motion)
        if self.out.suffix.lower() not in ANY.endings:
            check_no_fbx(self.out)
            raise MotionLabError(
                f"--out {self.out}: the name must end in {' or '.join(ANY.endings)}."
            )
        points, times = read_path(self.path)
        check_seed(self.seed)
        check_writable(self.out)
        rig = None if self.skeleton is None else self.find_rig(self.skeleton)
        model = load(self.model)
        refiner = refiner_of(model, self.model) if self.refine else None
        larger = 1.0 if self.skeleton is None else _larger(model.encoding.skeleton, rig)
        try:
            # another body goes as much farther in a step as its legs are longer
            way = Way.through(
                [[c / larger for c in point] for point in points], times, self.spline,
                self.corner / larger,
            )  # fmt: skip
        except WayError as error:
            raise WayError(f"{self.path}: {error}") from error
        speed = None if self.speed is None else self.speed / larger
        lasting = way.length / (speed or 1.2) if times is None else times[-1] - times[0]
        if lasting > LONG:
            print(
                f"{lasting:.0f} s of motion; this takes a while. Ctrl-C keeps what is done",
                flush=True,
            )
        ((motion, record),) = design_all(
            [way], speed, self.start, model, refiner=refiner, lock=self.lock_feet,
            seed=self.seed, steps=self.steps, progress=True,
        )  # fmt: skip
        said = [] if larger == 1 else [f"of its own size ({larger:.2f} of the network's body)"]
        if self.skeleton is not None:
            motion, about = brought_onto(motion, rig)
            said += about
        said += self.write(motion, self.out, root_motion)
        record = enlarged(record, larger)
        error = record["error (cm)"]["rms"]
        about = f"{motion.seconds:.1f} s from {record['start']!r}, {error:.1f} cm from the path"
        print(f"{self.out}: {'; '.join([about, *said])}")
        for note in record["notes"]:
            print(f"note: {note}")


def _larger(body, rig: Motion | None) -> float:
    """How much farther a motion's way becomes on a rig."""
    import torch

    from ..motion import Motion

    step = Motion(body, torch.zeros(2, 3), torch.eye(3).expand(2, body.joints, 3, 3), 30)
    places = torch.zeros(2, 3)
    places[:, 1] = -step.positions()[..., 1].min()  # it stands on the floor
    places[1, 2] = 1.0
    found, _ = brought_onto(Motion(body, places, step.rotations, 30), rig)
    hips = found.positions()[:, found.skeleton.roles.get("hips", 0)]
    return float((hips[1] - hips[0])[[0, 2]].norm())


def read_path(file: Path) -> tuple[list[list[float]], list[float] | None]:
    """Places [[x, z], ...] in metres of a table, and times in seconds if it has them.

    Raises
    ------
    WayError : no such file, no such header, or what is no number, with its line.
    """
    try:
        with open(file, newline="", encoding="utf-8-sig") as stream:
            rows = [
                (i, row) for i, row in enumerate(csv.reader(stream), 1) if any(map(str.strip, row))
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no text in UTF-8"
        raise WayError(f"{file}: can't be read ({reason}).") from error
    header = [cell.strip().lower() for cell in rows[0][1]] if rows else []
    if header not in COLUMNS:
        raise WayError(
            f"{file}, line 1: {','.join(header) or 'nothing'!r}; the header must be x,z or t,x,z, with "
            "metres on the ground (y is up) and seconds below it, separated by commas."
        )
    found = []
    for line, row in rows[1:]:
        try:
            found.append([float(cell) for cell in row])
        except ValueError:
            found.append([])
        if len(found[-1]) != len(header):
            raise WayError(
                f"{file}, line {line}: {','.join(row)!r}; {len(header)} numbers are needed."
            )
    timed = header[0] == "t"
    return [row[-2:] for row in found], [row[0] for row in found] if timed else None
