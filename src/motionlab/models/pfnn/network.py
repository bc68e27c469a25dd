"""A network whose weights go round with the stride: the Phase-Functioned Neural Network.

Holden, Komura and Saito (2017), *Phase-Functioned Neural Networks for Character Control*, *Neural
Network Structure*, *Phase Function*, *Training*; what the code that they published settles.
"""

from __future__ import annotations

import math
from numbers import Integral
from typing import Self

import torch
from torch import Tensor, nn
from torch.nn.functional import elu

from ...encodings import Normalizer
from ...encodings.base import skeleton_config
from ...errors import ModelError
from ...skeleton import Skeleton
from .layout import Layout, size

CONTROLS = 4  # sets of weights


def shares(phase: Tensor) -> Tensor:
    """How much each set of weights counts at a phase: the phase function.

    A cubic Catmull-Rom spline goes through the four sets at phases 0, π/2, π and 3π/2, and closes.
    It is a weighted sum of them, whose weights add up to 1; some are below 0.

    Parameters
    ----------
    phase : (...) radians, any number of turns.

    Returns
    -------
    (..., 4)
    """
    along = phase * (CONTROLS / (2 * math.pi)) % CONTROLS
    before = along.floor()
    w = (along - before)[..., None]
    cubic = torch.cat(
        [
            w * (w * (1 - w / 2) - 1 / 2),
            w * w * (1.5 * w - 2.5) + 1,
            w * (w * (2 - 1.5 * w) + 1 / 2),
            w * w * (w - 1) / 2,
        ],
        dim=-1,
    )
    which = before.long()[..., None] + torch.arange(-1, 3, device=phase.device)
    return torch.zeros_like(cubic).scatter(-1, which % CONTROLS, cubic)


