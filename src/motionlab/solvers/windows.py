"""Window after window along paths: what is guessed, solved, tried again, and stands fast.

The inside of `path_control.follow`. All paths go side by side, as one batch, until each is at its end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import torch
from torch import Tensor

from ..metrics import broken
from ..models import LstmGmm
from ..models.sampler import Chance
from ..paths import Curves, Near, Path, Piece
from .energy import Before, Energy
from .guided import Steering, guided
from .terms import Term
from .window import DESCENTS, Solved, solve

LONGER, ROUGH = 2, 0.012  # times; m, root mean square from the path in a window
RETRIES = 2
ASTRAY = 0.10  # m, root mean square from the path in a window: that is no following
LATE, LEAST_LATE = 0.2, 0.2  # share of a window's way, and m, that may lack beyond the leeway
STRANGE = 20.0  # deviations of the data from their mean: no body is there
UNLIKELY = 60.0  # nats a frame less than samples have: the body comes apart
RECENT = 10  # frames whose steps tell how somebody goes
LEEWAY = 0.3  # seconds behind a timetable that are caught up with


@dataclass
class Stretch:
    """What the wishes of a window are made from; see `wishes`.

    piece : the path about there; arcs : (batch, frames) metres that should lie behind the root,
    frame by frame; which : (batch,) number of each path; first : number of its first frame.
    """

    model: LstmGmm
    piece: Piece
    arcs: Tensor
    which: Tensor
    first: int


Wishes = Callable[[Stretch], Mapping[str, Term]]


@dataclass(frozen=True)
class Settings:
    """How windows are solved; arguments of `path_control.follow`."""

    fastest: float
    wish: Wishes
    weights: Mapping[str, float | Tensor]
    chance: Chance
    method: str
    steps: int
    candidates: int
    guide: bool
    retries: int
    window: int
    overlap: int


class News(NamedTuple):
    """What newly stands fast of one path, number `path` of those that are followed.

    features : (1 + new, dim), raw units, behind the frame before, row 0, that stands at place (3,): x, z
    in metres, yaw in radians. done : share of the path, 0 to 1.
    """

    path: int
    features: Tensor
    place: Tensor
    done: float


@dataclass
class Way:
    """One path on its way: its timetable, and what stands fast of it so far."""

    table: Tensor
    frames: list[Tensor]  # (some, dim) each
    parts: list[dict[str, float]] = field(default_factory=list)
    evaluations: int = 0
    retries: int = 0
    finished: bool = False
    clock: float = 0.0  # frame of the timetable


@dataclass
class Job:
    """All paths that are still being walked, and where each of them is."""

    model: LstmGmm
    paths: list[Path]
    before: Before
    ways: list[Way]
    how: Settings

    def __post_init__(self) -> None:
        self.curves, self.which = Curves(self.paths), torch.arange(len(self.paths))
        self.arcs = torch.zeros(len(self.paths), dtype=torch.float64)
        self.recent = self.before.frame[:, None, :3]  # the last steps and turns
        self.tail: tuple[Tensor, Tensor] | None = None  # what is to be solved again
        self.usual: float | None = None  # log-likelihood a frame of what the network samples
        self.first = 0

    def go_on(self) -> list[News]:
        """Solve a window, and let its first frames stand fast: these."""
        arcs = self._due()
        rows = torch.arange(len(self.which))
        solved = self._search(arcs, rows, self.how.guide)
        for _ in range(self.how.retries):
            lost = rows[self._astray(arcs, solved, rows)]
            if not len(lost):
                break
            again = self._search(arcs, lost, push=True)
            whole = ~self._astray(arcs, again, lost)
            solved = _better(solved, again, lost, whole)
            for number in self.which[lost].tolist():
                self.ways[number].retries += 1
        return self._stand_fast(arcs, solved)

    def _search(self, arcs: Tensor, rows: Tensor, push: bool) -> Solved:
        """From a guess downhill, for some of the batch; who is not near his path goes on."""
        solved = self._solve(arcs, rows, *self._guess(arcs, rows, push))
        for _ in range(LONGER if self.how.method in DESCENTS else 0):
            rough = (self._off(arcs, solved, rows) > ROUGH).nonzero()[:, 0]
            if len(rough):
                further = self._solve(arcs, rows[rough], solved.s[rough], solved.d[rough])
                solved = _better(solved, further, rough)
        return solved

    def leave_off(self) -> None:
        """What is solved and waited for what comes next stands fast as it is."""
        if self.tail is not None:
            for row, number in enumerate(self.which.tolist()):
                self.ways[number].frames.append(self.model.normalizer.inverse(self.tail[0][row]))

    def _due(self) -> Tensor:
        """Metres (batch, frames) that should lie behind the roots in the window's frames."""
        rows, ahead = [], torch.arange(1, self.how.window + 1, dtype=torch.float64)
        for row, number in enumerate(self.which.tolist()):
            way, arc, leeway = self.ways[number], float(self.arcs[row]), LEEWAY * self.model.fps
            table = way.table
            if self.paths[number].times is None:
                # no hour is fixed: whoever is far behind his timetable, or ahead, goes on from there
                here = _inverse(table, arc)
                way.clock = here + min(max(way.clock - here, -leeway), leeway)
            index = way.clock + ahead
            last = len(table) - 1
            low = index.floor().clamp(0, last - 1).long()
            due = torch.lerp(table[low], table[low + 1], (index - low).clamp(0, 1))
            pace = max(
                float(table[max(last - 2, 0)] - table[max(last - 3, 0)]), 0.3 / self.model.fps
            )
            due = due + (index - last).clamp(min=0) * pace  # beyond the end it walks on
            rows.append(torch.minimum(due, arc + ahead * (self.how.fastest / self.model.fps)))
        return torch.stack(rows)

    def _energy(self, arcs: Tensor, rows: Tensor) -> Energy:
        """Of the windows of some of the batch; a row may be asked for again and again."""
        first, last = self.arcs[rows] - 0.5, arcs[rows].amax(1) + 2.0
        piece = self.curves.piece(first, last, self.which[rows])
        stretch = Stretch(self.model, piece, arcs[rows], self.which[rows], self.first)
        weights = {
            name: weight[self.which[rows]] if isinstance(weight, Tensor) and weight.ndim else weight
            for name, weight in self.how.weights.items()
        }
        return Energy(self.model, self.before[rows], self.how.wish(stretch), weights)

    def _solve(self, arcs: Tensor, rows: Tensor, s: Tensor, d: Tensor) -> Solved:
        """From a guess, for some of the batch."""
        energy = self._energy(arcs, rows)
        solved = solve(energy, s, d, self.how.method, self.how.steps, self.how.chance.generator)
        for number in self.which[rows].tolist():
            self.ways[number].evaluations += solved.evaluations
        return solved

    @torch.no_grad()
    def _guess(self, arcs: Tensor, rows: Tensor, push: bool) -> tuple[Tensor, Tensor]:
        """Of a few samples that of least energy; they begin with the tail of the window before.

        push : whether they are led to the path.
        """
        many = rows.repeat_interleave(self.how.candidates)
        before, place, recent = self.before[many], self.before.place[many], self.recent[many]
        done, where = 0, self.arcs[many]
        if self.tail is not None:
            s, d = (part[many] for part in self.tail)
            features = self.model.normalizer.inverse(s)
            _, state = self.model.read(features, before.state, d)
            rows_of = torch.cat([before.frame[:, None], features], 1)
            path, yaw = (
                self.model.encoding.root_path(rows_of, before.place),
                features[..., 2].sum(1),
            )
            place = torch.cat([path[:, -1, [0, 2]], (place[:, 2] + yaw)[:, None]], 1)
            piece = self.curves.piece(where - 0.5, arcs[many].amax(1) + 1, self.which[many])
            where = piece.nearest(place[:, None, :2].double()).arcs[:, 0]
            recent, done = features[..., :3], features.shape[1]
            before = Before(state, features[:, -1], place)
        steering = Steering.after(
            self.curves, self.which[many], self.model.fps, place, where, recent[:, -RECENT:]
        )
        new = guided(self.model, before, steering, arcs[many, done:], self.how.chance, push)
        if self.tail is not None:
            new = tuple(torch.cat([a[many], b], 1) for a, b in zip(self.tail, new, strict=True))
        energy = self._energy(arcs, many)
        if self.usual is None:
            features = self.model.normalizer.inverse(new[0])
            self.usual = float(energy.mixture(features, new[1]).log_prob(new[0]).median())
        value = energy(*new).nan_to_num(torch.inf).view(len(rows), -1)
        for number in self.which[rows].tolist():
            self.ways[number].evaluations += self.how.candidates
        which = value.argmin(1) + torch.arange(len(rows)) * self.how.candidates
        return new[0][which], new[1][which]

    @torch.no_grad()
    def _off(self, arcs: Tensor, solved: Solved, rows: Tensor) -> Tensor:
        """Metres (rows,), root mean square, from the path; 0 where nobody asks for one."""
        energy = self._energy(arcs, rows)
        root, near = self._roots(arcs, solved, rows)
        off = (root - near.places).square().sum(-1).mean(1).sqrt()
        return off * self._asked(energy, "path")

    def _roots(self, arcs: Tensor, solved: Solved, rows: Tensor) -> tuple[Tensor, Near]:
        """Where roots are over the ground (rows, frames, 2), and the places of the path next to them."""
        before = self.before[rows]
        features = torch.cat([before.frame[:, None], self.model.normalizer.inverse(solved.s)], 1)
        root = self.model.encoding.root_path(features, before.place)[:, 1:, [0, 2]]
        first, last = self.arcs[rows] - 0.5, arcs[rows].amax(1) + 2.0
        return root, self.curves.piece(first, last, self.which[rows]).nearest(root)

    @staticmethod
    def _asked(energy: Energy, name: str) -> Tensor | bool:
        """Whether a term is there and weighs something, for all or (rows,)."""
        return name in energy.terms and torch.as_tensor(energy.weights.get(name, 1.0)) > 0

    @torch.no_grad()
    def _late(self, arcs: Tensor, solved: Solved, rows: Tensor) -> Tensor:
        """Who (rows,) ends far behind his timetable, or before it."""
        _, near = self._roots(arcs, solved, rows)
        way = arcs[rows, -1] - arcs[rows, 0]
        fixed = torch.tensor([self.paths[i].times is not None for i in self.which[rows].tolist()])
        leeway = LEEWAY * self.model.fps / self.how.window * ~fixed
        late = (near.arcs[:, -1] - arcs[rows, -1]).abs()
        late = late > ((LATE + leeway) * way).clamp(min=LEAST_LATE)
        return late & self._asked(self._energy(arcs, rows), "time")

    @torch.no_grad()
    def _astray(self, arcs: Tensor, solved: Solved, rows: Tensor) -> Tensor:
        """Who (rows,) is not where he should be, holds a pose that nobody does, or comes apart."""
        energy = self._energy(arcs, rows)
        features = self.model.normalizer.inverse(solved.s)
        likely = energy.mixture(features, solved.d).log_prob(solved.s).mean(1)
        well = (self._off(arcs, solved, rows) < ASTRAY) & ~self._late(arcs, solved, rows)
        well &= solved.s.abs().amax((1, 2)) < STRANGE
        if broken.knows(self.model.encoding):
            well &= broken.beyond(self.model.encoding, features).amax(1) < 0
        return ~(well & (likely > self.usual - UNLIKELY) & solved.energy.isfinite())

    @torch.no_grad()
    def _stand_fast(self, arcs: Tensor, solved: Solved) -> list[News]:
        """The window's first frames are decided; state, place and path go on behind them."""
        parts = self._energy(arcs, torch.arange(len(self.which))).parts(solved.s, solved.d)
        keep = self.how.window - self.how.overlap
        features = self.model.normalizer.inverse(solved.s)
        kept, before = features[:, :keep], self.before
        _, state = self.model.read(kept, before.state, solved.d[:, :keep])
        walked = self.model.encoding.root_path(
            torch.cat([before.frame[:, None], kept], 1), before.place
        )
        ground = walked[:, 1:, [0, 2]].double()
        piece = self.curves.piece(self.arcs - 0.5, arcs.amax(1) + 2.0, self.which)
        behind = piece.nearest(ground).arcs
        yaw = before.place[:, 2] + kept[..., 2].double().sum(1)
        place = torch.cat([ground[:, -1], yaw[:, None]], 1)
        going, news = torch.ones(len(self.which), dtype=torch.bool), []
        for row, number in enumerate(self.which.tolist()):
            way, path = self.ways[number], self.paths[number]
            way.parts.append({name: float(v[row]) / self.how.window for name, v in parts.items()})
            frames = _to_the_end(behind[row], path, len(way.table) - 1 - self.first)
            way.finished, frames = frames is not None, frames or keep
            way.frames.append(kept[row, :frames])
            going[row] = not way.finished
            way.clock += keep
            fast = torch.cat([before.frame[row, None], kept[row, :frames]])
            news.append(News(number, fast, before.place[row], self._share(way, path, behind[row])))
        self.before = Before(state[going], kept[going, -1], place[going])
        if self.how.overlap:
            self.tail = solved.s[going, keep:], solved.d[going, keep:]
        self.which, self.arcs = self.which[going], behind[going, -1]
        self.recent = torch.cat([self.recent, kept[..., :3]], 1)[going, -RECENT:]
        self.first += keep
        return news

    def _share(self, way: Way, path: Path, behind: Tensor) -> float:
        """Of a path, 0 to 1, that is done with metres `behind` (frames,)."""
        if way.finished:
            return 1.0
        if path.times is not None:
            return min(1.0, sum(map(len, way.frames)) / len(way.table))
        return float((behind[-1] / path.length).clamp(0, 1))


