"""The LSTM-GMM: sampling against a plain loop, and a training step against its matrix products.

    python benchmarks/bench_lstm_gmm.py [--rounds 7] [--threads 1] [--save]

The loop is what one writes first: FC - FC - LSTMCell - LSTMCell - FC, a draw, and again. One
character waits for memory, of which "half" reads half as much and "int8" a quarter; 256 wait for
multiplications, which "int8" does with smaller numbers. How fast sampling in whole float32 could be at best is told by the
row "bare products": matrix products of the same sizes and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table
from torch import Tensor, nn

from motionlab import Skeleton
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm
from motionlab.models.sampler import can_round

LIMIT = 1.7
FRAMES = {1: 300, 256: 40}  # characters: frames
CLIPS, WINDOW = 32, 64


@dataclass
class Options:
    rounds: int = 7
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    model = LstmGmm(encoding, Normalizer(encoding.dim), skip=0.9)
    numbers = {"threads": options.threads, "width": model.width, "limit": LIMIT}
    for characters in FRAMES:
        numbers[f"characters_{characters}"] = sampling(model, characters, options.rounds)
    numbers["training_step"] = training(model, options.rounds)
    if options.save:
        save("bench_lstm_gmm", numbers)


# -- sampling -------------------------------------------------------------------------------------


@torch.no_grad()
def sampling(model: LstmGmm, characters: int, rounds: int) -> dict:
    n, loop, start = FRAMES[characters], Loop(model), model.zero_state(characters)
    jobs: dict[str, Callable] = {
        "plain loop": lambda: loop(n, characters),
        "bare products": lambda: bare(model, n, characters),
        "generate": lambda: model.generate(n, start),
    }
    best = "generate"
    if can_round(start.hidden):
        best = "int8"
        for name in ("half", "int8") if characters == 1 else ("int8",):
            jobs[name] = lambda name=name: model.generate(n, start, precision=name)
    seconds = medians(jobs, rounds)
    ratios = {name: seconds["plain loop"] / value for name, value in seconds.items()}
    rows = [
        (name, f"{n * characters / value:,.0f} /s", f"{ratios[name]:.2f} x")
        for name, value in seconds.items()
    ]
    holds = "holds" if ratios[best] >= LIMIT else "MISSED"
    rows.append((f"{best}, at least {LIMIT} x the loop", f"{ratios[best]:.2f} x", holds))
    table(f"characters: {characters}, {n} frames each, medians of {rounds} rounds", rows)
    rates = {name: n * characters / value for name, value in seconds.items()}
    return {"frames_per_second": rates, "ratios": ratios, "best": best, "ratio": ratios[best]}


class Loop:
    """The network as one writes it first; its weights are of no consequence here."""

    def __init__(self, model: LstmGmm) -> None:
        self.kept, self.components, self.width = model.kept, model.components, model.width
        self.enter, self.leave, self.floor = model.enter, model.leave, model.floor
        self.cells = nn.ModuleList(nn.LSTMCell(self.width, self.width) for _ in range(2))

    def __call__(self, n: int, characters: int) -> Tensor:
        x = torch.zeros(characters, self.kept)
        states = [(torch.zeros(characters, self.width),) * 2 for _ in self.cells]
        frames = []
        for _ in range(n):
            out = self.enter(x)
            for i, cell in enumerate(self.cells):
                states[i] = cell(out, states[i])
                out = states[i][0]
            weights, gaussians = self.leave(out).tensor_split([self.components], 1)
            means, log_stds = gaussians.unflatten(1, (2, self.components, self.kept)).unbind(1)
            chosen = torch.multinomial(weights.softmax(1), 1)[..., None].expand(-1, 1, self.kept)
            mean, log_std = means.gather(1, chosen)[:, 0], log_stds.gather(1, chosen)[:, 0]
            x = mean + (log_std.exp() + self.floor) * torch.randn_like(mean)
            frames.append(x)
        return torch.stack(frames, 1)


def bare(model: LstmGmm, n: int, characters: int) -> None:
    """The products of n frames, an LSTM layer's in one."""
    width, layers = model.width, [model.enter[0], model.enter[2], model.leave]
    inputs = [torch.ones(characters, layer.in_features) for layer in layers]
    both, gates = torch.ones(characters, 2 * width), torch.cat([model.lstm.weight_ih_l0] * 2, 1)
    other = gates.clone()  # two layers, and so twice the memory
    for _ in range(n):
        for layer, x in zip(layers, inputs, strict=True):
            layer(x)
        both @ gates.T
        both @ other.T


# -- training -------------------------------------------------------------------------------------


def training(model: LstmGmm, rounds: int) -> dict:
    features = torch.randn(CLIPS, WINDOW, model.encoding.dim)
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-5)

    def step() -> None:
        optimizer.zero_grad()
        model.loss(features).backward()
        optimizer.step()

    seconds = medians({"step": step, "bare products": lambda: products_of_a_step(model)}, rounds)
    ratio = seconds["step"] / seconds["bare products"]
    rows = [(name, f"{1e3 * value:.0f} ms", "") for name, value in seconds.items()]
    table(f"training, {CLIPS} x {WINDOW} frames", [*rows, ("ratio", f"{ratio:.2f} x", "")])
    return {"seconds": seconds, "ratio": ratio}


@torch.no_grad()
def products_of_a_step(model: LstmGmm) -> None:
    """Forward: y = x W. Backward, from the gradient of y: those of x and of W.

    All frames at once, but for the LSTM's products with h, which wait for the frame before.
    """
    frames, width = WINDOW - 1, model.width
    rows = CLIPS * frames
    for layer in (model.enter[0], model.enter[2], model.leave):
        three_products(torch.ones(rows, layer.in_features), layer.weight)
    for i in range(model.lstm.num_layers):
        of_input, of_hidden = model.lstm.all_weights[i][:2]
        three_products(torch.ones(rows, width), of_input)
        h, slope = torch.ones(CLIPS, width), torch.ones(CLIPS, 4 * width)
        for _ in range(frames):
            h @ of_hidden.T
            slope @ of_hidden
        torch.ones(4 * width, rows) @ torch.ones(rows, width)


def three_products(x: Tensor, weight: Tensor) -> None:
    y = x @ weight.T
    y @ weight
    y.T @ x


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
