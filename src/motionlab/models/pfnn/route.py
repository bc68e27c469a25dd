"""A line drawn on the ground, to be walked along: where it is and which way it goes, by its length."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ...errors import ModelError

_SPACING = 0.01  # metres between the points that a line is turned into
_BACK, _ON = 0.2, 0.5  # metres along the line in which the nearest place is sought
LONGEST = 2_000.0  # metres


class Routes:
    """Some polylines at once, each going straight on after its end.

    Parameters
    ----------
    lines : of each its corners (n, 2), x and z in metres.
    beyond : metres that each goes on after its end.

    Raises
    ------
    ModelError : a line without two different corners, NaN, or one that is too long.
    """

    def __init__(self, lines: Sequence[Tensor], beyond: float) -> None:
        dense = [_dense(_checked(line)) for line in lines]
        self.lengths = torch.tensor([(len(points) - 1) * _SPACING for points in dense])
        most = max(map(len, dense)) + round(beyond / _SPACING)
        self.points = torch.stack([_longer(points, most) for points in dense])  # (lines, n, 2)
        self._rows = torch.arange(len(dense))[:, None]

    def at(self, along: Tensor) -> tuple[Tensor, Tensor]:
        """Places (lines, n, 3) and directions (lines, n, 3) at lengths (lines, n) along the lines."""
        steps = along / _SPACING
        before = steps.floor().long().clamp(0, self.points.shape[1] - 2)
        here, next_ = self.points[self._rows, before], self.points[self._rows, before + 1]
        way = next_ - here
        place = here + way * (steps - before).clamp(0, 1)[..., None]
        return upright(place), upright(torch.nn.functional.normalize(way, dim=-1))

    def nearest(self, places: Tensor, along: Tensor) -> Tensor:
        """Lengths (lines,) nearest to places (lines, 3), not far from lengths (lines,) along them.

        Who crosses the own way goes on along it, and does not take the other branch.
        """
        within = torch.arange(-round(_BACK / _SPACING), round(_ON / _SPACING) + 1)
        some = ((along / _SPACING).round().long()[:, None] + within).clamp(
            0, self.points.shape[1] - 2
        )
        gaps = flat(places)[:, None] - self.points[self._rows, some]
        best = some.gather(1, gaps.square().sum(-1).argmin(1, keepdim=True))  # (lines, 1)
        here, way = self.at(best * _SPACING)
        rest = ((places - here[:, 0]) * way[:, 0]).sum(-1).clamp(-_SPACING, _SPACING)
        return (best[:, 0] * _SPACING + rest).clamp(min=0)


def upright(pairs: Tensor) -> Tensor:
    """Places (..., 3) on the ground of x and z (..., 2)."""
    x, z = pairs.unbind(-1)
    return torch.stack([x, torch.zeros_like(x), z], dim=-1)


def flat(places: Tensor) -> Tensor:
    """x and z (..., 2) of places (..., 3)."""
    return places[..., [0, 2]]


def _checked(line: Tensor) -> Tensor:
    """Corners (n, 2) in double precision, each different from the one before."""
    try:
        line = torch.as_tensor(line).double()
    except (TypeError, ValueError, RuntimeError) as error:
        raise ModelError(f"A path must be an array of numbers (n, 2): {error}.") from error
    if line.ndim != 2 or line.shape[1] != 2:
        raise ModelError(
            f"A path has shape {tuple(line.shape)}; it must be (n, 2): x and z in metres."
        )
    if not line.isfinite().all():
        row = int((~line.isfinite().all(-1)).nonzero()[0])
        raise ModelError(f"Point {row} of a path is NaN or infinite; leave it out.")
    moved = line.diff(dim=0).norm(dim=-1) > 0
    line = line[torch.cat([moved.new_ones(1), moved])] if len(line) else line
    if len(line) < 2:
        raise ModelError("A path needs two different points or more; there is nowhere to go.")
    length = float(line.diff(dim=0).norm(dim=-1).sum())
    if length > LONGEST:
        raise ModelError(f"A path is {length:.0f} m long, above {LONGEST:.0f} m; cut it in pieces.")
    return line


def _dense(corners: Tensor) -> Tensor:
    """Points (m, 2) at equal lengths along a polyline, from its start on."""
    way = corners.diff(dim=0)
    ends = torch.cat([way.new_zeros(1), way.norm(dim=-1).cumsum(0)])
    wanted = torch.arange(max(2, round(float(ends[-1]) / _SPACING) + 1)) * _SPACING
    which = (torch.searchsorted(ends, wanted.double(), right=True) - 1).clamp(0, len(way) - 1)
    part = ((wanted - ends[which]) / (ends[which + 1] - ends[which])).clamp(0, 1)
    return (corners[which] + way[which] * part[:, None]).float()


def _longer(points: Tensor, count: int) -> Tensor:
    """As many points as that, going straight on at the end."""
    last = torch.nn.functional.normalize(points[-1] - points[-2], dim=-1) * _SPACING
    more = torch.arange(1, count - len(points) + 1)[:, None] * last
    return torch.cat([points, points[-1] + more])
