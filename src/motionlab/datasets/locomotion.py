"""The data set "locomotion": one body that walks, runs, turns, starts and stops.

Clips of three sources, listed in ``locomotion.tsv``, are resampled to 30 frames per second and
retargeted to `Skeleton.canonical`. They keep their names, splits and licences. Listed are

* of ``bandai-locomotion`` everything: walks (also backwards and sideways), runs, dashes, turns;
* of ``accad`` walks, runs, their turns, starts and stops, walks and runs backwards, side steps; no
  boxes, crouches, hops, jumps, skips, nor standing about;
* of ``cmu`` the three walks.
"""

from __future__ import annotations

from functools import cache

from ..motion import Motion
from ..retarget import retarget
from .registry import LOCOMOTION_FPS

# Raise this when retargeting changes, so that cached results are made anew.
FORMAT = 4
# Where a source's rest pose is no standing body: a clip that begins with standing upright, and how
# many frames of it.
STANCES = {"accad": ("Male1_B1_StandToWalk", 30)}


def bring(motion: Motion, download: bool | None = None) -> Motion:
    """One clip of a source to the canonical skeleton."""
    reference = _stance(motion.source, download) if motion.source in STANCES else None
    return retarget(motion.resample(LOCOMOTION_FPS), reference=reference)


@cache
def _stance(source: str, download: bool | None) -> Motion:
    from .loader import load

    name, frames = STANCES[source]
    return load(source, clips=[name], download=download)[0][:frames]
