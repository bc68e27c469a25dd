"""The rig that a command brings motion to, how that is written, and what is said of it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import torch

from ..errors import MotionFileError, MotionLabError, RetargetError
from ..io import write_bvh
from ..io.bvh_units import foot_to_head
from ..io.motion_file import is_bvh, read_rig
from ..motion import Motion
from ..retargeting.flat_feet import Stance
from ..retargeting.onto_rig import onto_rig
from ..skeleton import Skeleton
from .clips import about_root, write
from .folder import Files
from .options import as_options
from .programs import ANY, Program

CANONICAL = "canonical"
_DEEP = 0.05  # metres below the floor that are told


@dataclass(kw_only=True)
class Rig:
    """How the file of a rig is read, that motion is brought to, and whether it is written so, too."""

    rig_units: float | str | None = None
    """The rig's unit, as --units."""
    rig_up: str | None = None
    """The rig's axis up, as --up."""
    rig_root: str | None = None
    """The rig's ROOT or node to begin with, as --root."""
    rig_animation: str | None = None
    """The rig's animation, as --animation."""
    rig_rigid: str | None = None
    """What becomes of the rig's joints that slide, as --rigid."""
    rig_roles: Path | None = None
    """The rig's table of joints, as --roles."""
    rig_axes: bool = True
    """Write BVH as the rig's own BVH file is: its unit, axis up, joints, offsets and channels;
    --no-rig-axes: y up and in centimetres."""

    _like: ClassVar[Path | None] = None  # the rig's file, if it is one of BVH

    def find_rig(self, name: str) -> Motion | None:
        """The rig in a file; None for the canonical body. Prints what is doubtful about it."""
        if name == CANONICAL:
            return None
        how = Files(
            units=self.rig_units, up=self.rig_up, roles=self.rig_roles, root=self.rig_root,
            animation=self.rig_animation, rigid=self.rig_rigid,
        ).how()  # fmt: skip
        try:
            rig, doubts = read_rig(Path(name), how)
        except MotionFileError as error:
            raise MotionFileError(_of_the_rig(str(error))) from error
        if is_bvh(name):
            self._like = Path(name)
        body = Skeleton.canonical()
        try:  # before any clip is tried
            onto_rig(Motion(body, torch.zeros(1, 3), torch.eye(3).repeat(1, 21, 1, 1), 30), rig)
        except MotionLabError as error:
            first = [doubts[about] for about in ("units", "up") if about in doubts]
            said = " As it is now: ".join([*first, str(error)])  # it may be no more than that
            raise RetargetError(f"{name}: {_of_the_rig(said)}") from error
        doubts.pop("rate", None)  # how fast it moves is not asked
        for said in doubts.values():
            print(f"note: {name}: {_of_the_rig(said)}", flush=True)
        return rig

    def write(
        self,
        motion: Motion,
        path: Path,
        root_motion: str | None = None,
        program: Program = ANY,
    ) -> list[str]:
        """Write a motion that was brought to the rig, and what to say of its axes and unit."""
        units, up = self.rig_units or "cm", self.rig_up or "y"
        if self._like is None or path.suffix.lower() != ".bvh":
            return write(motion, path, root_motion, program)
        if self.rig_axes:
            write_bvh(motion, path, units=units, up=up, like=self._like, root_motion=root_motion)
            said = f"as the rig's file is: {up} up, units {units}"
            return [said, *about_root(root_motion, motion.skeleton.names)]
        said = write(motion, path, root_motion, program)
        if (units, up) == (program.units, program.up):
            return said
        unit = {"cm": "centimetres", "m": "metres"}[program.units]
        return [f"unlike the rig's file, {program.up} up and in {unit}", *said]


def _of_the_rig(text: str) -> str:
    """What is said of arguments, as options of the rig."""
    return re.sub(r"--(units|up|root|animation|rigid|roles)\b(?!-)", r"--rig-\1", as_options(text))


def brought_onto(
    motion: Motion, rig: Motion | None, reference: Stance | None = None
) -> tuple[Motion, list[str]]:
    """The motion on a rig, or on the canonical body, and what to say of it."""
    if rig is None:
        found = motion.retarget(reference=reference)
    else:
        found = onto_rig(motion, rig, reference=reference)
    if found is motion:
        return motion, ["is on that rig already"]
    name = "the canonical body" if rig is None else rig.name
    said = f"onto {name}{_lengths(motion.skeleton, found.skeleton)}"
    return found, [said, *_dips(found)]


def _lengths(before: Skeleton, after: Skeleton) -> str:
    heights = foot_to_head(before), foot_to_head(after)
    if None in heights:
        return ""
    return ", from foot to head {:.2f} m and now {:.2f} m".format(*heights)


def _dips(motion: Motion) -> list[str]:
    """What comes to lie below the floor on another body: feet alone are kept above it."""
    roles = motion.skeleton.roles
    feet = {joint for role, joint in roles.items() if role.endswith(("_foot", "_toes"))}
    others = [joint for joint in roles.values() if joint not in feet]
    low, frames = motion.positions()[:, others, 1].min(0)
    depth, which = (-low).max(0)
    if depth < _DEEP:
        return []
    joint, second = motion.skeleton.names[others[which]], float(frames[which]) / motion.fps
    return [f"{joint} up to {100 * depth:.0f} cm below the floor (at {second:.1f} s)"]
