"""The rig that a command brings motion to, and what is said of that."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch

from ..errors import MotionLabError, RetargetError
from ..io.bvh_units import foot_to_head
from ..io.motion_file import read_motion
from ..motion import Motion
from ..retargeting.onto_rig import onto_rig
from ..skeleton import Skeleton
from .clips import as_options
from .folder import Files

CANONICAL = "canonical"


@dataclass(kw_only=True)
class Rig:
    """How the file of a rig is read, that motion is brought to."""

    rig_units: float | str | None = None
    """The rig's unit, as --units."""
    rig_up: str | None = None
    """The rig's axis up, as --up."""
    rig_roles: Path | None = None
    """The rig's table of joints, as --roles."""

    def find_rig(self, name: str) -> Motion | None:
        """The rig in a file; None for the canonical body. Prints what is doubtful about it."""
        if name == CANONICAL:
            return None
        how = Files(units=self.rig_units, up=self.rig_up, roles=self.rig_roles).how()
        rig, doubts = read_motion(Path(name), how)
        doubts.pop("rate", None)  # how fast it moves is not asked
        for said in doubts.values():
            print(f"note: {name}: {_of_the_rig(said)}", flush=True)
        body = Skeleton.canonical()
        try:  # before any clip is tried
            onto_rig(Motion(body, torch.zeros(1, 3), torch.eye(3).repeat(1, 21, 1, 1), 30), rig)
        except MotionLabError as error:
            raise RetargetError(f"{name}: {_of_the_rig(str(error))}") from error
        return rig


def _of_the_rig(text: str) -> str:
    """What is said of arguments, as options of the rig."""
    return as_options(text).replace("--", "--rig-")


def brought_onto(
    motion: Motion, rig: Motion | None, reference: Motion | None = None
) -> tuple[Motion, list[str]]:
    """The motion on a rig, or on the canonical body, and what to say of it."""
    if rig is None:
        found = motion.retarget(reference=reference)
    else:
        found = onto_rig(motion, rig, reference=reference)
    if found is motion:
        return motion, ["is on that rig already"]
    name = "the canonical body" if rig is None else rig.name
    return found, [f"onto {name}{_lengths(motion.skeleton, found.skeleton)}"]


def _lengths(before: Skeleton, after: Skeleton) -> str:
    heights = foot_to_head(before), foot_to_head(after)
    if None in heights:
        return ""
    return ", from foot to head {:.2f} m and now {:.2f} m".format(*heights)
