"""How a rig stands: its joints' axes, by a reference, and its flat feet, by all clips of a body.

The toes of one rig are drawn above the balls of the feet, those of another at their tips, so flat
feet of different bodies point differently far down. Clip by clip that is told badly: dancers stand
on their toes for minutes. Here all clips are asked together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from ..feet.flat import flat_pitch, pitch_of, resting
from ..ik.turns import place
from ..roles import SIDES
from ..skeleton import Skeleton
from .joints_between import settled
from .rest_alignment import alignment, bone, limb_length, stance_of

if TYPE_CHECKING:
    from ..motion import Motion

HANGING = 0.7  # radians by which feet are pitched that hang in the air, or point at the viewer
_RATE = 30.0  # frames looked at in a second


@dataclass(frozen=True)
class Stance:
    """How a rig stands, for `retarget`.

    Attributes
    ----------
    motion : one in which a person stands; None if the rest pose does, or nothing is known.
    flat : radians by which the toes of the left and right foot, when flat on the floor, point up from
        where they do in `motion`, or at rest; None if each clip is to tell for itself.
    """

    motion: Motion | None = None
    flat: tuple[float, float] | None = None

    def settled(self) -> Stance:
        """The same, with a `motion` as `joints_between.settled` gives it."""
        return self if self.motion is None else replace(self, motion=settled(self.motion))


@torch.no_grad()
def with_flat_feet(stance: Motion | None, motions: Sequence[Motion]) -> Stance:
    """A stance that knows how flat feet look, as far as clips of one body tell it.

    stance : a motion of their rig in which a person stands, None if its rest pose does.
    """
    skeleton, known, clips = Skeleton.canonical(), Stance(stance).settled(), []
    for motion in motions:
        if not len(motion):
            continue
        stride = max(1, round(motion.fps / _RATE))
        motion = settled(replace(motion[::stride], fps=motion.fps / stride))
        stands = stance_of(motion, known.motion)
        if stands is None:
            continue
        axes = alignment(motion, skeleton, known.motion)
        at, world, _ = scaled(motion, skeleton, axes)
        pitches = toes_up(stands, axes)
        usual = pitches if pitches.abs().max() < HANGING else None
        off = resting(*ends_of(at, world, skeleton), motion.fps, usual)
        clips.append(
            off if usual is not None else [its - up for its, up in zip(off, pitches, strict=True)]
        )
    flat = flat_pitch(clips, _RATE)
    return Stance(stance, None if flat is None else tuple(flat.tolist()))


def scaled(
    motion: Motion, skeleton: Skeleton, axes: dict[str, Tensor]
) -> tuple[dict[str, Tensor], dict[str, Tensor], float]:
    """By role places (frames, 3) and orientations (frames, 3, 3) in the skeleton's axes; the scale.

    The scale is that of the legs.
    """
    points, orientations = place(motion.skeleton, motion.root_positions, motion.rotations)
    roles = motion.skeleton.roles
    scale = limb_length(skeleton, "leg") / limb_length(motion.skeleton, "leg")
    at = {role: points[:, joint] * scale for role, joint in roles.items()}
    return at, {role: orientations[:, roles[role]] @ turn for role, turn in axes.items()}, scale


def ends_of(
    at: dict[str, Tensor], world: dict[str, Tensor], skeleton: Skeleton
) -> tuple[Tensor, Tensor, Tensor]:
    """Orientations (2, frames, 3, 3) of both feet, ankles and toes (2, frames, 3)."""
    feet = [f"{side}_foot" for side in SIDES]
    toes = []
    for side, foot in zip(SIDES, feet, strict=True):
        own = world[foot] @ bone(skeleton, foot, f"{side}_toes")
        toes.append(at.get(f"{side}_toes", at[foot] + own))
    return tuple(
        torch.stack(each) for each in ([world[f] for f in feet], [at[f] for f in feet], toes)
    )


def toes_up(stance: Motion, axes: dict[str, Tensor]) -> Tensor:
    """Radians (2,) by which toes point up while the body stands."""
    world, roles = stance.orientations(), stance.skeleton.roles
    feet = [world[:, roles[f"{side}_foot"]] @ axes[f"{side}_foot"] for side in SIDES]
    return pitch_of(torch.stack(feet)).median(1).values
