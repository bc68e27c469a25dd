"""How files are read: what the commands on files and on folders of them ask."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .. import roles
from ..errors import MotionFileError, MotionLabError
from ..io.bvh_reading import Reading
from ..io.readings import read_by_file
from ..io.root_motion import KINDS


def check_there(path: Path) -> None:
    """Raise MotionFileError if there is neither a file nor a folder of this name."""
    if not path.exists():
        raise MotionFileError(f"{path}: there is no such file or folder.")


@dataclass
class Files:
    """How files are read; all of a folder alike, but for --by-file."""

    units: float | str | None = None
    """Their unit: m, dm, cm, mm, in, ft, or metres per unit; cm for BVH if left out, m for glTF."""
    up: str | None = None
    """Their axis that points up: y, z, x, or with a minus, as --up=-z; y if left out, with a warning
    of bodies that are never upright."""
    root: str | None = None
    """Name of the ROOT, or node, to begin with, of files that hold several bodies."""
    animation: str | None = None
    """Name or number of the animation to read, of glTF files that hold several."""
    rigid: str | None = None
    """mean: put joints that slide against their parents at their mean offset; refused if left out."""
    roles: Path | None = None
    """TOML or JSON file that says which joint is which, as `info` prints it."""
    by_file: Path | None = None
    """TOML or JSON file of what is said of some files only: tables by pattern, as ["lab/*"], with
    units, up, fps, root, rigid, animation, roles, tpose_first, drop_zeros."""

    def how(self, **more) -> Reading:
        """What was chosen, checked; raises MotionLabError."""
        if self.root in KINDS:
            raise MotionLabError(
                f"--root {self.root}: names the ROOT of a file to read; --root-motion {self.root} "
                "says what becomes of way and heading."
            )
        known = None if self.roles is None else roles.read(self.roles)
        return Reading(
            units=self.units, up=self.up, roles=known, root=self.root, rigid=self.rigid,
            animation=self.animation, **more,
        )  # fmt: skip

    def answers(self) -> dict[str, dict] | None:
        """What is said of some files only."""
        return None if self.by_file is None else read_by_file(self.by_file)


@dataclass
class Taken(Files):
    """And what of each file is taken; of commands whose own --fps is that of what they write."""

    file_fps: float | None = None
    """Frames per second of the files, where their own frame time is wrong."""
    tpose_first: bool = False
    """Leave out frame 0, a T-pose."""
    drop_zeros: bool = False
    """Leave out leading frames in which every rotation is zero."""

    def how(self) -> Reading:
        return super().how(
            fps=self.file_fps, tpose_first=self.tpose_first, drop_zeros=self.drop_zeros
        )


@dataclass
class Folder(Files):
    """Of a folder's files, as `motionlab prepare`, `train` and `evaluate` ask."""

    fps: float | None = None
    """Frames per second, if their own frame time is wrong."""
    tpose_first: bool = False
    """Leave out frame 0, a T-pose for calibration."""
    drop_zeros: bool = False
    """Leave out leading frames in which every rotation is zero."""
    reference: Path | None = None
    """A file of their rig in which a person stands, arms hanging or spread: tells how joint axes
    lie where the rest pose does not stand. If left out, it is looked for in the clips."""
    skip_bad: bool = False
    """Leave out files that can't be read or brought to the canonical skeleton."""

    def reading(self) -> dict:
        """What was chosen, as `datasets.from_folder` takes it."""
        left_out = lambda value: value is None or value is False
        chosen = {name: value for name, value in vars(self).items() if not left_out(value)}
        if self.roles is not None:
            chosen["roles"] = roles.read(self.roles)
        if self.by_file is not None:
            chosen["by_file"] = self.answers()
        return chosen
