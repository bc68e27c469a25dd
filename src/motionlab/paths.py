"""Ways over the ground: what is drawn becomes a curve one can walk, evenly spaced, with a timetable.

A curve is known by its length: where one is after so many metres, which way it leads there, and how
many metres lie behind somebody who is near it. Who solves for motion and who is led ask the same.

way = Path.through([[0, 0], [3, 0], [3, 3]])            # corners in metres, x and z
way = Path.through(places, spline=True)                 # a smooth curve through them
way = Path.through(places, times=[0, 2, 5])             # to be there at these seconds
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from .errors import WayError

SPACING = 0.03  # m between the places of a curve
CORNER = 0.4  # m, radius to which corners are rounded, at least
LEAST = 0.1  # m: a shorter path is none
BEYOND = 8.0  # m that a curve goes on straight, at both ends
BACK, ON = 0.2, 0.5  # m of path in which one is sought who moves along it
SIDEWAYS = 2.5  # m/s²: people slow down where a curve would push them harder
SLOWEST, CHANGE = 0.4, 1.0  # m/s that even a hairpin is walked at; m/s² of slowing down for it
LONGEST = 5_000.0  # m


class Near(NamedTuple):
    """Nearest places (batch, n, 2) of a path, which stand fast, and metres of path (batch, n) before
    them, which change with the points they are nearest to."""

    places: Tensor
    arcs: Tensor


class Piece(NamedTuple):
    """A stretch of path for each window of a batch.

    Only a stretch, so that where a path crosses itself, or comes back, the nearest place is one that
    the body is to be at about now. places : (batch, n, 2) metres; arcs : (batch, n), metres of path
    before them.
    """

    places: Tensor
    arcs: Tensor

    def nearest(self, points: Tensor) -> Near:
        """The nearest places to points (batch, k, 2).

        A nearest place moves along the path only, at right angles to what separates it from the
        point: so the slope of a squared distance is right with the place held fast.
        """
        with torch.no_grad():
            # on one of the two lines that meet in the nearest of the given places
            apart = points[:, :, None].detach() - self.places[:, None].to(points)
            corner = apart.square().sum(-1).argmin(-1)  # (batch, k)
            which = torch.stack([corner - 1, corner], -1).clamp(0, self.places.shape[1] - 2)
            rows = torch.arange(len(points), device=points.device)[:, None, None]
            begin, end = (self.places[rows, which + i].to(points) for i in (0, 1))
            along, gap = end - begin, points[:, :, None].detach() - begin  # (batch, k, 2, 2)
            length = along.square().sum(-1).clamp(min=1e-12)
            share = ((gap * along).sum(-1) / length).clamp(0, 1)
            second = (gap - share[..., None] * along).square().sum(-1).argmin(-1, keepdim=True)
            which, share, length = (
                part.gather(2, second)[..., 0] for part in (which, share, length)
            )
            begin, along = (
                part.gather(2, second[..., None].expand(-1, -1, 1, 2))[:, :, 0]
                for part in (begin, along)
            )
            places, rows = begin + share[..., None] * along, rows[..., 0]
            before = self.arcs[rows, which]
            ways = (self.arcs[rows, which + 1] - before).to(points)
            arcs = before.to(points) + share * ways
            free = (share > 0) & (share < 1)  # a corner stays the nearest for a while
            slope = along * (free * ways / length)[..., None]
        moved = points - points.detach()
        return Near(places, arcs + (moved * slope).sum(-1))


@dataclass(frozen=True, eq=False)
class Path:
    """A curve on the ground, in places evenly spaced, and when to be where.

    drawn : (n, 2) metres, as given, without repeated places; or the smooth curve through them.
    places : (m, 2) metres, the curve that is to be walked: corners rounded.
    times : (k,) seconds and `behind` (k,) metres of path at them; None if only the speed is given.
    """

    drawn: Tensor
    places: Tensor
    times: np.ndarray | None = None
    behind: np.ndarray | None = None

    @classmethod
    def through(
        cls,
        points: Tensor | Sequence,
        times: Tensor | Sequence | None = None,
        spline: bool = False,
        corner: float = CORNER,
    ) -> Path:
        """The way through points.

        Parameters
        ----------
        points : (n, 2) metres, x and z, at least two that differ. One given again at once counts
            once, or, with times, is a wait.
        times : (n,) seconds at which it should be there, rising; the first is when it begins.
        spline : a smooth curve through them; else they are corners of a line.
        corner : metres, radius to which what is sharper is rounded. 0 leaves all as it is.

        Raises
        ------
        WayError : no such points, a NaN, no length or an absurd one, or times that stand still or
            go back.
        """
        points = _points(points)
        if not 0 <= corner < math.inf:
            raise WayError(f"corner is {corner!r}; it must be metres, 0 or more.")
        times = None if times is None else _times(times, len(points))
        new = np.r_[True, np.any(np.diff(points, axis=0) != 0, axis=1)]
        if not new[1:].any():
            raise WayError(
                f"A path needs two places that differ; {len(points)} given, all at "
                f"({points[0, 0]:g}, {points[0, 1]:g})."
            )
        drawn = points[new]
        drawn = _spline(drawn) if spline and len(drawn) > 2 else drawn
        curve = _even(drawn)
        length = float(_arcs(curve)[-1])
        if not LEAST <= length <= LONGEST:
            raise WayError(
                f"A path of {length:.3g} m; it must be {LEAST:g} to {LONGEST:g} m long. Are the "
                "numbers metres?"
            )
        walked = _even(_rounded(curve, corner)) if corner else curve
        behind = None if times is None else _behind(points, curve)
        if behind is not None:  # a rounded path is a little shorter
            behind = behind * (_arcs(walked)[-1] / length)
        return cls(torch.from_numpy(drawn), torch.from_numpy(walked), times, behind)

    @property
    def arcs(self) -> Tensor:
        """Metres of path (m,) before each place."""
        return torch.from_numpy(_arcs(self.places.numpy()))

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.arcs[-1])

    def timetable(self, speed: float, fastest: float, fps: float) -> Tensor:
        """Metres of path (frames,) that should lie behind the body, frame by frame.

        Parameters
        ----------
        speed : metres a second; not used if there are times. Slower where the path bends sharply.
        fastest : metres a second that no timetable goes beyond: who is late stays late.
        """
        if self.times is None:
            arcs, pace = self.arcs.numpy(), np.minimum(self._paces(speed), fastest)
            seconds = np.r_[0, np.cumsum(2 * np.diff(arcs) / (pace[1:] + pace[:-1]))]
            frames = max(1, math.ceil(seconds[-1] * fps - 1e-6))
            return torch.from_numpy(np.interp(np.arange(frames + 1) / fps, seconds, arcs))
        frames = max(1, round((self.times[-1] - self.times[0]) * fps))
        asked = np.interp(self.times[0] + np.arange(frames + 1) / fps, self.times, self.behind)
        kept = [asked[0]]
        for metres in asked[1:]:
            kept.append(min(metres, kept[-1] + fastest / fps))
        return torch.tensor(kept, dtype=torch.float64)

    def _paces(self, speed: float) -> np.ndarray:
        """Metres a second at each place: slower in bends, and before and after them."""
        bend = _bends(self.places.numpy(), 0.3)
        pace = np.minimum(speed, np.sqrt(SIDEWAYS / np.maximum(bend, 1e-6)))
        pace = np.maximum(pace, min(speed, SLOWEST))
        for order in (range(1, len(pace)), range(len(pace) - 2, -1, -1)):
            step = 1 if order.step > 0 else -1
            for i in order:
                pace[i] = min(pace[i], math.sqrt(pace[i - step] ** 2 + 2 * CHANGE * SPACING))
        return pace


class Curves:
    """Paths side by side, each going on straight at both ends; arcs count from where each begins.

    beyond : metres that they go on at least.
    """

    def __init__(self, paths: Sequence[Path], beyond: float = BEYOND) -> None:
        longest = max(len(path.places) for path in paths)
        more = math.ceil(beyond / min(path.length / (len(path.places) - 1) for path in paths))
        self.spacings, rows = [], []
        for path in paths:
            places = path.places
            first, last = places[1] - places[0], places[-1] - places[-2]
            before = places[0] - first * torch.arange(more, 0, -1)[:, None]
            after = places[-1] + last * torch.arange(1, longest - len(places) + more + 1)[:, None]
            rows.append(torch.cat([before, places, after]))
            self.spacings.append(path.length / (len(places) - 1))
        self.places, self.before = torch.stack(rows), more  # (paths, n, 2)
        self.spacing = torch.tensor(self.spacings, dtype=torch.float64)[:, None]

    def at(self, arcs: Tensor, which: Tensor) -> Tensor:
        """Places (batch, k, 2) at arcs (batch, k) metres of path `which` (batch,)."""
        here, there, share = self._about(arcs, which)
        return (1 - share) * here + share * there

    def ways(self, arcs: Tensor, which: Tensor) -> Tensor:
        """Which way (batch, k, 2), of length 1, the paths lead there; arguments as of `at`."""
        here, there, _ = self._about(arcs, which)
        return torch.nn.functional.normalize(there - here, dim=-1)

    def _about(self, arcs: Tensor, which: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The places before and behind arcs, and the share of the way between them."""
        steps = arcs.double() / self.spacing[which] + self.before
        steps = steps.clamp(0, self.places.shape[1] - 1.001)
        low, rows = steps.floor().long(), which[:, None]
        return self.places[rows, low], self.places[rows, low + 1], (steps - low)[..., None]

    def onward(self, places: Tensor, arcs: Tensor, which: Tensor) -> Tensor:
        """Metres of path (batch,) behind who is at places (batch, 2) and was at arcs (batch,).

        Who crosses his own way goes on along it, and does not take the other branch.
        """
        near = self.piece(arcs - BACK, arcs + ON, which)
        return near.nearest(places[:, None]).arcs[:, 0]

    def piece(self, first: Tensor, last: Tensor, which: Tensor) -> Piece:
        """The stretches from first to last (batch,) metres, at most 5 cm from place to place."""
        n = max(2, math.ceil(float((last - first).max()) / 0.05) + 1)
        share = torch.linspace(0, 1, n, dtype=torch.float64)
        arcs = first[:, None].double() + (last - first)[:, None] * share
        return Piece(self.at(arcs, which), arcs)


