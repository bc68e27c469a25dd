"""Inverse kinematics: joint rotations from positions.

`solve` finds the rotations of a whole body from its points, `two_bone` those of one limb in closed
form, and `twist_error` tells what positions show of a rotation from what they hide. `HUMAN` is the
table of human joint limits.
"""

from .limb import two_bone
from .limits import HUMAN
from .solver import solve
from .twist import twist_error

__all__ = ["HUMAN", "solve", "twist_error", "two_bone"]
