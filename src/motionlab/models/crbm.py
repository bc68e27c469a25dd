"""CRBM, the conditional restricted Boltzmann machine: hidden yes-or-no units that past frames lead.

Taylor, Hinton and Roweis (2006), *Modeling Human Motion Using Binary Latent Variables*, section 3; a
rival of STRNN in its table of forecasts. Given the frames before it, u, a frame v and hidden units h
have the energy ::

    E(v, h | u) = |v - a - A u|² / 2 - (b + B u) . h - v . W h ,

so that v is a straight guess from the past, moved by those hidden units that are on. What v and h are
together has no closed form; it is learned by contrastive divergence.
"""

from __future__ import annotations

from typing import Self

import torch
from torch import Tensor, nn
from torch.nn.functional import linear, softplus

from .. import encodings
from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_counts, check_normalizer, checked_features, checked_going_on


class Crbm(nn.Module):
    """One frame ahead by energy, again and again.

    Features go in and come out in raw units; inside they are normalised, so that each channel has the
    deviation of one that the energy supposes.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    width : hidden units; 150 in the paper's walks.
    order : frames before that one looks at.
    steps : Gibbs steps of contrastive divergence, from the true frame.
    """

    settings = ("width", "order", "steps")

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, width: int = 150, order: int = 3,
        steps: int = 1,
    ) -> None:  # fmt: skip
        super().__init__()
        check_normalizer(encoding, normalizer)
        check_counts("Crbm", width=width, order=order, steps=steps)
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.order, self.steps = width, order, steps
        self.kept = kept = len(normalizer.kept)
        self.pairs = nn.Parameter(0.01 * torch.randn(kept, width))  # W
        self.ahead = nn.Linear(order * kept, kept)  # a, A
        self.lead = nn.Linear(order * kept, width)  # b, B
        for part in (self.ahead, self.lead):
            nn.init.normal_(part.weight, std=0.01)
            nn.init.zeros_(part.bias)

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    # -- energies ---------------------------------------------------------------------------------

    def free_energy(self, frame: Tensor, past: Tensor) -> Tensor:
        """-log of the sum of exp(-E) over all h, of frames (..., kept), normalised, after past.

        past : (..., order kept), the frames before, the oldest first.
        """
        off = frame - self.ahead(past)
        return off.square().sum(-1) / 2 - softplus(self._on(frame, past)).sum(-1)

    def _on(self, frame: Tensor, past: Tensor) -> Tensor:
        """Log odds (..., width) that hidden units are on."""
        return self.lead(past) + frame @ self.pairs

    def _frame(self, hidden: Tensor, past: Tensor) -> Tensor:
        """The mean (..., kept) of frames, given hidden units (..., width) and the past."""
        return self.ahead(past) + linear(hidden, self.pairs)

    # -- learning ---------------------------------------------------------------------------------

    def loss(self, features: Tensor, lots: Tensor | None = None) -> Tensor:
        """What is low when frames of features (batch, frames, dim) are more likely than others.

        In training mode: the free energy of true frames over that of what Gibbs steps make of them, of
        a channel. Its gradient is that of contrastive divergence; its value says nothing. Otherwise:
        mean squared error of the next frame, of a channel, normalised.

        lots : (batch,) whole numbers; the first is the seed of the Gibbs steps.
        """
        features = checked_features(self, features)
        if features.shape[1] <= self.order:
            raise ModelError(
                f"Windows have {features.shape[1]} frames; this CRBM needs more than the {self.order} "
                "that it looks back."
            )
        true = self.normalizer(features)
        past = true[:, :-1].unfold(1, self.order, 1).mT.flatten(2)
        frame = true[:, self.order :]
        if not self.training:
            said = self._next(past, true[:, self.order - 1 : -1])
            return (said - frame).square().mean()
        seed = 0 if lots is None else int(lots[0])
        made = self._gibbs(frame, past, torch.Generator(true.device).manual_seed(seed))
        apart = self.free_energy(frame, past) - self.free_energy(made, past)
        return apart.mean() / self.kept

    @torch.no_grad()
    def _gibbs(self, frame: Tensor, past: Tensor, generator: torch.Generator) -> Tensor:
        """Frames (..., kept) after `steps` draws of hidden units; of frames the paper takes the mean."""
        for _ in range(self.steps):
            hidden = torch.bernoulli(self._on(frame, past).sigmoid(), generator=generator)
            frame = self._frame(hidden, past)
        return frame

    # -- at run time ------------------------------------------------------------------------------

    def _next(self, past: Tensor, frame: Tensor, rounds: int = 30) -> Tensor:
        """The frame (..., kept) after the past: the mean field, from a first guess. Where it rests, the
        free energy is flat: of the frames around, it is the likeliest."""
        for _ in range(rounds):
            frame = self._frame(self._on(frame, past).sigmoid(), past)
        return frame

    @torch.no_grad()
    def extrapolate(self, features: Tensor, n: int) -> Tensor:
        """n frames (batch, n, dim) that go on from features (batch, frames, dim).

        Each is the mean field after 30 rounds that begin with the frame before; no chance is in it. Of
        features (frames, dim) it is (n, dim). Raises ModelError for fewer frames than `order`, another
        number of channels, NaN, or n below 1.
        """
        features, one = checked_going_on(self, features, n, self.order, "this CRBM")
        seen, made = self.normalizer(features)[:, -self.order :], []
        for _ in range(n):
            made.append(self._next(seen.flatten(1), seen[:, -1]))
            seen = torch.cat([seen[:, 1:], made[-1][:, None]], 1)
        found = self.normalizer.inverse(torch.stack(made, 1))
        return found[0] if one else found

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        kept = {name: getattr(self, name) for name in self.settings}
        return {"encoding": self.encoding.config(), "kept": self.kept, **kept}

    @classmethod
    def from_config(cls, config: dict) -> Self:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, config["kept"])
        return cls(encoding, normalizer, **{name: config[name] for name in cls.settings})
