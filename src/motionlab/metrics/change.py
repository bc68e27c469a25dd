"""How much a motion changes over time: low where it freezes."""

from __future__ import annotations

from torch import Tensor

from .checks import check_features, check_positions, check_rate


def motion_change(positions: Tensor, fps: float, per_frame: bool = False) -> Tensor:
    """Motion change of acLSTM's figure 2: how fast the pose as one long vector moves.

    The paper plots the Euclidean distance between subsequent frames, which halves when the frame
    rate doubles. Here it is divided by the time between them, so that rates can be compared. Like
    `position_error` it grows with the number of points.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres, at least two frames. The paper's points are
        relative to the root; so are these if you subtract it.
    fps : frames per second.
    per_frame : the paper's own unit, metres from one frame to the next.

    Returns
    -------
    (..., frames - 1) metres per second: value t is the step from frame t to t + 1.

    Raises
    ------
    MetricError : wrong shape, fewer than two frames, NaN, a bad rate.
    """
    return feature_change(check_positions(positions, None, 2).flatten(-2), fps, per_frame)


def feature_change(features: Tensor, fps: float, per_frame: bool = False) -> Tensor:
    """`motion_change` of any features (..., frames, dim), in their unit per second."""
    features, fps = check_features(features, 2), check_rate(fps)
    step = features.diff(dim=-2).norm(dim=-1)
    return step if per_frame else step * fps
