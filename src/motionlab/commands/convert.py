"""`motionlab convert` and `motionlab retarget`: from file to file, and from rig to rig."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from ..errors import MotionLabError
from ..io import acclaim
from ..io.bvh_reading import Reading
from ..io.bvh_units import is_positive
from ..io.readings import Readings
from ..io.root_motion import KINDS
from ..motion import Motion
from ..retargeting.flat_feet import Stance
from ..retargeting.stance import stances
from ..skeleton import Skeleton
from .clips import Clips, files_of, write
from .options import as_options
from .programs import ANY, PROGRAMS, Program
from .rig import CANONICAL, Rig, brought_onto

MOST_FPS = 1000  # no one plays more; a slip of the finger would fill the memory


@dataclass(kw_only=True)
class Written(Clips):
    """What is written, and how."""

    to: Literal["bvh", "glb", "usda", "xml"] | None = None
    """What the files of a folder become; bvh if left out. An xml file is a model of MuJoCo."""
    fps: float | None = None
    """Frames per second of what is written, if others than of what is read."""
    root_motion: Literal[KINDS] | None = None
    """ground: a root joint on the floor carries way and heading, as game engines want; in-place:
    these are left out. (--root is another thing: which body of a file is read.)"""

    def run(self) -> None:
        if self.fps is not None and not (is_positive(self.fps) and self.fps <= MOST_FPS):
            raise MotionLabError(
                f"--fps {self.fps:g}: must be a number above 0, {MOST_FPS} at most."
            )
        program = self.program
        ending = f".{self.to}" if self.to else program.endings[0]
        if ending not in program.endings:
            raise MotionLabError(
                f"--to {self.to}: this program opens {', '.join(program.endings)}."
            )
        self.work(ending, self._write_one, program.endings)
        if program.note:
            print(f"note: {program.note}.")

    @property
    def program(self) -> Program:
        """What the files are for."""
        return ANY

    @property
    def _way(self) -> str | None:
        """What becomes of way and heading."""
        return self.root_motion or self.program.root_motion

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        """The motion of a file as it is to be written, and what was done to it."""
        return motion, []

    def _write_one(self, motion: Motion, file: Path, target: Path) -> str:
        before = motion
        motion, said = self.change(motion, file)
        if self.fps is not None:
            motion = motion.resample(self.fps)
        said += self._put(motion, target)
        return "; ".join([_sizes(before, motion), *said, *_about_root(self._way)])

    def _put(self, motion: Motion, target: Path) -> list[str]:
        """Write it, and what to say of how."""
        write(motion, target, self._way, self.program)
        return []


@dataclass(kw_only=True)
class Brought(Written, Rig):
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
        return self.write(motion, target, self._way, self.program)

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        if self.onto_name() is None:
            return motion, []
        return brought_onto(motion, self._rig, self._stances[file])


@dataclass(kw_only=True)
class Convert(Brought):
    """Motion files into others: BVH for most programs, GLB for Blender, engines and browsers."""

    for_: Annotated[Literal[tuple(PROGRAMS)] | None, arg(name="for")] = None
    """The program that is to open what is written: sets format, unit, axes, names and root as it
    needs them. What else is said goes first."""
    skeleton: Annotated[str | None, arg(metavar="RIG|canonical")] = None
    """Bring the motion to this rig, as `retarget` does; the files' own if left out. Where .amc files
    are read, an .asf file is what they are read by; if left out, it is looked for beside them."""
    rig_axes: bool = False
    """Write BVH as the rig's own BVH file is, as `retarget` does: its unit, axis up, joints, offsets
    and channels; without, y up and in centimetres, as all that `convert` writes."""

    def run(self) -> None:
        if self.for_ and self.rig_axes:
            raise MotionLabError(
                f"--for {self.for_} and --rig-axes: files are written as a program needs them, or as "
                "the rig's file is; leave one of them out."
            )
        super().run()

    @property
    def program(self) -> Program:
        return PROGRAMS[self.for_] if self.for_ else ANY

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


def _about_root(root_motion: str | None) -> list[str]:
    if root_motion is None:
        return []
    if root_motion == "in-place":
        return ["in place"]
    # whether the file had one or not: it is none of the joints, as reading folds it into the body
    return ["below a root joint on the floor, for way and heading"]