def _to_the_end(behind: Tensor, path: Path, left: int) -> int | None:
    """How many of the frames with metres `behind` (frames,) lead to the end of a path, if they do.

    left : frames that a path with times still has.
    """
    if path.times is not None:
        return left if left <= len(behind) else None
    there = (behind >= path.length - 0.01).nonzero()[:, 0]
    return int(there[0]) + 1 if len(there) else None


def _inverse(table: Tensor, arc: float) -> float:
    """The (fractional) frame at which a rising table (frames,) has come to `arc`."""
    high = int(torch.searchsorted(table, arc).clamp(1, len(table) - 1))
    low, step = table[high - 1], table[high] - table[high - 1]
    return high - 1 + float(((arc - low) / step.clamp(min=1e-9)).clamp(0, 1))


def _better(solved: Solved, again: Solved, rows: Tensor, whole: Tensor | bool = False) -> Solved:
    """Windows with the lower energy of two tries; the second is for some rows only.

    whole : (rows,) where the second wins at any energy.
    """
    wins = (again.energy < solved.energy[rows]) | whole
    won, mine = rows[wins], wins.nonzero()[:, 0]
    parts = [part.clone() for part in solved[:3]]
    for part, new in zip(parts, again[:3], strict=True):
        part[won] = new[mine]
    return Solved(*parts, solved.evaluations + again.evaluations)
