"""A first frame that is no part of the motion: the T-pose by which a body was calibrated."""

from __future__ import annotations

from torch import Tensor

from ..motion import Motion

_AFTER, _NEXT = (
    4,
    14,
)  # frames with whose steps the first one is compared: filters blur it over some
_TIMES = 4.0  # as far as the largest of these; of 1456 real clips none does
_FAR = 0.03  # of the body's extent, mean of all joints


def doubt_first(motion: Motion, said: bool) -> str | None:
    """What to say if the body jumps from frame 0 to frame 1 and goes on smoothly from there.

    motion : as read, with all frames; said : how it begins was said, so nothing is asked.
    """
    if said or len(motion) < _NEXT:
        return None
    points = motion[:_NEXT].positions()
    pose = points - points[:, :1]
    steps = pose.diff(dim=0).norm(dim=-1).mean(-1)
    first, largest = float(steps[0]), float(steps[_AFTER:].max())
    if first <= _FAR * _extent(points[1]) or first < _TIMES * largest:
        return None
    return (
        f"from frame 0 to frame 1 the body's joints jump {min(first / max(largest, 1e-9), 99):.0f} times "
        "as far as between any frames soon after: if frame 0 is a pose by which the body was "
        "calibrated, leave it out with tpose_first=True."
    )


def _extent(points: Tensor) -> float:
    """The longest side of the box around points (points, 3)."""
    return float((points.amax(0) - points.amin(0)).max())
