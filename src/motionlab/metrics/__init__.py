"""How good is a motion: measures with units, sources and known answers.

Most are pure functions of positions (..., frames, points, 3) in metres; frame rates are arguments.
These come in one order, by position or by name: motion, contacts, skeleton or limits, fps.
Lower is better unless real motion says otherwise: put real against real motion beside every number
(`table`) and an interval over clips around it (`bootstrap`; `jackknife` for distances of sets).

================================  ================  =============================================
metric                            unit              what it asks
================================  ================  =============================================
`position_error`                  m                 error of predicted frames, norm over all points
`mean_joint_error`                cm                the same, mean over points
`at_milliseconds`                 as its input      errors at given times, interpolated
`npss`                            none              do the spectra agree over a long prediction?
`motion_change`                   m/s               does the body move? over all points
`feature_change`                  features/s        the same of features
`foot_skate`                      cm/s              how fast do feet slide while in contact?
`foot_skate_ratio`                share             in how many contact frames do they slide?
`foot_skate_weighted`             cm/s              the same without contacts, weighted by height
`penetration`, `floating`         cm                feet below, and above, the ground
`acceleration`, `jerk`            m/s², m/s³        does it tremble?
`bone_length_error`               cm                do bones keep their lengths?
`seam_jumps`                      ratio             does it jump where windows meet?
`root_path_error`                 cm, cm²           how far from the curve it was to follow?
`speed`, `turn_rate`              m/s, rad/s        gait
`cadence`, `step_length`          steps/min, m      gait
`time_to_freeze`, `stagnations`   s                 does it stop for good, or for a while?
`time_to_divergence`              s                 does it leave what bodies do?
`broken_frames`                   bool a frame      does it hold a pose that nobody in the data holds?
`survival`                        share over s      how many last how long?
`repetition`, `loop`              share, s          does it repeat itself?
`converged`                       groups            do rollouts end in the same motion?
`manifold_distance`               as features       mean distance of windows to the nearest real one
`nearest_window_distance`         as features       the same a window, and where it is: a replay?
`replay_share`                    share             how many windows are copies of the data?
`frechet_distance`                none              are end effectors where, and as varied as, real?
================================  ================  =============================================
"""

from .bones import BoneError, bone_length_error
from .bootstrap import Interval, bootstrap, jackknife
from .broken import broken_frames
from .change import feature_change, motion_change
from .failure import (
    Limits,
    Survival,
    pose_extent,
    stagnations,
    survival,
    time_to_divergence,
    time_to_freeze,
)
from .feet import floating, foot_skate, foot_skate_ratio, foot_skate_weighted, penetration
from .frechet import Frechet, effector_motion, frechet_distance
from .gait import cadence, facing, speed, step_length, turn_rate
from .heading_frame import heading_frame
from .loops import Loop, converged, loop, loop_tolerance, repetition
from .manifold import Nearest, manifold_distance, nearest_window_distance, replay_share
from .path import PathError, root_path_error
from .prediction import at_milliseconds, mean_joint_error, npss, position_error
from .seams import Seams, seam_jumps
from .smoothness import acceleration, jerk
from .table import table

__all__ = [
    "BoneError",
    "Frechet",
    "Interval",
    "Limits",
    "Loop",
    "Nearest",
    "PathError",
    "Seams",
    "Survival",
    "acceleration",
    "at_milliseconds",
    "bone_length_error",
    "bootstrap",
    "broken_frames",
    "cadence",
    "converged",
    "effector_motion",
    "facing",
    "feature_change",
    "floating",
    "foot_skate",
    "foot_skate_ratio",
    "foot_skate_weighted",
    "frechet_distance",
    "heading_frame",
    "jackknife",
    "jerk",
    "loop",
    "loop_tolerance",
    "manifold_distance",
    "mean_joint_error",
    "motion_change",
    "nearest_window_distance",
    "npss",
    "penetration",
    "pose_extent",
    "position_error",
    "repetition",
    "replay_share",
    "root_path_error",
    "seam_jumps",
    "speed",
    "stagnations",
    "step_length",
    "survival",
    "table",
    "time_to_divergence",
    "time_to_freeze",
    "turn_rate",
]
