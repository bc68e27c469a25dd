"""`motionlab convert` and `motionlab retarget`: from file to file, and from rig to rig."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from ..errors import MotionLabError
from ..io import acclaim
from ..io.bvh_reading import Reading
from ..io.bvh_units import is_positive
from ..io.readings import Readings
from ..motion import Motion
from ..retargeting.flat_feet import Stance
from ..retargeting.stance import stances
from ..skeleton import Skeleton
from .choices import RootMotion, chosen, shown_first, way_of
from .clips import Clips, files_of, write
from .options import as_options
from .programs import ANY, PROGRAMS, Program, program_for
from .rig import CANONICAL, Rig, brought_onto

_TO = tuple(ending[1:] for ending in ANY.endings)
MOST_FPS = 1000  # no one plays more; a slip of the finger would fill the memory


@dataclass(kw_only=True)
class Written(Clips):
    """What is written, and how."""

    to: Annotated[str | None, arg(metavar="|".join(_TO))] = None
    """What the files of a folder become; bvh if left out. An xml file is a model of MuJoCo."""
    fps: float | None = None
    """Frames per second of what is written, if others than of what is read."""
    root_motion: RootMotion = None
    """ground: a root joint on the floor carries way and heading, as game engines want; in-place:
    these are left out; none: they stay with the body, as in all that is not --for an engine.
    (--root is another thing: which body of a file is read.)"""

    def run(self) -> None:
        if self.fps is not None and not (is_positive(self.fps) and self.fps <= MOST_FPS):
            raise MotionLabError(
                f"--fps {self.fps:g}: must be a number above 0, {MOST_FPS} at most."
            )
        self.program = self.find_program()
        self.way = way_of(self.root_motion, self.program.root_motion)
        self.work(self.ending(), self._write_one, self.program.endings)

    def find_program(self) -> Program:
        """What the files are for."""
        return ANY

    def ending(self) -> str:
        """What the files end in unless --out says so; raises MotionLabError for what does not fit."""
        if self.to is None:
            return self.program.endings[0]
        ending = f".{chosen('--to', self.to, _TO)}"
        if ending not in self.program.endings:
            opened = ", ".join(self.program.endings)
            raise MotionLabError(f"--to {self.to}: {self.program.title} opens {opened} alone.")
        return ending

    def notes(self, ending: str) -> list[str]:
        note = self.program.note(ending, self.way)
        return [f"{note}."] if note else []

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        """The motion of a file as it is to be written, and what was done to it."""
        return motion, []

    def _write_one(self, motion: Motion, file: Path, target: Path) -> str:
        before = motion
        motion, said = self.change(motion, file)
        if self.fps is not None:
            motion = motion.resample(self.fps)
        said += self._put(motion, target)
        return "; ".join([_sizes(before, motion), *said])

    def _put(self, motion: Motion, target: Path) -> list[str]:
        """Write it, and what to say of how."""
        return write(motion, target, self.way, self.program)


@shown_first("path", "out", "to", "fps", "root_motion")
@dataclass(kw_only=True)
class Brought(Rig, Written):
    """Motion that may be brought to another rig."""

    reference: Path | None = None
    """A file of the clips' own rig in which a person stands, arms hanging or spread: tells how joint
    axes lie where the rest pose does not stand. If left out, it is looked for in the clips."""

    def onto_name(self) -> str | None:
        """The rig's file, "canonical", or None for the clips' own."""
        raise NotImplementedError

    def meet(self, files: list[Path], how: Readings) -> None:
        """Learn how the clips' rigs stand, once for all clips of one rig."""
        self._stances: dict[Path, Stance] = {}
        name = self.onto_name()
        if name is None:
            return
        self._rig = self.find_rig(name)
        reference = None
        if self.reference is not None:
            its = replace(how.of(self.reference), tpose_first=False)
            reference, _ = self.read(self.reference, its)
        seen = {}
        for file in files:
            with contextlib.suppress(MotionLabError):  # it is told when its turn comes
                seen[file] = self.read(file, how.of(file))[0]
        stood = stances(list(seen.values()), Skeleton.canonical(), reference)
        self._stances = dict(zip(seen, stood.references, strict=True))
        for said in stood.said:
            print(f"note: {self.path}: {as_options(said)}")

    def _put(self, motion: Motion, target: Path) -> list[str]:
        return self.write(motion, target, self.way, self.program)

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        if self.onto_name() is None:
            return motion, []
        return brought_onto(motion, self._rig, self._stances[file])


