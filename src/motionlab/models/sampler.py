"""`LstmGmm.generate` unrolled for speed, for when no gradient is asked for; a few characters in numpy.

The same network and the same chance as the loop in lstm_gmm.py. What is different: nothing
remembers how it was computed, features stay normalised from the first frame to the last, and each
LSTM layer multiplies once, [input, h] by [W_input, W_h].

How fast can it be? One character reads all weights for each frame: 19 MB at width 512. Hundreds
read them once for all and wait for the multiplications. Fewer bytes help the one, smaller numbers
the others: hence the roundings in `PRECISIONS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from ..errors import ModelError
from .noise import noise_to_draw, normal
from .sampler_few import Few, Product, gates_in_order, half, in_steps, int8, whole
from .state import State
from .unchanged import made_of

if TYPE_CHECKING:
    from .lstm_gmm import LstmGmm

FEW = 4  # characters for whom reading the weights takes longer than multiplying
FEW_IN_FULL = 16  # characters whom numpy serves faster than torch, with weights in full
Linear = Callable[[Tensor], Tensor]  # a product: (batch, in) -> (batch, out)
Memory = tuple[Tensor, Tensor, Tensor, Tensor]  # h, C, noise and seen after the last frame


class Chance(NamedTuple):
    """How frames are drawn; see `LstmGmm.generate`."""

    generator: torch.Generator | None = None
    temperature: float = 1.0
    component_temperature: float = 1.0
    noise: float = 0.0
    memory: float = 0.0


def choose(log_weights: Tensor, generator: torch.Generator | None) -> Tensor:
    """Index (...) of one of M components, drawn by weights (..., M) that may sum to anything.

    A clock for each, of exponential waiting time, that runs as fast as the component is likely: the
    first to ring wins. That is `torch.multinomial`, without its checks and its matrices only.
    """
    weights = log_weights.softmax(-1)
    waiting = torch.empty_like(weights).exponential_(generator=generator)
    return (weights / waiting).argmax(-1)


@torch.no_grad()
def unroll(
    model: LstmGmm, n: int, start: State, chance: Chance, precision: str, onward: bool
) -> tuple[Tensor, State]:
    """n frames (batch, n, dim) that go on from a state; see `LstmGmm.generate`.

    The state is that after the last of them if it is to go `onward`, or else the start.
    """
    if precision != "full" and not can_round(start.hidden):
        raise ModelError(
            f'generate: precision "{precision}" needs a float32 model on an x86 processor. '
            "Leave it out."
        )
    with torch.autocast(start.frame.device.type, enabled=False):
        most = FEW_IN_FULL if precision == "full" else FEW
        few = len(start.frame) <= most and _known_to_numpy(start.hidden)
        draw = _draw_few if few else _draw_many
        products = _products(model, precision, few)
        frames, memory = draw(model, products, n, start, chance, onward)
        after = model.normalizer.inverse(memory[-1])
    return model.normalizer.inverse(frames), State(after, *memory) if onward else start


def _draw_many(
    model: LstmGmm, products: list[Linear], n: int, start: State, chance: Chance, onward: bool
) -> tuple[Tensor, Memory]:
    """Frames (batch, n, kept), normalised."""
    generator, temperature, component_temperature, _, memory = chance
    *enter, leave = products
    seen, noise = _seen(model, start), start.noise  # (batch, kept)
    hidden, cell = ([*part.unbind(1)] for part in (start.hidden, start.cell))
    frames = seen.new_empty(len(seen), n, model.kept)
    rows = torch.arange(len(seen), device=seen.device)
    for t in range(n):
        weights, gaussians = leave(hidden[-1]).tensor_split([model.components], 1)
        chosen = choose(weights / component_temperature, generator)
        gaussians = gaussians.view(len(seen), 2, model.components, model.kept)
        mean, log_std = gaussians[rows, :, chosen].unbind(1)
        std = temperature * (model.reach * log_std.exp() + model.floor)
        noise = noise_to_draw(noise, std, memory, generator)
        frames[:, t] = seen = model.reach * mean + model.skip * seen + std * noise
        if t < n - 1 or onward:
            if chance.noise:
                seen = seen + _disturbance(model, start, chance)
            _see(enter, seen, hidden, cell)
    return frames, (torch.stack(hidden, 1), torch.stack(cell, 1), noise, seen)


def _draw_few(
    model: LstmGmm, products: list[Product], n: int, start: State, chance: Chance, onward: bool
) -> tuple[Tensor, Memory]:
    """The same in numpy, who knows of no gradients."""
    start = State(*(part.detach() for part in start))
    seen = _seen(model, start)
    few = Few(model, products, seen, start, chance)
    frames = seen.new_empty(len(seen), n, model.kept)
    rows = frames.numpy()
    with np.errstate(all="ignore"):  # as torch: who leaves all bounds is told by the numbers
        for t in range(n):
            rows[:, t] = few.draw()
            if t < n - 1 or onward:
                few.see(_disturbance(model, start, chance).numpy() if chance.noise else None)
    return frames, few.after()


@torch.no_grad()
def stepper(model: LstmGmm, start: State, chance: Chance) -> Few:
    """Characters (batch) who go on from a state, to be drawn frame by frame by whoever steers them.

    In numpy, at full precision; for models on the processor. Normalised units in and out.
    """
    start = State(*(part.detach() for part in start))
    return Few(model, _products(model, "full", True), _seen(model, start), start, chance)


def _disturbance(model: LstmGmm, start: State, chance: Chance) -> Tensor:
    """What is added to what the network sees (batch, kept): drawn for all of (batch, dim), as the loop's."""
    return chance.noise * normal(start.frame, chance.generator)[:, model.normalizer.kept]


