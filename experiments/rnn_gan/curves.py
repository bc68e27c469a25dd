"""The curves of W5: circle and sine as in the paper's figure 12, and what a designer draws besides.

Each is metres (n, 2) of x, to the left, and z, ahead: it begins at the origin and leads ahead at
first. `left` says to which side it bends first.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

SPACING = 0.05  # m between places of a smooth curve


def shapes(size: float, length: float) -> dict[str, Tensor]:
    """Smooth curves and a square, each to both sides.

    size : metres, radius of the smaller circle; the others go with it. length : metres, of each.
    """
    found = {}
    for side in ("left", "right"):
        drawn = {
            f"circle {size:g} m": circle(size, length),
            f"circle {1.5 * size:g} m": circle(1.5 * size, length),
            f"sine {size / 2:g} m": sine(size / 2, 3 * size, length),
            f"sine {size / 4:g} m": sine(size / 4, 2.5 * size, length),
            "figure eight": eight(0.75 * size, length),
            "spiral": spiral(0.5 * size, 2 * size, length),
            "square": square(1.5 * size, length),
        }
        way = torch.tensor([1.0 if side == "left" else -1.0, 1.0])
        found |= {f"{name}, {side}": way * curve for name, curve in drawn.items()}
    return found


def splines(count: int, step: float, length: float, seed: int = 0) -> dict[str, Tensor]:
    """Lines such as a hand draws: a few places, `step` metres apart, and a smooth curve through them.

    From place to place the way turns by an angle that is drawn anew, up to 60°.
    """
    chance = torch.Generator().manual_seed(seed)
    found = {}
    for number in range(count):
        turns = (2 * torch.rand(math.ceil(length / step), generator=chance) - 1) * math.radians(60)
        turns[0] = 0.0
        way = turns.cumsum(0)
        moves = step * torch.stack([way.sin(), way.cos()], 1)
        corners = torch.cat([torch.zeros(1, 2), moves.cumsum(0)])
        found[f"spline {number + 1}"] = cut(smooth(corners), length)
    return found


def circle(radius: float, length: float) -> Tensor:
    return bent(lambda arc: torch.full_like(arc, 1 / radius), length)


def spiral(least: float, most: float, length: float) -> Tensor:
    """Radii grow evenly from the least to the most."""
    return bent(lambda arc: 1 / (least + (most - least) * arc / length), length)


def eight(radius: float, length: float) -> Tensor:
    """Two circles that touch; one, then the other."""
    round_ = 2 * math.pi * radius
    return bent(lambda arc: torch.where(arc % (2 * round_) < round_, 1.0, -1.0) / radius, length)


def sine(amplitude: float, period: float, length: float) -> Tensor:
    """About the line that its slope at the origin makes with its axis."""
    z = torch.arange(0, length, SPACING / 2, dtype=torch.float64)
    slope = -math.atan(2 * math.pi * amplitude / period)
    x = -amplitude * torch.sin(2 * math.pi * z / period)
    ahead = torch.stack(
        [x * math.cos(slope) - z * math.sin(slope), x * math.sin(slope) + z * math.cos(slope)], 1
    )
    return cut(ahead, length)


def square(edge: float, length: float) -> Tensor:
    """Corners of 90°, as they are drawn."""
    edges = math.ceil(length / edge)
    ways = torch.tensor([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
    moves = edge * ways[torch.arange(edges) % 4]
    return cut(torch.cat([torch.zeros(1, 2), moves.cumsum(0)]), length)


def bent(bend, length: float) -> Tensor:
    """The curve whose bend, 1/m, is a function of metres (n,) along it."""
    arc = torch.arange(0, length + SPACING / 2, SPACING, dtype=torch.float64)
    way = torch.cat([arc.new_zeros(1), torch.cumsum(bend(arc[:-1] + SPACING / 2) * SPACING, 0)])
    middle = (way[1:] + way[:-1]) / 2
    moves = SPACING * torch.stack([middle.sin(), middle.cos()], 1)
    return torch.cat([moves.new_zeros(1, 2), moves.cumsum(0)])


def smooth(corners: Tensor) -> Tensor:
    """A cubic spline through places (n, 2), by the metres between them."""
    from scipy.interpolate import CubicSpline

    knots = torch.cat([torch.zeros(1), corners.diff(dim=0).norm(dim=1).cumsum(0)]).double()
    wanted = torch.arange(0, float(knots[-1]), SPACING, dtype=torch.float64)
    return torch.from_numpy(CubicSpline(knots, corners.double())(wanted))


def cut(curve: Tensor, length: float) -> Tensor:
    """The first metres of a curve (n, 2)."""
    behind = torch.cat([curve.new_zeros(1), curve.diff(dim=0).norm(dim=1).cumsum(0)])
    last = int((behind < length).sum())
    if last >= len(curve):
        return curve
    part = (length - behind[last - 1]) / (behind[last] - behind[last - 1])
    return torch.cat([curve[:last], torch.lerp(curve[last - 1], curve[last], part)[None]])