class PhaseLinear(nn.Module):
    """A linear layer with four sets of weights, blended by `shares`.

    weight : (4, outputs, inputs); bias : (4, outputs).
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(CONTROLS, outputs, inputs))
        self.bias = nn.Parameter(torch.zeros(CONTROLS, outputs))
        for weights in self.weight:
            nn.init.xavier_uniform_(weights)

    def at(self, phase: Tensor) -> tuple[Tensor, Tensor]:
        """Weights (..., outputs, inputs) and bias (..., outputs) at a phase (...)."""
        some = shares(phase)
        return (torch.tensordot(some, part, dims=1) for part in (self.weight, self.bias))

    def forward(self, x: Tensor, some: Tensor) -> Tensor:
        """Outputs (batch, outputs) of x (batch, inputs) with shares (batch, 4).

        A layer is linear in its weights, so that blending what the four sets say is blending the
        sets, and costs no set of weights for each row.
        """
        each = x @ self.weight.flatten(0, 1).mT + self.bias.flatten()
        return (each.unflatten(-1, (CONTROLS, -1)) * some[..., None]).sum(-2)


class Pfnn(nn.Module):
    """Three layers, ELU between them, their weights a function of the phase.

    Why a phase? Where the feet are in their stride decides what may come next. A network that has to
    find this out mixes the moments up, and the mean of a left and a right step is a foot that
    slides. Here moments far apart in the stride do not share their weights at all.

    Parameters
    ----------
    layout : what inputs and outputs mean.
    width : units of the two hidden layers, 512 in the paper.
    drop : share of inputs of each layer that are dropped in training, 0.3 in the paper.
    sparsity : what the mean size of weights costs in training, 0.01 in the paper.
    seen, said : Normalizers of inputs and outputs; None: to be filled by `load_state_dict`.

    Raises
    ------
    ModelError : a width that is no whole number from 1, or a share outside of [0, 1).
    """

    def __init__(
        self,
        layout: Layout,
        width: int = 512,
        drop: float = 0.3,
        sparsity: float = 0.01,
        seen: Normalizer | None = None,
        said: Normalizer | None = None,
    ) -> None:
        super().__init__()
        if not isinstance(width, Integral) or width < 1:
            raise ModelError(f"Pfnn: width is {width!r}; it must be a whole number from 1.")
        if not 0 <= drop < 1:
            raise ModelError(f"Pfnn: drop is {drop!r}; it must be a share, from 0 to below 1.")
        if not 0 <= sparsity < math.inf:
            raise ModelError(f"Pfnn: sparsity is {sparsity!r}; it must be a number from 0.")
        self.layout, self.width, self.drop, self.sparsity = layout, width, drop, sparsity
        self.seen, self.said = _normalizer(layout.seen, seen), _normalizer(layout.said, said)
        sizes = len(self.seen.mean), width, width, len(self.said.mean)
        pairs = zip(sizes[:-1], sizes[1:], strict=True)
        self.layers = nn.ModuleList(PhaseLinear(*pair) for pair in pairs)

    def forward(self, seen: Tensor, phase: Tensor) -> Tensor:
        """What the network says (batch, outputs) of what it sees (batch, inputs); raw units.

        phase : (batch,) radians.
        """
        return self.said.inverse(self.answer(self.seen(seen), phase))

    def answer(self, x: Tensor, phase: Tensor, lots: Tensor | None = None) -> Tensor:
        """The same in normalised units.

        lots : (batch, seen + 2 width) from 0 to 1, one for each input of a layer; those below `drop`
            are dropped, and what is left is louder by as much. None: nothing is dropped.
        """
        some = shares(phase)
        sizes = [layer.weight.shape[-1] for layer in self.layers]
        drawn = [None] * len(sizes) if lots is None else lots.split(sizes, dim=-1)
        for number, (layer, lot) in enumerate(zip(self.layers, drawn, strict=True)):
            x = elu(x) if number else x
            x = x if lot is None else x * (lot >= self.drop) / (1 - self.drop)
            x = layer(x, some)
        return x

    def loss(self, rows: Tensor, lots: Tensor | None = None) -> Tensor:
        """Mean squared error of what the network says, in normalised units.

        In training, with lots, inputs are dropped and the mean size of the weights is added,
        `sparsity` times.

        Parameters
        ----------
        rows : (batch, 1, 1 + seen + said), windows of one row as `examples` gives them.
        lots : (batch, 1, 1 + seen + said + 2 width) from 0 to 1, for each number of a row, of which
            those that are seen count, and for each hidden unit.
        """
        sizes = [1, len(self.seen.mean), len(self.said.mean)]
        phase, seen, said = rows[:, 0].split(sizes, dim=-1)
        if lots is not None:
            _, first, _, others = lots[:, 0].split([*sizes, 2 * self.width], dim=-1)
            lots = torch.cat([first, others], dim=-1)
        found = self.answer(self.seen(seen), phase[:, 0], lots)
        error = (found - self.said(said)).square().mean()
        if lots is None:
            return error
        weights = torch.stack([layer.weight.abs().mean() for layer in self.layers]).mean()
        return error + self.sparsity * weights

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        its = self.layout
        sizes = {
            name: getattr(its, name) for name in ("fps", "reach", "stride", "gaits", "grounds")
        }
        body = skeleton_config(its.skeleton)
        numbers = {name: getattr(self, name) for name in ("width", "drop", "sparsity")}
        return {"layout": {"skeleton": body, **sizes}, **numbers}

    @classmethod
    def from_config(cls, config: dict) -> Self:
        """A network of the right shapes, to be filled by `load_state_dict`."""
        skeleton = Skeleton(**config["layout"]["skeleton"])
        layout = Layout(**{**config["layout"], "skeleton": skeleton})
        return cls(layout, config["width"], config["drop"], config["sparsity"])


def _normalizer(parts: dict[str, tuple[int, ...]], given: Normalizer | None) -> Normalizer:
    """The normaliser, one that does nothing if None; ModelError if it is for something else."""
    numbers = size(parts)
    given = given or Normalizer(numbers)
    if len(given.kept) != numbers:
        raise ModelError(
            f"A normalizer is for {len(given.kept)} numbers, the layout has {numbers}."
        )
    return given
