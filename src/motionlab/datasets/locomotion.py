"""The data set "locomotion": one body that walks, runs, turns, starts and stops.

Clips of three sources, listed in ``locomotion.tsv``, are resampled to 30 frames per second and
retargeted to `Skeleton.canonical`. They keep their names, splits and licences. Listed are

* of ``bandai-locomotion`` everything: walks (also backwards and sideways), runs, dashes, turns;
* of ``accad`` walks, runs, their turns, starts and stops, walks and runs backwards, side steps; no
  boxes, crouches, hops, jumps, skips, nor standing about;
* of ``cmu`` the three walks.
"""

from __future__ import annotations

from ..motion import Motion
from ..retargeting import retarget
from .registry import LOCOMOTION_FPS

# Raise this when retargeting changes, so that cached results are made anew.
FORMAT = 5
# Where a source's rest pose is no standing body: a clip that begins with standing upright, and how
# many frames of it.
STANCES = {"accad": ("Male1_B1_StandToWalk", 30)}


def bring(motion: Motion, stance: Motion | None = None) -> Motion:
    """One clip of a source to the canonical skeleton, by the stance of its source if it needs one."""
    return retarget(motion.resample(LOCOMOTION_FPS), reference=stance)
