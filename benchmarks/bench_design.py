"""Motion along paths: against an eager loop over frames, and many paths against one.

    python benchmarks/bench_design.py [--paths 16] [--rounds 3] [--threads 1] [--save]

The loop is what one would write first: `torch.lstm_cell` frame after frame, the whole body's forward
kinematics, autograd, and torch's Adam on changes in units of their deviations, frame by frame, at the
best of a few rates. It goes on until its energy is as low as that of `window.solve`.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table, verdict
from torch import Tensor

import motionlab
from motionlab.models import LstmGmm, Mixture
from motionlab.paths import Curves, Path
from motionlab.solvers import window
from motionlab.solvers.design import design_all
from motionlab.solvers.energy import NOISE, Before, Energy
from motionlab.solvers.path_control import STEPS, WINDOW, Stretch, wishes

BATCH, PATIENCE = 14, 300  # windows side by side, steps of the loop at most
RATES = (0.1, 0.2, 0.4)
LIMITS = {
    "the loop to our value / ours": 5.0,
    "paths at once: throughput over one's": 4.0,
    "processor seconds a second of motion": 0.4,
}


@dataclass
class Options:
    paths: int = 16
    rounds: int = 3
    threads: int = 1
    save: bool = False


def circle(radius: float, metres: float) -> Path:
    angle = torch.linspace(0, metres / radius, 100)
    return Path.through(radius * torch.stack([1 - angle.cos(), angle.sin()], 1))


class Eager(Energy):
    """The same energy, frame after frame."""

    def mixture(self, features: Tensor, d: Tensor) -> Mixture:
        model, state = self.model, self.before.state
        said = [model.predict(state)]
        hidden, cell = ([*part.unbind(1)] for part in (state.hidden, state.cell))
        for t in range(features.shape[1] - 1):
            seen = model.normalizer(features[:, t] + d[:, t] * model.normalizer.std)
            out = model.enter(seen)
            for layer, weights in enumerate(model.lstm.all_weights):
                hidden[layer], cell[layer] = torch.lstm_cell(
                    out, (hidden[layer], cell[layer]), *weights
                )
                out = hidden[layer]
            said.append(model._mixture(out, seen))
        return Mixture(*(torch.stack(part, 1) for part in zip(*said, strict=True)))

    def decoded(self, features: Tensor, points=None) -> tuple[Tensor, Tensor, Tensor | None]:
        return super().decoded(features)


def problem(model: LstmGmm) -> tuple[Energy, Energy, Tensor, Tensor]:
    """Windows on bends to the left and right, and samples that do not know of them."""
    paths = [circle(side * (2 + i % 3), 6) for i in range(BATCH) for side in [(-1) ** i]]
    state = model.starts[[0] * BATCH]
    before = Before(state, state.frame, torch.zeros(BATCH, 3))
    chance = torch.Generator().manual_seed(0)
    with torch.no_grad():
        s = model.normalizer(model.generate(WINDOW, state, generator=chance, **model.sampling))
    which, zero = torch.arange(BATCH), torch.zeros(BATCH)
    piece = Curves(paths).piece(zero - 0.5, zero + 3.5, which)
    arcs = (1.2 / model.fps) * torch.arange(1, WINDOW + 1).expand(BATCH, -1)
    found = wishes(Stretch(model, piece, arcs, which, 0))
    d = s.new_zeros(BATCH, WINDOW, model.encoding.dim)
    return Energy(model, before, found), Eager(model, before, found), s, d


def usual_search(
    energy: Energy, s: Tensor, d: Tensor, value: float, steps: int, rate: float = RATES[0]
) -> int:
    """Steps of torch's Adam until the mean energy is as low as a value; at most so many."""
    with torch.no_grad():
        scale = window.spread(energy.mixture(energy.model.normalizer.inverse(s), d), s)
    free = [torch.zeros_like(part, requires_grad=True) for part in (s, d)]
    adam = torch.optim.Adam(free, lr=rate)
    least = torch.full((len(s),), math.inf)
    for step in range(1, steps + 1):
        adam.zero_grad()
        values = energy(s + scale * free[0], d + NOISE * free[1])
        least = torch.minimum(least, values.detach())
        if least.mean() <= value:
            return step
        values.sum().backward()
        adam.step()
    return steps


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    model = motionlab.load("lstm-gmm-contacts")
    ours, eager, s, d = problem(model)
    value = float(window.solve(ours, s, d, steps=STEPS).energy.mean())
    steps = PATIENCE
    for rate in RATES:
        steps = usual_search(ours, s, d, value, steps, rate)
    some = 10
    paths = [circle((-1) ** i * (2 + i % 3), 2.4) for i in range(options.paths)]
    seconds = medians(
        {
            "a window, ours": lambda: window.solve(ours, s, d, steps=some),
            "a window, the loop": lambda: usual_search(eager, s, d, -math.inf, some),
            "one path": lambda: design_all(paths[:1], model=model),
            "paths": lambda: design_all(paths, model=model),
        },
        options.rounds,
    )
    begin = time.process_time()
    made = design_all(paths[:BATCH], model=model)
    spent = time.process_time() - begin
    slope = seconds["a window, the loop"] / seconds["a window, ours"]
    found = {
        "the loop to our value / ours": slope * steps / STEPS,
        "a step of the loop / one of ours": slope,
        "steps of the loop": steps,
        "steps of ours": STEPS,
        "paths at once: throughput over one's": options.paths
        * seconds["one path"]
        / seconds["paths"],
        "processor seconds a second of motion": spent / sum(m.seconds for m, _ in made),
    }
    words = {name: f"{value:.2f}" for name, value in found.items()}
    first, second, third = LIMITS
    notes = {name: f"at least {LIMITS[name]:g}: {_holds(found[name] >= LIMITS[name])}"
             for name in (first, second)}  # fmt: skip
    notes[third] = verdict(found[third], LIMITS[third])
    if steps == PATIENCE:
        notes["steps of the loop"] = "gave up: it takes more than these"
    table(
        f"{BATCH} windows, {options.paths} paths of 2.4 m, {options.threads} threads",
        [(name, f"{1000 * value:.0f} ms", "") for name, value in seconds.items()]
        + [(name, words[name], notes.get(name, "")) for name in found],
    )
    if options.save:
        save("bench_design", {"limits": LIMITS, "seconds": seconds, **found})


def _holds(holds: bool) -> str:
    return "holds" if holds else "MISSED"


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
