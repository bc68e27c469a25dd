"""Clips cut into windows, all solved side by side, and joined again: the inside of `denoise`.

A path is walked window after window, as nobody knows where it will have led. A noisy clip is known as a
whole, so its windows need not wait for each other: each begins with the memory that the network has of
the smooth line before it, and neighbours share some frames, over which one fades into the other. Work
grows with the clip, memory does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from ..encodings.path import turned
from ..models import LstmGmm, State
from . import terms
from .denoise_seen import ROOT, YAW, NoiseLevels, Seen, features_of
from .energy import Before, Energy
from .window import Search, descend

_TILT, _STEP = slice(4, 6), 3  # channels of features: tilt; the first ones are the step's
LOOSE = 0.5  # of the noise, by which a window may begin elsewhere than the smooth line


@dataclass(frozen=True)
class Settings:
    """How a clip is cleaned.

    Parameters
    ----------
    window, overlap : frames of a window, and of those that it shares with the next.
    memory : frames of the smooth line that are read before a window.
    rounds : times that it is done; each begins with what the one before it found, and with feet down
        where they are slow there.
    method, steps : of `window.solve`, in each round.
    batch : windows that are solved side by side.
    prior, contact : factors on these terms (eq. 16, 19), 0 leaves one out. The observation's is 1.
    slow : m/s below which a toe is taken to rest while noise is still left on it; labels have 0.45.
    spread : frames over which a change spreads to both sides; what is sought is as smooth as the line
        that it is added to, so that little noise can come back with it.
    least : nats a frame that the likeliest motion must have, or a smooth line comes back; -inf: it never
        does. None: as `denoise_known` has it.
    disturbed : whether the network's inputs may be disturbed, d of eq. 17.
    first_state : whether the memory before a clip's first frame is found by gradient (eq. 27).
    """

    window: int = 64
    overlap: int = 16
    memory: int = 24
    method: str = "adam"
    steps: int = 20
    rounds: int = 3
    batch: int = 32
    prior: float = 0.4
    contact: float = 1.0
    slow: float = 0.6
    spread: float = 1.5
    least: float | None = None
    disturbed: bool = False
    first_state: bool = False


@dataclass
class Job:
    """One clip to be cleaned.

    Parameters
    ----------
    seen, noise : see `denoise_seen`.
    rows : (frames, channels), a smooth line to begin with.
    line : like them, what comes back if the network knows no such motion.
    contacts : (frames, 2) from 0 to 1.
    """

    seen: Seen
    noise: NoiseLevels
    rows: Tensor
    line: Tensor
    contacts: Tensor | None = None


@dataclass
class Cleaned:
    """rows as of `Job`; parts : nats a frame of each term; evaluations : of an energy."""

    rows: Tensor
    parts: dict[str, float]
    evaluations: int


@dataclass
class _Window:
    """Frames from `first` on of a clip, `real` of which the clip has."""

    clip: int
    first: int
    real: int


def clean(
    model: LstmGmm,
    jobs: list[Job],
    how: Settings,
    generator: torch.Generator | None = None,
    done: Callable[[int], None] = lambda frames: None,
) -> list[Cleaned]:
    """The likeliest motion of each clip, given what was seen (eq. 25). done : told of frames solved."""
    features = [features_of(model.encoding, job.rows, job.contacts) for job in jobs]
    windows = [w for i, job in enumerate(jobs) for w in _windows(i, len(job.rows), how)]
    sums = [torch.zeros(len(job.rows), job.rows.shape[1]).double() for job in jobs]
    parts: list[list[tuple[int, dict[str, float]]]] = [[] for _ in jobs]
    evaluations = [0] * len(jobs)
    for chunk in torch.arange(len(windows)).split(how.batch):
        some = [windows[i] for i in chunk.tolist()]
        rows, said, times = _solve(model, jobs, features, some, how, generator)
        for k, window in enumerate(some):
            job = jobs[window.clip]
            share = _share(window, len(job.rows), how)
            where = slice(window.first, window.first + window.real)
            sums[window.clip][where] += share[:, None] * rows[k, : window.real]
            numbers = {name: float(value[k]) for name, value in said.items()}
            parts[window.clip].append((window.real, numbers))
            evaluations[window.clip] += times
        done(sum(window.real - how.overlap * (window.first > 0) for window in some))
    return [
        Cleaned(total, _a_frame(said), times)
        for total, said, times in zip(sums, parts, evaluations, strict=True)
    ]


def _windows(clip: int, frames: int, how: Settings) -> list[_Window]:
    """Where windows begin; one of frames that the one before it has, too, is none."""
    step = how.window - how.overlap
    firsts = [0, *(f for f in range(step, frames, step) if f + how.overlap < frames)]
    return [_Window(clip, first, min(how.window, frames - first)) for first in firsts]


def _share(window: _Window, frames: int, how: Settings) -> Tensor:
    """Of each of its frames (real,), what the window says of them; with its neighbours' it is 1."""
    share = torch.ones(window.real).double()
    ramp = (torch.arange(how.overlap).double() + 1) / (how.overlap + 1)
    if window.first:
        share[: how.overlap] *= ramp[: window.real]
    if window.first + window.real < frames:
        share[-how.overlap :] *= 1 - ramp
    return share


