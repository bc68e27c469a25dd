"""`LstmGmm.generate` unrolled for one character or a few, in numpy; for more, see sampler.py.

The same network and the same chance, from the same generator. A frame of one character is sixty things
to calculate, all but the matrix products next to nothing, and torch takes some microseconds to begin
with any of them, numpy a fraction. What is left is the time in which the weights are read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

if TYPE_CHECKING:
    from .lstm_gmm import LstmGmm
    from .sampler import Chance
    from .state import State

Product = Callable[[np.ndarray], np.ndarray]  # (batch, in) -> (batch, out)
BLOCK = 32  # numbers that a product of whole weights takes at a time
SMALL = 200_000  # weights; fewer are read in less time than torch takes to round what they meet
_HALF = np.array([0.5], np.float32)  # as an array: of a number numpy asks each time what it is


_BENT = {
    "none": lambda values: values,
    "relu": lambda values: np.maximum(values, 0, out=values),
    "tanh": lambda values: np.tanh(values, out=values),
}


def whole(weight: Tensor, bias: Tensor, bend: str = "none") -> Product:
    """A product with weights in full; they lie in memory as it reads them."""
    across, bias = weight.detach().T.contiguous().numpy(), bias.detach().numpy()
    bent = _BENT[bend]
    return lambda inputs: bent(inputs @ across + bias)


def half(weight: Tensor, bias: Tensor, bend: str = "none") -> Product:
    """A product with weights in half precision; small ones stay in full, which is faster."""
    if weight.numel() < SMALL:
        return whole(weight, bias, bend)
    packed, bent = torch.ops.quantized.linear_prepack_fp16(weight, bias), _BENT[bend]
    linear = torch.ops.quantized.linear_dynamic_fp16
    return lambda inputs: bent(linear(torch.from_numpy(inputs), packed).numpy())


def int8(weight: Tensor, bias: Tensor, bend: str = "none") -> Product:
    """A product with weights as whole numbers; small ones stay in full, which is faster.

    Inputs and sums are bfloat16, eight bits each: there is nothing to choose by the batch.
    """
    if weight.numel() < SMALL:
        return whole(weight, bias, bend)
    steps, scale = in_steps(weight)
    rows, columns = steps.shape
    beyond = -columns % BLOCK  # the product reads on to the end of a block
    steps = functional.pad(steps, (0, beyond, 0, -rows % BLOCK))
    ones = torch.ones(len(steps), dtype=torch.bfloat16)  # scales; ours have more digits
    scale, bias, bent = scale.numpy(), bias.detach().numpy(), _BENT[bend]

    def product(inputs: np.ndarray) -> np.ndarray:
        short = torch.from_numpy(inputs).bfloat16()
        if beyond:
            short = functional.pad(short, (0, beyond))
        sums = torch._weight_int8pack_mm(short, steps, ones).float().numpy()[:, :rows]
        sums *= scale
        sums += bias
        return bent(sums)

    return product


def in_steps(weight: Tensor) -> tuple[Tensor, Tensor]:
    """Weights (out, in) as whole numbers, each row in 255 steps, and the steps (out)."""
    low, high = weight.detach().aminmax(dim=1)
    scale = torch.maximum(high, -low).clamp(min=1e-12) / 127
    return (weight.detach() / scale[:, None]).round_().to(torch.int8), scale


def gates_in_order(rows: Tensor) -> Tensor:
    """Rows of an LSTM's weights, or its biases, as both samplers want them.

    torch's order is enter, keep, new, show. The three that are squashed by a sigmoid come first, halved:
    sigmoid(x) = (1 + tanh(x / 2)) / 2, and so one tanh does for all four.
    """
    enter, keep, new, show = rows.chunk(4)
    return torch.cat([enter / 2, keep / 2, show / 2, new])


class Few:
    """Characters who are drawn frame by frame.

    Parameters
    ----------
    model, products : the network, and its five products.
    seen : (batch, kept), the frame before, normalised.
    before : the state that is gone on from.
    chance : how frames are drawn.
    """

    def __init__(
        self,
        model: LstmGmm,
        products: list[Product],
        seen: Tensor,
        before: State,
        chance: Chance,
    ) -> None:
        *self.enter, self.leave = products
        self.parts = model.components, (len(seen), 2, model.components, model.kept)
        self.seen, self.noise, self.memory = seen.numpy(), before.noise.numpy(), chance.memory
        self.hidden, self.cell = (
            [*part.numpy().swapaxes(0, 1)] for part in (before.hidden, before.cell)
        )
        number = lambda value: np.array([value], self.seen.dtype)
        self.reach, self.skip = number(model.reach), number(model.skip)
        self.spread = number(chance.temperature * model.reach)
        self.own_floor = model.floor.numpy()
        self.floor = chance.temperature * self.own_floor
        self.share = number(chance.memory), number((1 - chance.memory**2) ** 0.5)
        self.sharpness = number(1 / chance.component_temperature)
        # what chance is drawn into, as a tensor and as an array
        self.generator = chance.generator
        self.waiting, self.fresh = seen.new_empty(len(seen), model.components), seen.clone()
        self.waits, self.white = self.waiting.numpy(), self.fresh.numpy()
        self.rows = np.arange(len(seen))

    def draw(self, push: np.ndarray | None = None) -> np.ndarray:
        """The next frame (batch, kept); push (batch, kept) is added to all means before."""
        self.said, self.before = self.leave(self.hidden[-1]), self.seen
        components, shape = self.parts
        chosen = self._choose(self.said[:, :components])
        gaussians = self.said[:, components:].reshape(shape)[
            self.rows, :, chosen
        ]  # (batch, 2, kept)
        std = np.exp(gaussians[:, 1]) * self.spread + self.floor
        self._next_noise()
        self.seen = self.reach * gaussians[:, 0] + self.skip * self.seen + std * self.noise
        if push is not None:
            self.seen += push
        return self.seen

    def calm(self, share: np.ndarray) -> None:
        """From now on each character (batch, 1) has a share of the temperature that was given."""
        self.spread, self.floor = self.spread * share, self.floor * share

    def _choose(self, log_weights: np.ndarray) -> np.ndarray:
        """One component each, as `sampler.choose` does it, by the logarithm of what that compares."""
        self.waiting.exponential_(generator=self.generator)
        return (log_weights * self.sharpness - np.log(self.waits)).argmax(1)

    def _next_noise(self) -> None:
        """What the next frame is drawn with, as `noise.noise_to_draw` has it."""
        self.fresh.normal_(generator=self.generator)
        if self.memory and self.noise.shape[1]:
            self.noise = self.share[0] * self.noise + self.share[1] * self.white
        else:
            self.noise = self.white.copy()

    def see(self, disturbance: np.ndarray | None = None) -> None:
        """The frame that was drawn last, disturbed or not, becomes part of the memory."""
        if disturbance is not None:
            self.seen = self.seen + disturbance
        first, second, *layers = self.enter
        out = second(first(self.seen))
        for i, gates in enumerate(layers):
            read = np.concatenate((out, self.hidden[i]), 1)
            out, self.cell[i] = _lstm(gates(read), self.cell[i])
            self.hidden[i] = out

    def keep(self, rows: np.ndarray) -> None:
        """Go on with some characters only; no more is drawn of them."""
        self.hidden, self.cell = (
            [part[rows] for part in parts] for parts in (self.hidden, self.cell)
        )
        self.noise, self.seen = self.noise[rows], self.seen[rows]

    def after(self) -> tuple[Tensor, ...]:
        """h and C (batch, layers, width), noise and seen (batch, kept), as they are now."""
        parts = np.stack(self.hidden, 1), np.stack(self.cell, 1), self.noise, self.seen
        return tuple(map(torch.from_numpy, parts))


def _lstm(gates: np.ndarray, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """New h and C (batch, width) of a layer from its `gates_in_order` (batch, 4 width), bent by tanh."""
    width = cell.shape[1]
    squashed, new = gates[:, : 3 * width], gates[:, 3 * width :]
    squashed *= _HALF
    squashed += _HALF
    enter, keep, show = (squashed[:, i * width : (i + 1) * width] for i in range(3))
    enter *= new
    cell = keep * cell
    cell += enter
    return show * np.tanh(cell), cell
