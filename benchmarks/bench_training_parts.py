"""What was tried to make a training update of the LSTM-GMM faster, part by part, each beside the plain way.

    python benchmarks/bench_training_parts.py [--rounds 9] [--threads 1] [--save]

* The recurrence with its slope: oneDNN's, which `torch.nn.LSTM` calls, and written out
  (`models/unrolled.py`).
* A product of matrices: in float32, and as the sum of three products of numbers that were split in two
  of 16 bits each, which some processors multiply much faster; and what each rounds off.
* The density of the mixture with its slope: of means and deviations, and straight from the numbers
  that the network answers with (`models/answers.py`).
* Adam's step: tensor by tensor, and in one walk.

Sizes are those of `lstm-gmm-contacts` at the preset "ship". Seconds are those of processors, of the
clock if there are more threads.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass

import torch
import tyro
from bench_lstm_gmm import CLIPS, WINDOW
from bench_sampling import model_of
from interleaved import medians, save, table
from torch import Tensor

from motionlab.models import LstmGmm
from motionlab.models.answers import log_density
from motionlab.models.unrolled import unroll

WIDTH, STEPS = 256, WINDOW - 1


@dataclass
class Options:
    rounds: int = 9
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    clock = time.perf_counter if options.threads > 1 else time.process_time
    model = model_of(WIDTH)
    (exact, rounded), products = three_for_one()
    pairs = {
        "recurrence": recurrences(model),
        "product": products,
        "density": densities(model),
        "step": steps(),
    }
    jobs = {f"{name}, {way}": job for name, its in pairs.items() for way, job in its.items()}
    seconds = medians(jobs, options.rounds, clock)
    found = {
        f"{name}: new / plain": seconds[f"{name}, new"] / seconds[f"{name}, plain"]
        for name in pairs
    }
    found["rounded off by a product: new / plain"] = rounded / exact
    table(
        f"{CLIPS} x {STEPS} frames, width {WIDTH}; threads: {options.threads}",
        [(name, f"{1e3 * value:.2f} ms", "") for name, value in seconds.items()]
        + [(name, f"{value:.3g}", "") for name, value in found.items()],
    )
    if options.save:
        save("bench_training_parts", {"threads": options.threads, "seconds": seconds, **found})


def recurrences(model: LstmGmm) -> dict[str, Callable]:
    """Both layers and the last one, forwards and back."""
    inputs = torch.randn(STEPS, CLIPS, WIDTH).requires_grad_()
    start = torch.zeros(2, 2, CLIPS, WIDTH)
    through = torch.nn.Linear(WIDTH, WIDTH)  # `unroll` feeds outputs back, so they are as wide
    gates = [
        (torch.cat([of_input, of_hidden], 1).detach().requires_grad_(), bias.detach())
        for of_input, of_hidden, bias, _ in model.lstm.all_weights
    ]

    def plain() -> None:
        hidden = model.lstm(inputs.transpose(0, 1), (start[0], start[1]))[0]
        through(hidden).sum().backward()

    def written_out() -> None:
        leave = through.weight, through.bias
        unroll(inputs, None, start[0], start[1], gates, leave)[0].sum().backward()

    return {"plain": plain, "new": written_out}


def three_for_one() -> tuple[tuple[float, float], dict[str, Callable]]:
    """What both ways round off, as a share, and both; all frames times the weights of all gates."""
    inputs, weights = torch.randn(STEPS * CLIPS, WIDTH), torch.randn(WIDTH, 4 * WIDTH)
    right = inputs.double() @ weights.double()
    high, low = split(weights)  # once an update, for all that they are multiplied by

    def three() -> Tensor:
        with products_of_16_bits():
            coarse, fine = split(inputs)
            return (coarse @ high).add_(coarse @ low).add_(fine @ high)

    jobs = {"plain": lambda: inputs @ weights, "new": three}
    off = lambda found: float((found - right).norm() / right.norm())
    return (off(jobs["plain"]()), off(three())), jobs


def split(numbers: Tensor) -> tuple[Tensor, Tensor]:
    """The part of numbers that 16 bits hold, and the rest."""
    coarse = numbers.bfloat16().float()
    return coarse, numbers - coarse


@contextmanager
def products_of_16_bits():
    matmul = torch.backends.mkldnn.matmul
    before, matmul.fp32_precision = matmul.fp32_precision, "bf16"
    try:
        yield
    finally:
        matmul.fp32_precision = before


def densities(model: LstmGmm) -> dict[str, Callable]:
    """From what the LSTM says to the slope in it; both with the last layer's products."""
    said = torch.randn(CLIPS, STEPS, WIDTH).requires_grad_()
    seen, ahead = torch.randn(2, CLIPS, STEPS, model.kept)

    def plain() -> None:
        model._mixture(said, seen).log_prob(ahead).mean().backward()

    def straight() -> None:
        values = ahead - model.skip * seen
        numbers = model._said(said)
        density = log_density(numbers, values, model.components, model.reach, model.floor)
        density.mean().backward()

    return {"plain": plain, "new": straight}


def steps() -> dict[str, Callable]:
    return {way: step(fused) for way, fused in (("plain", False), ("new", True))}


def step(fused: bool) -> Callable:
    weights = [*model_of(WIDTH).parameters()]
    for each in weights:
        each.grad = torch.randn_like(each)
    return torch.optim.Adam(weights, 1e-5, fused=fused).step


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
