"""The data set "locomotion": one body that walks, runs, turns, starts and stops.

Clips of six sources, listed in ``locomotion.tsv``, are resampled to 30 frames per second and
retargeted to `Skeleton.canonical`. They keep their names, splits and licences. Listed are

* of ``bandai-locomotion`` everything: walks (also backwards and sideways), runs, dashes, turns;
* of ``accad`` walks, runs, their turns, starts and stops, walks and runs backwards, side steps; no
  boxes, crouches, hops, jumps, skips, nor standing about;
* of ``cmu`` the three walks;
* of ``cmu-amc`` all but two crouches and two leaps, and but ``02_01``, as a clip of ``cmu`` is
  called so;
* of ``o3de-motionmatching`` walks, runs, turns, also on the spot, in all directions; no takes of
  crouching, jumping and pushing;
* of ``virvig-jl`` all but its T-pose.

The data set "everything" is brought to the same body in the same way: these clips and all others, with
dances, martial arts, basketball, gestures, crouches and jumps.
"""

from __future__ import annotations

from ..motion import Motion
from ..retargeting import retarget
from ..retargeting.flat_feet import Stance
from .registry import ONE_BODY_FPS

# Raise this when retargeting changes, so that cached results are made anew.
FORMAT = 9
# Where a source's rest pose is no standing body: a clip that begins with standing upright, and how
# many frames of it.
STANCES = {"accad": ("Male1_B1_StandToWalk", 30), "virvig-jl": ("JL_mm_tpose", 1)}
# Sources whose rig is that of another one, which tells how it stands.
SAME_RIG = {"bandai-actions": "bandai-locomotion"}
# Where nobody stands still either: clips that tell together how the source's rig stands.
LEARNED = {
    "bandai-locomotion": (
        "dataset-1_dash_musical_001", "dataset-2_run_active_024", "dataset-2_run_normal_013",
        "dataset-2_walk-turn-left_normal_025", "dataset-2_walk-turn-right_normal_020",
        "dataset-2_walk_active_022", "dataset-2_walk_feminine_016", "dataset-2_walk_youthful_010",
    ),
}  # fmt: skip


def bring(motion: Motion, stance: Motion | Stance | None = None) -> Motion:
    """One clip of a source to the canonical skeleton, by the stance of its source if it needs one."""
    return retarget(motion.resample(ONE_BODY_FPS), reference=stance)