@shown_first("path", "out", "for_", "to", "fps", "root_motion", "skeleton")
@dataclass(kw_only=True)
class Convert(Brought):
    """Motion files into others: BVH for most programs, GLB for Blender, engines and browsers, USD, and
    models of MuJoCo."""

    out: Path | None = None
    """File to write, or a folder for many; a file's end says what is written. With --for or --to it
    may be left out: then NAME.glb or the like, or NAME_PROGRAM, in the current folder."""
    for_: Annotated[str | None, arg(name="for", metavar="|".join(PROGRAMS))] = None
    """The program that is to open what is written: sets format, unit, axes, names and root as it
    needs them. What else is said goes first."""
    skeleton: Annotated[str | None, arg(metavar="RIG|canonical")] = None
    """Bring the motion to this rig, as `retarget` does; the files' own if left out. Where .amc files
    are read, an .asf file is what they are read by; if left out, it is looked for beside them."""
    rig_axes: bool = False
    """Write BVH as the rig's own BVH file is, as `retarget` does: its unit, axis up, joints, offsets
    and channels; without, y up and in centimetres."""

    def run(self) -> None:
        if self.for_ and self.rig_axes:
            raise MotionLabError(
                f"--for {self.for_} and --rig-axes: files are written as a program needs them, or as "
                "the rig's file is; leave one of them out."
            )
        super().run()

    def find_program(self) -> Program:
        return program_for(self.for_)

    def ending(self) -> str:
        ending = super().ending()
        if self.out is None:
            self.out = self._usual_out(ending)
        return ending

    def _usual_out(self, ending: str) -> Path:
        """Where what is for a program, or of a format, goes; raises MotionLabError if neither is said."""
        kind = self.for_ or self.to
        if kind is None:
            raise MotionLabError(
                f"convert {self.path}: into what? Name a file, as --out walk.glb, or a program, as "
                "--for blender."
            )
        name = self.path.resolve()
        if self.path.is_dir():
            return Path(f"{name.name}_{kind.lower()}")
        out = Path(f"{name.stem}{ending}")
        if out.resolve() == name:
            raise MotionLabError(
                f"convert {self.path}: would replace what it reads; name an --out."
            )
        return out

    def onto_name(self) -> str | None:
        return None if self._moves_amc else self.skeleton

    def read(self, file: Path, how: Reading) -> tuple[Motion, dict[str, str]]:
        if self._moves_amc and file.suffix.lower() == ".amc":
            return acclaim.read(file, how, skeleton=self.skeleton)
        return super().read(file, how)

    @property
    def _moves_amc(self) -> bool:
        """Whether the skeleton is one by which files are read, and no rig to bring them to."""
        if self.skeleton is None or Path(self.skeleton).suffix.lower() != ".asf":
            return False
        files = files_of(self.path) if self.path.is_dir() else [self.path]
        return any(file.suffix.lower() == ".amc" for file in files)


@shown_first("path", "out", "onto", "to", "fps", "root_motion")
@dataclass(kw_only=True)
class Retarget(Brought):
    """Motion brought to another rig, any that can be read; feet stay on the floor, and still."""

    onto: Annotated[str, arg(metavar="RIG|canonical")] = CANONICAL
    """A file of the rig, in which a person stands, at rest or in a frame; or canonical."""

    def onto_name(self) -> str:
        return self.onto


def _sizes(before: Motion, after: Motion) -> str:
    said = f"{len(after)} frames at {after.fps:g} fps, {after.skeleton.joints} joints"
    if (len(before), before.fps) != (len(after), after.fps):
        said += f" (read: {len(before)} at {before.fps:g})"
    return said
