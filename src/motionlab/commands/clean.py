"""`motionlab clean`: noise taken away, and feet that stand still where they rest."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import torch
from tyro.conf import arg

from ..errors import MotionLabError
from ..io.readings import Readings
from ..motion import Motion
from ..skeleton import Skeleton
from .choices import shown_first
from .clips import files_of
from .convert import Written

AUTO = "auto"
# Metres that a body may come down for feet to be held. Legs of people are nearly straight when they walk:
# of validation walks as they were captured the hips stay within 6 mm, and knees bend 1.4 degrees more.
DEEPEST = 0.005
# cm/s at which toes slide that no captured walk has, 3 to 9: such feet are all held. Not after noise was taken
# away, whose walks still slide at 21: with all feet held joints came from 2.0 to 2.3 cm off, by this to 2.0.
SLIDES = 10.0


@shown_first("path", "out", "denoise", "feet", "report", "reference", "to", "fps", "root_motion")
@dataclass(kw_only=True)
class Clean(Written):
    """Take noise away, or hold feet still on the floor while they are down, or both."""

    denoise: Annotated[str | None, arg(metavar="auto|CM,DEGREES")] = None
    """Take away what cameras got wrong: auto finds out how much that is; or say it, as 2,5: the root's
    place is off by 2 cm and angles by 5 degrees."""
    feet: bool = False
    """Hold feet still where they rest; that is also what is done without --denoise."""
    report: Path | None = None
    """A page that plays before and after and shows what was changed where; of one file."""

    reference: Path | None = None
    """For --denoise: a file of the clips' own rig in which a person stands, arms hanging or spread; tells how
    joint axes lie where the rest pose does not stand. If left out, each clip's own frames tell."""

    def run(self) -> None:
        if self.reference is not None and self.denoise is None:
            raise MotionLabError(
                f"--reference {self.reference}: goes with --denoise; feet are held without it."
            )
        self._levels = None if self.denoise in (None, AUTO) else _levels(self.denoise)
        if self.report is not None:
            if self.path.is_dir() and len(files_of(self.path)) > 1:
                raise MotionLabError(
                    f"--report {self.report}: {self.path} is a folder; a report is of one file."
                )
            if self.report.suffix.lower() != ".html":
                raise MotionLabError(f"--report {self.report}: the name must end in .html.")
            if self.report.exists() and not self.force:
                raise MotionLabError(
                    f"--report {self.report}: is there already; --force overwrites it."
                )
        super().run()

    def meet(self, files: list[Path], how: Readings) -> None:
        self._stands = None
        if self.reference is not None:
            its = replace(how.of(self.reference), tpose_first=False)
            self._stands, _ = self.read(self.reference, its)

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        before, said, wild = motion, [], []
        if self.denoise is not None:
            motion, said, wild = self._denoised(motion)
        if self.feet or self.denoise is None:
            motion, more = _held(motion, SLIDES if self.denoise is None else math.inf)
            said += more
        if self.report is not None:
            from .clean_report import write_report

            write_report(before, motion, said, self.report, wild)
            said.append(f"before and after in {self.report}")
        return motion, said

    def _denoised(self, motion: Motion) -> tuple[Motion, list[str], list[int]]:
        """The clean motion, what is said of it, and frames that were not believed."""
        from ..retargeting.stance import stances
        from ..solvers import clean_recording

        stands = None
        if self._stands is not None:
            (stands,) = stances([motion], Skeleton.canonical(), self._stands).references
        found, record = clean_recording(motion, noise=self._levels, reference=stands, progress=True)
        noise = record["noise"]
        told = "estimated" if noise["estimated"] else "as said"
        said = [
            f"noise {100 * noise['root_m']:.1f} cm of the root and "
            f"{math.degrees(noise['angle_rad']):.1f}° of angles ({told})"
        ]
        if record["way"] == "unchanged":
            return motion, [*said, "so little that nothing was changed"], []
        frames, held = record["outliers"], record["held"]
        if frames:
            said.append(f"{_counted(frames)} not believed ({_some(frames)})")
        if held:
            why = "not believed, as all is held there and trembles elsewhere"
            said.append(f"{_counted(held)} {why} ({_some(held)})")
        frames = sorted({*frames, *held})
        if record["way"] == "filter":
            said.append("the network does not know such motion, so it was only smoothed")
        elif record["way"] == "map":
            said.append("cleaned by the network, which knows such motion")
        if record["elsewhere as it was"]:
            said.append("the rest is calm: only these frames were changed")
        said.append(_moved(motion, found, frames))
        return found, said, frames


def _counted(frames: list[int]) -> str:
    return f"{len(frames)} frame{'s' if len(frames) > 1 else ''}"


def _some(frames: list[int]) -> str:
    """The first five of some frames."""
    return ", ".join(map(str, frames[:5])) + (", ..." if len(frames) > 5 else "")


def _moved(before: Motion, after: Motion, wild: list[int]) -> str:
    """How far joints were moved, in words; apart in frames that were not believed."""
    far = 100 * (after.positions() - before.positions()).norm(dim=-1).amax(1)
    others = torch.ones(len(far), dtype=torch.bool)
    others[wild] = False
    most = f"joints moved by up to {far[others].max():.1f} cm" if others.any() else ""
    there = f"those of frames not believed by {far[wild].max():.1f} cm" if wild else ""
    return ", ".join(filter(None, (most, there)))


def _levels(text: str) -> tuple[float, float]:
    """Metres and radians of --denoise CM,DEGREES; raises MotionLabError for what is none."""
    try:
        root, angle = map(float, text.split(","))
    except ValueError:
        root = angle = math.nan
    if not (0 < root < math.inf and 0 < angle < math.inf):
        raise MotionLabError(
            f"--denoise {text}: must be auto, or two numbers above 0 as 2,5: centimetres of the root "
            "and degrees of angles."
        )
    return root / 100, math.radians(angle)


def _held(motion: Motion, most: float = SLIDES) -> tuple[Motion, list[str]]:
    """Feet held still where they rest. most : cm/s; if toes slide faster the body comes down as it must."""
    from ..contacts import foot_points, label
    from ..feet.lock import lock_feet
    from ..metrics import foot_skate

    motion = replace(motion, contacts=label(motion, "speed-height"))
    toes = motion.contacts[:, [1, 3]]
    if not toes.any():
        return motion, ["no toe rests, so that nothing was changed"]
    slide = lambda its: foot_skate(its.positions(), toes, its.skeleton, its.fps)
    was = slide(motion)
    cleaned = lock_feet(
        motion, floor=None, deepest=math.inf if was > most else DEEPEST, level=False
    )
    is_ = slide(cleaned)
    moved = 100 * (cleaned.positions() - motion.positions()).norm(dim=-1).amax(0)
    slid = "" if was.isnan() else f", sliding {was:.1f} cm/s and now {is_:.1f}"
    return cleaned, [
        f"toes down {toes.float().mean():.0%} of the time{slid}; feet moved by up to "
        f"{moved[foot_points(motion.skeleton)].max():.1f} cm, any joint by {moved.max():.1f}"
    ]
