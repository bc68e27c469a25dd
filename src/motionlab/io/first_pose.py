"""First frames that are no part of the motion: the T-pose by which a body was calibrated."""

from __future__ import annotations

from torch import Tensor

from ..motion import Motion

_HELD = 120  # frames for which it may be held
_AFTER, _NEXT = 4, 13  # of the frames after it, those whose steps count: filters blur the first
_TIMES = 4.0  # as far as the largest of these; people never move so
_FAR = 0.03  # of the body's extent, mean of all joints
_STILL = 1e-4  # of the same: so still is no living body


def doubt_first(motion: Motion, said: bool) -> str | None:
    """What to say if the body holds a pose, jumps to another and goes on smoothly from there.

    motion : as read; said : that it begins with one frame of it was said, so of one nothing is asked.
    """
    points = motion[: _HELD + _NEXT].positions()
    pose = points - points[:, :1]
    steps = pose.diff(dim=0).norm(dim=-1).mean(-1)
    extent = _extent(points[0])
    held = int((steps <= _STILL * extent).long().cumprod(0).sum())
    if len(steps) < held + _NEXT - 1 or held >= _HELD or (said and held == 0):
        return None
    first, largest = float(steps[held]), float(steps[held + _AFTER : held + _NEXT].max())
    poses = largest <= _STILL * extent  # one after the other, as keyed by hand
    if poses or first <= _FAR * extent or first < _TIMES * largest:
        return None
    times = f"{min(first / largest, 99):.0f} times as far as between any frames soon after"
    if held:
        return (
            f"frames 0 to {held} are one pose, and from there the body's joints jump {times}: if the body "
            "was calibrated by it, leave them out, of a pose without any turn with drop_zeros=True."
        )
    return (
        f"from frame 0 to frame 1 the body's joints jump {times}: if frame 0 is a pose by which the body "
        "was calibrated, leave it out with tpose_first=True."
    )


def _extent(points: Tensor) -> float:
    """The longest side of the box around points (points, 3)."""
    return float((points.amax(0) - points.amin(0)).max())
