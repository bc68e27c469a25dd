"""Filters, each with twelve settings to choose from, and the generator's one-step projection (W7)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import torch
from torch import nn

from motionlab import Motion, filters
from motionlab.feet import contacts
from motionlab.models import LstmGmm

from .noises import Case

TRIES = 12
Way = Callable[[Case], Motion]


def _gaussian(width: float) -> Way:
    return lambda case: filters.gaussian(case.seen, width, case.missing)


def _savitzky(frames: int, order: int) -> Way:
    return lambda case: filters.savitzky_golay(case.seen, frames, order, case.missing)


def _butterworth(cutoff: float) -> Way:
    return lambda case: filters.butterworth(case.seen, cutoff, case.missing)


def _kalman(cutoff: float) -> Way:
    return lambda case: filters.kalman(case.seen, cutoff, case.missing)


def _median_first(middle: int, frames: int, order: int) -> Way:
    return lambda case: filters.savitzky_golay(
        filters.median(case.seen, middle, case.missing), frames, order
    )


POLYNOMIALS = ((5, 2), (9, 2), (13, 2), (11, 4), (17, 4), (23, 4))
FILTERS: dict[str, dict[str, Way]] = {
    "gaussian": {f"{s:g} frames": _gaussian(s)
                 for s in (0.5, 0.7, 1, 1.3, 1.6, 2, 2.5, 3, 3.5, 4, 5, 6)},
    "savitzky-golay": {f"{n} frames, order {k}": _savitzky(n, k) for n, k in
                       (*POLYNOMIALS, (7, 2), (11, 2), (15, 2), (9, 4), (14 + 1, 4), (27, 4))},
    "butterworth": {f"{c:g} Hz": _butterworth(c)
                    for c in (1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9.5, 11)},
    "kalman": {f"{c:g} Hz": _kalman(c) for c in (0.8, 1, 1.3, 1.6, 2, 2.5, 3, 3.5, 4, 5, 6.5, 8)},
    "median, savitzky-golay": {f"median of {m}, {n} frames, order {k}": _median_first(m, n, k)
                               for m, (n, k) in product((3, 5), POLYNOMIALS)},
}  # fmt: skip


def tuned(ways: dict[str, Way], tuning: Sequence[Case]) -> tuple[Way, dict[str, str]]:
    """The setting for the root's place and that for rotations, each that errs least on `tuning`."""
    place, turns = {}, {}
    for name, way in ways.items():
        found = [way(case) for case in tuning]
        place[name] = sum(map(_root_error, found, tuning))
        turns[name] = sum(map(_pose_error, found, tuning))
    root, rest = min(place, key=place.get), min(turns, key=turns.get)

    def best(case: Case) -> Motion:
        found = ways[rest](case)
        if root == rest:
            return found
        return replace(found, root_positions=ways[root](case).root_positions)

    return best, {"root": root, "rotations": rest}


def _root_error(found: Motion, case: Case) -> float:
    return float((found.root_positions - case.truth.root_positions).norm(dim=-1).mean())


def _pose_error(found: Motion, case: Case) -> float:
    about = lambda motion: motion.positions() - motion.root_positions[:, None]
    return float((about(found) - about(case.truth)).norm(dim=-1).mean())


# -- one step of the generator --------------------------------------------------------------------

SMOOTHED, SHARES = (0.7, 1.5, 2.5), (0.25, 0.5, 0.75, 1.0)


@torch.no_grad()
def projected(model: LstmGmm, smoothed: float, share: float, case: Case) -> Motion:
    """Each frame moved by a share towards what the network expects after the frames before it.

    It reads what a Gaussian filter left; the root's way over the ground stays the filter's, since steps
    that are wrong by a little would lead it astray.
    """
    seen = filters.gaussian(case.seen, smoothed, case.missing)
    seen = replace(seen, contacts=contacts.label(seen))
    encoding = model.encoding
    rows = encoding.encode(seen)
    mixture = model.read(rows[None], model.zero_state(1))[0]
    expected = (mixture.log_weights.exp()[..., None] * mixture.means).sum(-2)[0, :-1]
    found = rows.clone()
    frames = model.normalizer(rows[1:])
    found[1:] = model.normalizer.inverse(frames + share * (expected - frames))
    found[:, :3] = rows[:, :3]
    return encoding.to_motion(found, encoding.start_of(seen), seen.name)


def projections(model: nn.Module) -> dict[str, Way]:
    """The settings of the projection."""
    return {
        f"after {s:g} frames, by {share:g}": (
            lambda case, s=s, share=share: projected(model, s, share, case)
        )
        for s, share in product(SMOOTHED, SHARES)
    }


def families(model: nn.Module) -> Iterator[tuple[str, dict[str, Way]]]:
    """All rivals by name, with their settings."""
    yield from FILTERS.items()
    yield "projection", projections(model)