def _known_to_numpy(tensor: Tensor) -> bool:
    return tensor.device.type == "cpu" and tensor.dtype in (torch.float32, torch.float64)


def _seen(model: LstmGmm, state: State) -> Tensor:
    """The frame (batch, kept) of a state, normalised.

    Raw units lose the last digit of what was drawn in normalised ones, and a motion that goes on
    from there becomes another one. So the state brings it along; it counts where it is the frame.
    """
    seen = model.normalizer(state.frame)
    if not state.seen.shape[-1]:
        return seen
    same = (model.normalizer.inverse(state.seen) == state.frame).all(-1, keepdim=True)
    return torch.where(same, state.seen, seen)


def _see(enter: list[Linear], seen: Tensor, hidden: list[Tensor], cell: list[Tensor]) -> None:
    """A frame more (batch, kept): h and C of the layers become those after it."""
    first, second, *layers = enter
    out = second(first(seen))
    for i, gates in enumerate(layers):
        out, cell[i] = _lstm(gates(torch.cat([out, hidden[i]], 1)), cell[i])
        hidden[i] = out


def _lstm(gates: Tensor, cell: Tensor) -> tuple[Tensor, Tensor]:
    """New h and C (batch, width) of a layer from its `gates_in_order` (batch, 4 width), bent by tanh."""
    enter, keep, show, new = gates.chunk(4, 1)  # half of each sigmoid's argument, bent by tanh
    cell = cell.addcmul(keep, cell).addcmul_(enter, new).add_(new).mul_(0.5)
    out = cell.tanh()
    return out.addcmul_(show, out).mul_(0.5), cell


def _products(model: LstmGmm, precision: str, few: bool) -> list[Linear] | list[Product]:
    """The network's five matrix products; those of the LSTM layers for all four gates at once.

    Rounding or turning weights takes as long as drawing some seconds of one character. So what was made
    of them is kept for as long as the model lives and its weights do not change.
    """
    make = (FOR_FEW if few else PRECISIONS)[precision]
    return made_of(model, f"{precision}, {make.__name__}", lambda: _made(model, make))


def _made(model: LstmGmm, make: Callable[..., Linear | Product]) -> list[Linear] | list[Product]:
    products = [make(model.enter[i].weight, model.enter[i].bias, "relu") for i in (0, 2)]
    for of_input, of_hidden, bias, bias_too in model.lstm.all_weights:
        weight = gates_in_order(torch.cat([of_input, of_hidden], 1))
        products.append(make(weight, gates_in_order(bias + bias_too), "tanh"))
    return [*products, make(model.leave.weight, model.leave.bias)]


# what a product's sums go through; with "int8" within the product itself, where it costs nothing
_BENT = {"none": lambda values: values, "relu": Tensor.relu_, "tanh": Tensor.tanh_}


def _full(weight: Tensor, bias: Tensor, bend: str = "none") -> Linear:
    return lambda inputs: _BENT[bend](functional.linear(inputs, weight, bias))


def _half(weight: Tensor, bias: Tensor, bend: str = "none") -> Linear:
    """Weights in half precision, which is half the memory to go through; sums in float32."""
    packed = torch.ops.quantized.linear_prepack_fp16(weight, bias)
    product = torch.ops.quantized.linear_dynamic_fp16
    return lambda inputs: _BENT[bend](product(inputs, packed))


def _int8(weight: Tensor, bias: Tensor, bend: str = "none") -> Linear:
    """Whole numbers: each row of weights in 255 steps, the inputs in 128.

    Not 256: older processors add products in pairs, in 16 bits, and 2 * 127 * 127 is what fits.
    The step of the inputs is chosen anew each time, by the largest and the smallest in the batch.
    """
    steps, scale = in_steps(weight)
    packed = torch.ops.onednn.qlinear_prepack(steps, None)
    zeros = torch.zeros(len(scale), dtype=torch.int32)

    def product(inputs: Tensor) -> Tensor:
        low, high = (edge.item() for edge in inputs.aminmax())
        if not math.isfinite(high - low):
            raise ModelError(
                "generate: a character has left all bounds, and in int8 they share their steps. "
                'Take precision "half", or a lower temperature.'
            )
        step = max(high - low, 1e-6) / 127
        zero = round(-low / step)
        middle = inputs.new_tensor(zero + 0.5)  # conversion cuts off what is behind the point
        # as int8, which holds them as well, and to which torch converts in a quarter of the time
        steps = torch.add(middle, inputs, alpha=1 / step).to(torch.int8).view(torch.uint8)
        return torch.ops.onednn.qlinear_pointwise(
            steps, step, zero, packed, scale, zeros, bias, 1.0, 0, torch.float32, bend, [], ""
        )

    return product


def can_round(tensor: Tensor) -> bool:
    """Whether torch has products with rounded weights for such a tensor on this machine."""
    engines = torch.backends.quantized.supported_engines
    on_x86 = "fbgemm" in engines and torch.backends.mkldnn.is_available()
    return on_x86 and tensor.device.type == "cpu" and tensor.dtype == torch.float32


PRECISIONS = {"full": _full, "half": _half, "int8": _int8}
FOR_FEW = {"full": whole, "half": half, "int8": int8}  # the same in numpy
