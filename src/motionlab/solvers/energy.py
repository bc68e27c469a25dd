"""How unlikely, and how far from what is wished, a window of motion is (RNN-GAN, eq. 15 to 20).

Maximum a posteriori: of all motions s and disturbances d that may go on from here, which is both
likely under the network and near to what is wished? The energy is the negative logarithm of both::

    E(s, d) = -log p(s | s_0, d) + |d|² / 2σ² + Σ weight · term(s),

a sum over named terms, so that each can be looked at, weighed, and left out. `terms` has the paper's
and ours. The network's part runs through the whole window: what is said of frame t depends on all
frames before it, by s and d, and so does its gradient (BPTT).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import torch
from torch import Tensor

from ..encodings import JointAngles
from ..errors import SolverError
from ..models import LstmGmm, Mixture, State
from .live_slope import points_with_slope
from .terms import Term

NOISE = 0.05  # σ of d in normalised units, the paper's and the training's
OWN = ("prior", "noise")


def _looked_at(terms: Iterable[Term]) -> frozenset[int] | None:
    """The points that terms look at; None, all of them, if one does not say."""
    each = [getattr(term, "points", None) for term in terms]
    return None if None in each else frozenset().union(*each)


class Before(NamedTuple):
    """Where a window goes on: all that is known of the frame before it.

    state : that has seen the frame, with what disturbed it.
    frame : (batch, dim), the frame as it was, raw units.
    place : (batch, 3), x, z in metres and yaw in radians of it.
    """

    state: State
    frame: Tensor
    place: Tensor

    def __getitem__(self, rows) -> Before:
        return Before(self.state[rows], self.frame[rows], self.place[rows])


class Energy:
    """Weighted terms over windows that go on from a state.

    Parameters
    ----------
    model : a generator with a likelihood; its parameters should ask for no gradients.
    before : (batch), where the windows begin.
    terms : wishes by name, of `terms` or your own; "prior" and "noise" are always there.
    weights : factor on a term by its name, 1 where none is given; or factors (batch,), a window each.
        A weight of 0 for all leaves it out.
    foretold : bool (batch, frames), of which frames the network has a say. None: of all.

    Raises
    ------
    SolverError : the model has no likelihood, or a weight is for no term or no number from 0.
    """

    def __init__(
        self,
        model: LstmGmm,
        before: Before,
        terms: Mapping[str, Term] | None = None,
        weights: Mapping[str, float | Tensor] | None = None,
        foretold: Tensor | None = None,
    ) -> None:
        if not isinstance(model, LstmGmm):
            raise SolverError(
                f"{type(model).__name__} has no likelihood to weigh wishes against; take an LstmGmm."
            )
        self.model, self.before, self.foretold = model, before, foretold
        self.terms, self.weights = dict(terms or {}), dict(weights or {})
        self._first: Mixture | None = None
        known = [*OWN, *self.terms]
        for name, weight in self.weights.items():
            if name not in known:
                raise SolverError(f"A weight for {name!r}; the terms are {', '.join(known)}.")
            if not all(0 <= each < float("inf") for each in torch.as_tensor(weight).reshape(-1)):
                raise SolverError(f"The weight of {name!r} is {weight!r}; it must be 0 or more.")
        if twice := set(OWN) & set(self.terms):
            raise SolverError(f"{sorted(twice)} are the energy's own terms; take other names.")

    def __call__(self, s: Tensor, d: Tensor, before: Before | None = None) -> Tensor:
        """Energy (batch,) of windows; arguments as of `parts`."""
        return sum(self.parts(s, d, before).values())

    def parts(self, s: Tensor, d: Tensor, before: Before | None = None) -> dict[str, Tensor]:
        """Each term by its name, weighed: (batch,) in nats.

        Parameters
        ----------
        s : (batch, frames, kept), the motion in normalised units.
        d : (batch, frames, dim), what disturbs the network's inputs, in normalised units. That of
            the last frame matters to what follows the window only.
        before : where the windows begin, if not where the energy's own do: that may be sought, too.
        """
        before = self.before if before is None else before
        each = {name for name, weight in self.weights.items() if getattr(weight, "ndim", 0)}
        wanted = lambda name: name in each or self.weights.get(name, 1.0) > 0
        found = {}
        features = self.model.normalizer.inverse(s)
        if wanted("prior"):
            likely = self.mixture(features, d, before).log_prob(s)
            found["prior"] = -(likely if self.foretold is None else likely * self.foretold).sum(1)
        if wanted("noise"):
            found["noise"] = (d / NOISE).square().flatten(1).sum(1) / 2
        if terms := {name: term for name, term in self.terms.items() if wanted(name)}:
            rows = self.decoded(features, _looked_at(terms.values()), before)
            found |= {name: term(*rows) for name, term in terms.items()}
        return {name: self.weights.get(name, 1.0) * value for name, value in found.items()}

    def mixture(self, features: Tensor, d: Tensor, before: Before | None = None) -> Mixture:
        """What the network says of each frame of features (batch, frames, dim) before it sees it."""
        state = (self.before if before is None else before).state
        first = self._foretold_first(state)
        if features.shape[1] == 1:
            return Mixture(*(part[:, None] for part in first))
        rest, _ = self.model.read(features[:, :-1], state, d[:, :-1])
        return Mixture(*(torch.cat([a[:, None], b], 1) for a, b in zip(first, rest, strict=True)))

    def _foretold_first(self, state: State) -> Mixture:
        """What the network says of the first frames; of the energy's own, which no search changes, once."""
        own = state is self.before.state and not any(part.requires_grad for part in state)
        if not own:
            return self.model.predict(state)
        if self._first is None:
            with torch.no_grad():
                self._first = self.model.predict(state)
        return self._first

    def decoded(
        self,
        features: Tensor,
        points: frozenset[int] | None = None,
        before: Before | None = None,
    ) -> tuple[Tensor, Tensor, Tensor | None]:
        """What a term gets: features, positions and contacts, with the frame before as row 0.

        points : those that will be looked at; the others may be NaN. None: all.
        """
        before, encoding = self.before if before is None else before, self.model.encoding
        features = torch.cat([before.frame[:, None], features], dim=1)
        positions, some = None, {}
        if isinstance(encoding, JointAngles):
            some = {"points": points}
            positions = points_with_slope(encoding, features, before.place, points)
        if positions is None:
            positions = encoding.positions(features, before.place, **some)
        has = "contacts" in encoding.slices
        return features, positions, encoding.contacts(features) if has else None
