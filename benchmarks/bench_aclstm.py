"""acLSTM at the paper's size: a training step against the published loop, and one dancer's frames.

    python benchmarks/bench_aclstm.py [--rounds 3] [--threads 1] [--device cpu] [--no-bfloat16] [--save]

The loop is the published one: `LSTMCell` after `LSTMCell`, frame after frame, in float32, under
autograd; `motionlab.models.unrolled` computes the same loss and gradient (tests/models). bfloat16
needs a processor, or a GPU, that multiplies in it: elsewhere it is emulated, and a step takes minutes.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table
from torch import Tensor, nn

from motionlab import Skeleton
from motionlab.encodings import Normalizer, RootRelative
from motionlab.models import AcLstm, auto_condition

LIMIT, PACE = 3.0, 60  # times the loop's speed; frames a second, the paper's
BATCH, FRAMES, CHANNELS = 32, 100, 171


@dataclass
class Options:
    rounds: int = 3
    threads: int = 1
    width: int = 1024
    device: str = "cpu"
    bfloat16: bool = True
    save: bool = False


class Loop(nn.Module):
    """The published network and its loss, as they are written there."""

    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        sizes = [channels, width, width]
        self.cells = nn.ModuleList(nn.LSTMCell(size, width) for size in sizes)
        self.leave = nn.Linear(width, channels)
        self.width = width

    def loss(self, windows: Tensor, real: Tensor) -> Tensor:
        states = [(windows.new_zeros(len(windows), self.width),) * 2 for _ in self.cells]
        said, outputs = windows[:, 0], []
        for t in range(windows.shape[1] - 1):
            below = windows[:, t] if real[t] else said
            for i, cell in enumerate(self.cells):
                states[i] = cell(below, states[i])
                below = states[i][0]
            said = self.leave(below)
            outputs.append(said)
        return (torch.stack(outputs, 1) - windows[:, 1:]).square().mean()


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    points = CHANNELS // 3  # a chain of joints does: nothing is decoded here
    chain = Skeleton([f"joint {i}" for i in range(points)], range(-1, points - 1),
                     torch.ones(points, 3))  # fmt: skip
    encoding = RootRelative(chain)
    model = AcLstm(encoding, Normalizer(CHANNELS), options.width).to(options.device)
    numbers = {
        "threads": options.threads,
        "device": options.device,
        "width": options.width,
        "limit": LIMIT,
        "training_step": training(model, options),
        "generation": generation(model, options.rounds),
    }
    if options.save:
        save("bench_aclstm", numbers)


def training(model: AcLstm, options: Options) -> dict:
    loop = Loop(CHANNELS, model.width).to(options.device)
    windows = torch.randn(BATCH, FRAMES, CHANNELS, device=options.device)
    real = auto_condition(FRAMES, 5, 5)
    loop_optimizer = torch.optim.Adam(loop.parameters(), lr=1e-4)
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-4)

    def step(loss, its) -> None:
        its.zero_grad()
        loss().backward()
        its.step()
        if options.device != "cpu":
            torch.cuda.synchronize()

    def half() -> Tensor:
        with torch.autocast(options.device, torch.bfloat16):
            return model.loss(windows, real=real)

    jobs = {
        "published loop, float32": lambda: step(lambda: loop.loss(windows, real), loop_optimizer),
        "ours, float32": lambda: step(lambda: model.loss(windows, real=real), optimizer),
        **({"ours, bfloat16": lambda: step(half, optimizer)} if options.bfloat16 else {}),
    }
    seconds = medians(jobs, options.rounds)
    first = next(iter(seconds.values()))
    ratios = {name: first / value for name, value in seconds.items()}
    best = max(ratios.values())
    rows = [(n, f"{1e3 * s:.0f} ms", f"{ratios[n]:.2f} x") for n, s in seconds.items()]
    rows.append((f"at least {LIMIT:g} x", f"{best:.2f} x", "holds" if best >= LIMIT else "MISSED"))
    table(f"training step, {BATCH} x {FRAMES} frames, 3 x {model.width}", rows)
    return {"seconds": seconds, "ratios": ratios}


@torch.no_grad()
def generation(model: AcLstm, rounds: int) -> dict:
    start, n = model.zero_state(1), 100
    kinds = ("full", "half") if model.normalizer.mean.device.type == "cpu" else ("full",)
    jobs = {kind: lambda kind=kind: model.generate(n, start, precision=kind) for kind in kinds}
    rates = {kind: n / seconds for kind, seconds in medians(jobs, rounds).items()}
    rows = [
        (kind, f"{rate:,.0f} /s", f"{rate / PACE:.1f} x {PACE}") for kind, rate in rates.items()
    ]
    table(f"one dancer, 3 x {model.width}, frames a second", rows)
    return {"frames_per_second": rates}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