# -- on the ground and above it ------------------------------------------------------------------


def upright(pairs: Tensor) -> Tensor:
    """Places (..., 3) on the ground of x and z (..., 2)."""
    x, z = pairs.unbind(-1)
    return torch.stack([x, torch.zeros_like(x), z], dim=-1)


def flat(places: Tensor) -> Tensor:
    """x and z (..., 2) of places (..., 3)."""
    return places[..., [0, 2]]


# -- what is given --------------------------------------------------------------------------------


def _points(points: Tensor | Sequence) -> np.ndarray:
    try:
        points = np.asarray(points, dtype=np.float64).copy()
    except (TypeError, ValueError, RuntimeError) as error:
        raise WayError(f"A path must be an array (n, 2) of numbers: {error}.") from error
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise WayError(
            f"A path of shape {points.shape}; it must be (n, 2), x and z in metres of at least two "
            "places. A single place leads nowhere."
        )
    if not np.isfinite(points).all():
        bad = int((~np.isfinite(points)).any(1).argmax())
        raise WayError(f"Place {bad + 1} of the path is {points[bad].tolist()}; leave it out.")
    return points


def _times(times: Tensor | Sequence, count: int) -> np.ndarray:
    try:
        times = np.asarray(times, dtype=np.float64)
    except (TypeError, ValueError, RuntimeError) as error:
        raise WayError(f"times must be an array (n,) of seconds: {error}.") from error
    if times.shape != (count,) or not np.isfinite(times).all():
        raise WayError(f"times of shape {times.shape} for {count} places; one each, no NaN.")
    if (steps := np.diff(times)).min() <= 0:
        i = int((steps <= 0).argmax())
        raise WayError(
            f"Place {i + 2} has time {times[i + 1]:g} s and the one before it {times[i]:g} s; times "
            "must rise."
        )
    return times