def _a_frame(parts: list[tuple[int, dict[str, float]]]) -> dict[str, float]:
    frames = sum(count for count, _ in parts)
    return {name: sum(said[name] for _, said in parts) / frames for name in parts[0][1]}


def _solve(
    model: LstmGmm,
    jobs: list[Job],
    features: list[Tensor],
    windows: list[_Window],
    how: Settings,
    generator: torch.Generator | None,
) -> tuple[Tensor, dict[str, Tensor], int]:
    """Rows (batch, frames, channels) of windows, their terms, and how often asked."""
    before = _before(model, jobs, features, windows, how)
    cut = lambda each, fill=None: torch.stack([
        _cut(each[w.clip], w, how.window, fill) for w in windows
    ])  # fmt: skip
    s = model.normalizer(cut(features))
    real = cut([torch.ones(len(job.rows), dtype=torch.bool) for job in jobs], False)
    foretold = real.clone()
    foretold[:, 0] = False  # so it may begin where it likes
    levels = torch.tensor([jobs[w.clip].noise for w in windows])
    wishes = _wishes(model, jobs, cut, before, levels, how)
    weights = {"prior": how.prior, "contact": how.contact}
    weights = {name: w for name, w in weights.items() if name == "prior" or name in wishes}
    energy = Energy(model, before, wishes, weights, foretold)
    d = torch.zeros(*s.shape[:2], model.encoding.dim)
    search = _FromSomewhere(
        energy, s, d, levels, torch.tensor([w.first == 0 for w in windows]), how
    )
    descend(search, how.method, how.steps, generator)
    with torch.no_grad():
        s, d, before = search.at(search.best)
        said = energy.parts(s, d, before)
        found = model.normalizer.inverse(s)
        whole = torch.cat([before.frame[:, None], found], 1)
        path = model.encoding.root_path(whole.double(), before.place)[:, 1:]
        yaw = before.place[:, 2:] + found[..., 2].double().cumsum(1)
        pose = found[..., model.encoding.slices["pose"]].double()
        tilt = found[..., _TILT].double()
    return torch.cat([path, yaw[..., None], tilt, pose], -1), said, search.evaluations


def _cut(clip: Tensor, window: _Window, length: int, fill: bool | None) -> Tensor:
    """Frames of a clip, filled up beyond its end, with its last frame if nothing is said."""
    part = clip[window.first : window.first + length]
    lacking = length - len(part)
    last = part[-1:] if fill is None else torch.full_like(part[-1:], fill)
    return torch.cat([part, last.expand(lacking, *part.shape[1:])]) if lacking else part


