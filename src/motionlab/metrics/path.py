"""Does the body follow the path that was drawn for it?"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from ..errors import MetricError
from .checks import check_floats, check_positions

_AT_ONCE = 1 << 20  # distances from frames to segments held in memory at a time


class PathError(NamedTuple):
    """Distance of the root from a curve: `rms` (...) in cm, `mean_square` (...) in cm²."""

    rms: Tensor
    mean_square: Tensor


def root_path_error(positions: Tensor, curve: Tensor) -> PathError:
    """How far the root strays from a curve on the ground (RNN-GAN, table 1).

    The distance from the root, seen from above, to the nearest point of the curve, in every frame.
    The paper calls its numbers "MSE in cm", which is not the unit of a square: both readings are
    given. Nothing is said about when the root is where: standing on the curve costs nothing.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres; point 0 is the root.
    curve : (n, 2) metres, x and z of the corners of a polyline, at least two. A closed curve
        repeats its first corner at the end.

    Returns
    -------
    PathError(rms, mean_square), each (...).

    Raises
    ------
    MetricError : wrong shapes, NaN.
    """
    positions = check_positions(positions)
    curve = check_floats(curve, "curve")
    if curve.ndim != 2 or curve.shape[1] != 2 or len(curve) < 2:
        raise MetricError(
            f"curve has shape {tuple(curve.shape)}; it must be (corners, 2): x and z in metres of "
            "at least two corners."
        )
    root = positions[..., 0, [0, 2]].double()
    curve = curve.to(root)
    rows = root.reshape(-1, 2).split(max(1, _AT_ONCE // len(curve)))
    squares = torch.cat([_square_distance(some, curve) for some in rows]).reshape(root.shape[:-1])
    mean_square = 1e4 * squares.mean(-1)
    return PathError(mean_square.sqrt(), mean_square)


def _square_distance(points: Tensor, curve: Tensor) -> Tensor:
    """Squared distance (n,) of points (n, 2) from the nearest of a polyline's segments."""
    start, along = curve[:-1], curve.diff(dim=0)
    gap = points[:, None] - start
    length = along.square().sum(-1).clamp(min=1e-18)  # a corner given twice is a point
    part = ((gap * along).sum(-1) / length).clamp(0, 1)
    return (gap - part[..., None] * along).square().sum(-1).amin(-1)
