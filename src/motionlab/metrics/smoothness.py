"""How jerky a motion is."""

from __future__ import annotations

from math import comb

from torch import Tensor

from .checks import check_frames, check_positions, check_positive, check_rate


def acceleration(
    positions: Tensor, fps: float, per_point: bool = False, step: float = 1 / 30
) -> Tensor:
    """Mean size of the points' acceleration, in m/s².

    Second differences over `step` seconds, so that it is the same at every frame rate even where
    feet hit the ground: there, the shorter the step, the larger the difference.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres.
    fps : frames per second.
    per_point : keep the points apart.
    step : seconds between the frames that are compared, rounded to whole frames, at least one.

    Returns
    -------
    (...), or (..., points) per point; metres per second squared, mean over frames and points.

    Raises
    ------
    MetricError : wrong shape, too few frames for two steps, NaN, a bad rate.
    """
    return _difference(positions, fps, 2, per_point, step)


def jerk(positions: Tensor, fps: float, per_point: bool = False, step: float = 1 / 30) -> Tensor:
    """Mean size of the points' jerk, the third derivative of position, in m/s³.

    Flash and Hogan 1985 hold that people move such as to keep it low; trembling shows here first.
    Third differences over `step` seconds; arguments and errors as for `acceleration`.

    Returns
    -------
    (...), or (..., points) per point; metres per second cubed, mean over frames and points.
    """
    return _difference(positions, fps, 3, per_point, step)


def _difference(positions: Tensor, fps: float, order: int, per_point: bool, step: float) -> Tensor:
    """Mean norm of finite differences of an order, taken every frame over strides of `step`."""
    positions, fps = check_positions(positions), check_rate(fps)
    stride = max(1, round(check_positive(step, "step") * fps))
    frames = positions.shape[-3]
    check_frames(frames, order * stride + 1, "positions")
    kept = frames - order * stride
    # Binomial weights: +1 -2 +1 for the second difference, +1 -3 +3 -1 for the third.
    total = sum(
        (-1) ** k * comb(order, k) * positions.narrow(-3, (order - k) * stride, kept)
        for k in range(order + 1)
    )
    size = total.norm(dim=-1).mean(-2) * (fps / stride) ** order
    return size if per_point else size.mean(-1)