def _wishes(
    model: LstmGmm, jobs: list[Job], cut: Callable, before: Before, levels: Tensor, how: Settings
) -> dict[str, terms.Term]:
    """What was seen (eq. 26), and feet that stand (eq. 19)."""
    encoding = model.encoding
    wanted = cut([job.seen.rows for job in jobs])
    mask = cut([job.seen.believed for job in jobs], False)
    root, angle = levels.float().T
    found = {
        "root": terms.places(wanted[:, :, None, ROOT], [0], mask[..., :1], root[:, None, None, None]),
        "heading": terms.headings(
            wanted[..., YAW] - before.place[:, None, 2], mask[..., YAW], angle[:, None]
        ),
        "tilt": terms.channels(
            wanted[..., 4:6], _TILT, mask[..., 4:6], angle[:, None, None]
        ),
        "angles": terms.channels(
            wanted[..., 6:], encoding.slices["pose"], mask[..., 6:], angle[:, None, None]
        ),
    }  # fmt: skip
    if "contacts" in encoding.slices and how.contact > 0:
        found["contact"] = terms.contact(encoding.skeleton)
    return found


@torch.no_grad()
def _before(
    model: LstmGmm, jobs: list[Job], features: list[Tensor], windows: list[_Window], how: Settings
) -> Before:
    """The frame before each window, with the memory of those before it; none before a clip."""
    frames, places, states = [], [], []
    for window in windows:
        rows, own = jobs[window.clip].rows, features[window.clip]
        if window.first:
            frame, row = own[window.first - 1], rows[window.first - 1]
            place = row[[0, 2, YAW]]
            run = own[max(0, window.first - how.memory) : window.first]
            states.append(model.read(run[None], model.zero_state(1))[1])
        else:  # one step before it, at which the network has seen nothing
            frame, row = own[0], rows[0]
            yaw = row[YAW] - frame[2]
            ahead = torch.stack([frame[0], torch.zeros(()), frame[1]]).double()
            place = torch.cat([(row[ROOT] - turned(ahead, yaw))[[0, 2]], yaw[None]])
            states.append(model.zero_state(1)._replace(frame=frame[None]))
        frame = frame.clone()
        if "contacts" in model.encoding.slices:
            frame[model.encoding.slices["contacts"]] = 0.0  # what is fixed must not hold feet
        frames.append(frame)
        places.append(place)
    state = State(*(torch.cat(part) for part in zip(*states, strict=True)))
    return Before(state, torch.stack(frames), torch.stack(places))


class _FromSomewhere(Search):
    """A search that also looks for where a window begins, and with what memory (eq. 27)."""

    def __init__(
        self, energy: Energy, s: Tensor, d: Tensor, levels: Tensor, begins: Tensor, how: Settings
    ) -> None:
        super().__init__(energy, s, d)
        frames = torch.arange(s.shape[1]).to(s)
        near = (-((frames[:, None] - frames) / how.spread).square() / 2).exp()
        self.lasting = near / near.square().sum(1, keepdim=True).sqrt()
        root, angle = levels.float().T
        std = energy.model.normalizer.std
        self.loose = LOOSE * torch.stack([root, root, angle], 1) / std[:_STEP]
        self.disturbed = float(how.disturbed)
        state = energy.before.state
        self.memories = begins.to(s)[:, None, None] if how.first_state else None
        self.sizes = [self.s[0].numel(), self.d[0].numel(), _STEP]
        if how.first_state:
            self.sizes += [state.hidden[0].numel(), state.cell[0].numel()]
        self.best = self.zero()

    def zero(self) -> Tensor:
        sizes = getattr(self, "sizes", [0])
        return self.s.new_zeros(len(self.s), sum(sizes))

    def at(self, free: Tensor) -> tuple[Tensor, Tensor, Before]:
        """s, d, and where the window begins, that free numbers stand for."""
        u, v, place, *memory = free.split(self.sizes, 1)
        s, d = super().at(torch.cat([u, self.disturbed * v], 1))
        step = torch.nn.functional.pad(self.loose * place, (0, s.shape[-1] - _STEP))
        s = torch.cat([s[:, :1] + step[:, None], s[:, 1:]], 1)
        before = self.energy.before
        if self.memories is not None:
            state = before.state
            hidden = state.hidden + self.memories * memory[0].view_as(state.hidden).tanh()
            cell = state.cell + self.memories * memory[1].view_as(state.cell)
            before = before._replace(state=state._replace(hidden=hidden, cell=cell))
        return s, d, before
