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
from .clips import WRITERS, Clips, files_of, write
from .options import as_options
from .rig import CANONICAL, Rig, brought_onto

MOST_FPS = 1000  # no one plays more; a slip of the finger would fill the memory


@dataclass(kw_only=True)
class Written(Clips):
    """What is written, and how."""

    to: Literal["bvh", "glb"] = "bvh"
    """What the files of a folder become."""
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
        self.work(f".{self.to}", self._write_one, tuple(WRITERS))

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        """The motion of a file as it is to be written, and what was done to it."""
        return motion, []

    def _write_one(self, motion: Motion, file: Path, target: Path) -> str:
        before = motion
        motion, said = self.change(motion, file)
        if self.fps is not None:
            motion = motion.resample(self.fps)
        said += self._put(motion, target)
        return "; ".join([_sizes(before, motion), *said, *_about_root(self.root_motion)])

    def _put(self, motion: Motion, target: Path) -> list[str]:
        """Write it, and what to say of how."""
        write(motion, target, self.root_motion)
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
        return self.write(motion, target, self.root_motion)

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        if self.onto_name() is None:
            return motion, []
        return brought_onto(motion, self._rig, self._stances[file])


@dataclass(kw_only=True)
class Convert(Brought):
    """Motion files into others: BVH for most programs, GLB for Blender, engines and browsers."""

    skeleton: Annotated[str | None, arg(metavar="RIG|canonical")] = None
    """Bring the motion to this rig, as `retarget` does; the files' own if left out. Where .amc files
    are read, an .asf file is what they are read by; if left out, it is looked for beside them."""
    rig_axes: bool = False
    """Write BVH as the rig's own BVH file is, as `retarget` does: its unit, axis up, joints, offsets
    and channels; without, y up and in centimetres, as all that `convert` writes."""

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
