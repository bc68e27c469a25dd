"""Where root and feet of a short window are, with the slope written out: for `energy`, in numpy.

The same as `JointAngles.positions`. A window of five frames is little to calculate in some hundred pieces,
forwards and backwards, and torch takes some microseconds to begin with any of them, numpy a fraction.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from ..encodings import JointAngles
from ..encodings.effectors import chain_ends
from ..models.refiner_step import turns_of
from .live_points import FeetPoints, feet_of, led, way_of

ROWS = 64  # frames of all windows together; torch is faster with more
SMALL = 0.02  # radians, below which a rotation's slope is that of its series


def points_with_slope(
    encoding: JointAngles, features: Tensor, place: Tensor, points: frozenset[int] | None
) -> Tensor | None:
    """Points (batch, frames, points, 3) metres, NaN all but root and feet.

    None for what is not calculated here: other points, many frames, another precision or device.

    features : (batch, frames, dim), raw units; place : (batch, 3), x, z and yaw of frame 0.
    """
    feet = feet_of(encoding)
    if feet is None or points is None or not points <= {0, *feet.feet}:
        return None
    plain = features.dtype == torch.float32 and features.device.type == "cpu"
    if not plain or features[..., 0].numel() > ROWS or place.requires_grad:
        return None
    return _Points.apply(features, feet, place.double().numpy())


class _Points(torch.autograd.Function):
    @staticmethod
    def forward(ctx, features: Tensor, feet: FeetPoints, place: np.ndarray) -> Tensor:
        batch, frames, _ = features.shape
        rows = features.detach().numpy().astype(float)
        ctx.feet, ctx.rows = feet, rows
        ctx.vectors = rows.reshape(batch * frames, -1).T.take(feet.columns, 0)
        ctx.vectors = ctx.vectors.reshape(-1, 3, batch * frames)
        ctx.turns = turns_of(ctx.vectors, feet.mean.astype(float))
        ends = chain_ends(ctx.turns, feet.levels, feet.offsets).transpose(2, 0, 1)
        ctx.ends = ends.reshape(batch, frames, -1, 3)  # seen from the root, in its heading
        root, ctx.yaw = way_of(rows, place)
        x, z = led(ctx.ends[..., [0, 2]], ctx.yaw[..., None])
        found = np.full((batch, frames, feet.encoding.points, 3), np.nan, np.float32)
        found[:, :, 0] = root
        found[:, :, feet.feet] = np.stack([x, ctx.ends[..., 1], z], -1) + root[:, :, None]
        return torch.from_numpy(found)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, blame: Tensor) -> tuple[Tensor, None, None]:
        blame, feet = blame.numpy().astype(float), ctx.feet
        of_feet = blame[:, :, feet.feet]  # (batch, frames, feet, 3)
        slope = np.zeros_like(ctx.rows)
        of_root = of_feet.sum(2) + blame[:, :, 0]
        slope[..., 3] = of_root[..., 1]
        later = of_root[:, :0:-1, [0, 2]].cumsum(1)[:, ::-1]  # of all frames from a step on
        sideways, of_ends = _led_slope(
            of_feet[..., [0, 2]], ctx.ends[..., [0, 2]], ctx.yaw[..., None]
        )
        of_yaw = sideways.sum(2)
        sideways, slope[:, 1:, :2] = _led_slope(later, ctx.rows[:, 1:, :2], ctx.yaw[:, :-1])
        of_yaw[:, :-1] += sideways
        slope[:, 1:, 2] = of_yaw[:, :0:-1].cumsum(1)[:, ::-1]
        of_ends = np.stack([of_ends[..., 0], of_feet[..., 1], of_ends[..., 1]], -1)
        of_turns = _chain_slope(of_ends.reshape(-1, *of_ends.shape[2:]), ctx.turns, feet)
        bare = np.einsum("jba,jbck->jack", feet.mean, of_turns)  # without the mean pose
        vectors = _turn_slope(ctx.vectors, bare)
        vectors[0, 1] = 0  # no number
        flat = slope.reshape(-1, slope.shape[-1])
        np.add.at(flat, (slice(None), feet.columns), vectors.reshape(len(feet.columns), -1).T)
        return torch.from_numpy(slope.astype(np.float32)), None, None


def _led_slope(
    blame: np.ndarray, steps: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Blame of yaw (...) and of steps (..., 2), from that of x and z (..., 2)."""
    x, z = led(steps, yaw)
    back = led(blame, -yaw)
    return blame[..., 0] * z - blame[..., 1] * x, np.stack(back, -1)


def _chain_slope(blame: np.ndarray, turns: np.ndarray, feet: FeetPoints) -> np.ndarray:
    """Blame of turns (joints, 3, 3, rows), from that of ends (rows, feet, 3)."""
    ends = [feet.offsets[-1][..., None] + np.zeros(turns.shape[-1])]
    for level in reversed(range(len(feet.levels))):
        turned = (turns[feet.levels[level]] * ends[0][:, None]).sum(2)
        ends.insert(0, turned + feet.offsets[level][..., None])
    found, blame = np.zeros_like(turns), blame.transpose(1, 2, 0)
    for level, joints in enumerate(feet.levels):
        np.add.at(found, joints, blame[:, :, None] * ends[level + 1][:, None])
        blame = (turns[joints] * blame[:, :, None]).sum(1)
    return found


def _turn_slope(vectors: np.ndarray, blame: np.ndarray) -> np.ndarray:
    """Blame of rotation vectors (joints, 3, rows), from that of their matrices (joints, 3, 3, rows).

    R = cos θ + a [v]× + b v vᵀ, a = sin θ / θ, b = (1 - cos θ) / θ².
    """
    angle = np.sqrt((vectors * vectors).sum(1))
    tiny, safe = angle < SMALL, np.maximum(angle, SMALL)
    sine, cosine = np.sin(safe), np.cos(safe)
    square = angle * angle
    a = np.where(tiny, 1 - square / 6, sine / safe)
    b = np.where(tiny, 0.5 - square / 24, (1 - cosine) / safe**2)
    to_a = np.where(tiny, -1 / 3 + square / 30, (safe * cosine - sine) / safe**3)  # a' / θ
    to_b = np.where(tiny, -1 / 12 + square / 180, (safe * sine - 2 * (1 - cosine)) / safe**4)
    cross = np.stack([blame[:, 2, 1] - blame[:, 1, 2], blame[:, 0, 2] - blame[:, 2, 0],
                      blame[:, 1, 0] - blame[:, 0, 1]], 1)  # fmt: skip
    both = ((blame + blame.swapaxes(1, 2)) * vectors[:, None]).sum(2)
    trace = blame[:, 0, 0] + blame[:, 1, 1] + blame[:, 2, 2]
    along = to_a * (vectors * cross).sum(1) + to_b * (vectors * both).sum(1) / 2 - a * trace
    return along[:, None] * vectors + a[:, None] * cross + b[:, None] * both