# -- curves as arrays (n, 2) ----------------------------------------------------------------------


def _arcs(curve: np.ndarray) -> np.ndarray:
    return np.r_[0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]


def _even(curve: np.ndarray) -> np.ndarray:
    arcs = _arcs(curve)
    wanted = np.linspace(0, arcs[-1], max(2, math.ceil(arcs[-1] / SPACING) + 1))
    return np.stack([np.interp(wanted, arcs, column) for column in curve.T], axis=1)


def _spline(points: np.ndarray) -> np.ndarray:
    from scipy.interpolate import CubicSpline

    # by the root of distances (centripetal): near places make no loops
    knots = np.r_[0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1) ** 0.5)]
    count = max(2, math.ceil(2 * _arcs(points)[-1] / SPACING))
    return CubicSpline(knots, points)(np.linspace(0, knots[-1], count))


def _bends(curve: np.ndarray, span: float) -> np.ndarray:
    """Curvature (n,) in 1/m: the turn within `span` metres about each place, by their length."""
    reach = max(1, round(span / 2 / SPACING))
    if len(curve) < 2 * reach + 2:
        return np.zeros(len(curve))
    going = np.unwrap(np.arctan2(*np.diff(curve, axis=0).T))
    turns = np.abs(going[2 * reach - 1 :] - going[: len(going) - 2 * reach + 1])
    bends = np.zeros(len(curve))
    bends[reach : reach + len(turns)] = turns / (SPACING * (2 * reach - 1))
    return bends


def _rounded(curve: np.ndarray, radius: float) -> np.ndarray:
    """The curve with what bends more sharply than the radius drawn straighter, and nothing else.

    There, each place moves towards the middle of its neighbours, again and again, until all of the
    curve is gentle enough: curve-shortening, where it is needed. A hairpin has no end of that; it
    keeps what is left.
    """
    curve = curve.copy()
    reach = max(1, round(radius / 4 / SPACING))
    for _ in range(40):
        sharp = _bends(curve, radius / 2) > 1 / radius
        if not sharp.any():
            break
        soft = np.convolve(sharp, np.ones(2 * reach + 1), "same")[1:-1, None] > 0
        for _ in range(20):
            middle = (curve[2:] + curve[:-2]) / 2
            curve[1:-1] += 0.5 * soft * (middle - curve[1:-1])
    return curve


def _behind(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Metres of curve (n,) before each of the points it leads through, one after the other."""
    arcs, found, begin = _arcs(curve), [], 0
    chords = _arcs(points)
    for i, point in enumerate(points):
        # not farther on than chords allow, so that a crossing is passed when it is due
        reach = begin + 1 + math.ceil(
            (3 * (chords[i] - chords[i - 1]) if i else 0) / SPACING
        )  # fmt: skip
        span = curve[begin : reach + 1]
        begin += int(np.linalg.norm(span - point, axis=1).argmin()) if i else 0
        found.append(arcs[begin])
    found[-1] = arcs[-1]
    return np.array(found)
