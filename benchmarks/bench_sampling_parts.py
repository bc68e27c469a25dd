"""What was tried to draw frames of 256 characters faster, part by part, each beside the plain way.

    python benchmarks/bench_sampling_parts.py [--rounds 25] [--threads 1] [--save]

* An LSTM cell after its product: step by step as it is written in books, and in fewer walks through
  memory (`models/sampler.py`).
* Product and cell: of all characters, and of 64 at a time, whose numbers stay near the processor.
* What a layer reads, rounded to a byte: by the largest number of the batch, and in steps that are known
  beforehand, since what an LSTM says lies between -1 and 1.

With them, how much of a frame the products take that no way can do without. Width 512, "int8".
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
import tyro
from bench_sampling import CHARACTERS, OF_MANY, many_characters, model_of
from interleaved import medians, save, table
from torch import Tensor

from motionlab.models.sampler import _int8, _lstm
from motionlab.models.sampler_few import gates_in_order

WIDTH, BLOCK = 512, 64


@dataclass
class Options:
    rounds: int = 25
    threads: int = 1
    save: bool = False


@torch.no_grad()
def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    clock = time.perf_counter if options.threads > 1 else time.process_time
    pairs = {"cell": cells(), "product and cell": blocks(), "rounding": roundings()}
    jobs = {f"{name}, {way}": job for name, its in pairs.items() for way, job in its.items()}
    frames = many_characters(WIDTH)["many, int8"]
    seconds = medians(jobs | {"products": products(), "frames": frames}, options.rounds, clock)
    found = {
        f"{name}: new / plain": seconds[f"{name}, new"] / seconds[f"{name}, plain"]
        for name in pairs
    }
    found["products / a frame"] = OF_MANY * seconds["products"] / seconds["frames"]
    table(
        f"{CHARACTERS} characters, width {WIDTH}; threads: {options.threads}",
        [(name, f"{1e3 * value:.2f} ms", "") for name, value in seconds.items()]
        + [(name, f"{value:.3g}", "") for name, value in found.items()],
    )
    if options.save:
        save("bench_sampling_parts", {"threads": options.threads, "seconds": seconds, **found})


def layer() -> tuple[Callable[[Tensor], Tensor], Tensor, Tensor]:
    """The product of a layer's gates, what it reads (batch, 2 width) and its cell (batch, width)."""
    of_input, of_hidden, bias, _ = model_of(WIDTH).lstm.all_weights[1]
    weight = gates_in_order(torch.cat([of_input, of_hidden], 1))
    read, cell = torch.randn(CHARACTERS, 2 * WIDTH).tanh(), torch.randn(CHARACTERS, WIDTH)
    return _int8(weight, gates_in_order(bias), "tanh"), read, cell


def cells() -> dict[str, Callable]:
    product, read, cell = layer()
    gates = product(read)
    return {"plain": lambda: step_by_step(gates, cell), "new": lambda: _lstm(gates, cell)}


def step_by_step(gates: Tensor, cell: Tensor) -> tuple[Tensor, Tensor]:
    """h and C from gates that went through a tanh: sigmoid(2x) = (tanh(x) + 1) / 2."""
    width = cell.shape[1]
    enter, keep, show = (gates[:, : 3 * width] + 1).mul_(0.5).chunk(3, 1)
    cell = keep * cell + enter * gates[:, 3 * width :]
    return show * cell.tanh(), cell


def blocks() -> dict[str, Callable]:
    product, read, cell = layer()

    def in_blocks() -> None:
        for some, its in zip(read.split(BLOCK), cell.split(BLOCK), strict=True):
            _lstm(product(some), its)

    return {"plain": lambda: _lstm(product(read), cell), "new": in_blocks}


def roundings() -> dict[str, Callable]:
    out, hidden = torch.randn(2, CHARACTERS, WIDTH).tanh()

    def by_largest() -> Tensor:
        read = torch.cat([out, hidden], 1)
        low, high = (edge.item() for edge in read.aminmax())
        return torch.add(-low, read, alpha=127 / (high - low)).to(torch.int8)

    def known() -> Tensor:
        return torch.cat([(127 * part).to(torch.int8) for part in (out, hidden)], 1)

    return {"plain": by_largest, "new": known}


def products() -> Callable:
    """The bare products of a frame: no input rounded, no sum bent."""
    model = model_of(WIDTH)
    weights = [model.enter[0].weight, model.enter[2].weight, model.leave.weight]
    weights += [torch.cat(both[:2], 1) for both in model.lstm.all_weights]
    made = []
    for weight in weights:
        packed = torch.ops.onednn.qlinear_prepack((100 * weight).to(torch.int8), None)
        steps = torch.randint(0, 127, (CHARACTERS, weight.shape[1]), dtype=torch.uint8)
        made.append((steps, packed, torch.ones(len(weight)), weight.new_zeros(len(weight)).int()))

    def all_of_them() -> None:
        for steps, packed, scale, zeros in made:
            torch.ops.onednn.qlinear_pointwise(
                steps, 1.0, 0, packed, scale, zeros, None, 1.0, 0, torch.float32, "none", [], ""
            )

    return all_of_them


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
