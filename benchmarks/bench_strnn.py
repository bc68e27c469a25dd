"""STRNN's Temporal network: an update, and frames in open loop, against loops of single cells.

    python benchmarks/bench_strnn.py [--rounds 3] [--threads 1] [--width 192] [--save]

The loops are the same network, with the same weights, as one would write it down: an LSTM cell, frame
after frame, whose output is heard in the next one, in float32, under autograd where it learns. That
they say the same is checked first. Seconds are the processor's.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table
from torch import Tensor

from motionlab import Skeleton
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.models import Strnn

UPDATE, MANY = 2.0, 8.0  # times the loop's speed
BATCH, CHARACTERS, FRAMES = 32, 256, 200


@dataclass
class Options:
    rounds: int = 3
    threads: int = 1
    width: int = 192
    save: bool = False


class Loop:
    """The network of some weights, cell after cell."""

    def __init__(self, model: Strnn) -> None:
        self.model = model
        self.nothing = torch.zeros(4 * model.width)

    def said(self, seen: Tensor, decoded: bool = True) -> Tensor:
        """Normalised frames (batch, frames, kept) of seen (batch, encode, kept), by time."""
        model, encoder = self.model, self.model.encoder
        weights = [getattr(encoder, f"{what}_l0")
                   for what in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")]  # fmt: skip
        state = (seen.new_zeros(len(seen), model.width),) * 2
        for frame in seen.unbind(1):
            state = torch.lstm_cell(frame, state, *weights)
        ahead = self._on(model.predictor, state, model.predict)
        if not decoded:
            return torch.stack(ahead, 1)
        back = self._on(model.decoder, state, model.encode)
        return torch.stack([*back[::-1], *ahead], 1)

    def _on(self, part, state: tuple[Tensor, Tensor], n: int) -> list[Tensor]:
        frames, heard = [], self.model.leave(state[0])
        for _ in range(n):
            state = torch.lstm_cell(heard, state, part.heard.weight, part.own.weight,
                                    part.heard.bias, self.nothing)  # fmt: skip
            heard = self.model.leave(state[0])
            frames.append(heard)
        return frames

    def loss(self, features: Tensor) -> Tensor:
        true, encode = self.model.normalizer(features), self.model.encode
        off = (self.said(true[:, :encode]) - true).square()
        return off[:, :encode].mean() + off[:, encode:].mean()

    def extrapolate(self, features: Tensor, n: int) -> Tensor:
        seen, made = self.model.normalizer(features), []
        for _ in range(-(-n // self.model.predict)):
            made.append(self.said(seen, decoded=False))
            seen = torch.cat([seen, made[-1]], 1)[:, -self.model.encode :]
        return self.model.normalizer.inverse(torch.cat(made, 1)[:, :n])


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    encoding = BodyFrame(Skeleton.canonical(), 30.0)
    model = Strnn(encoding, Normalizer(encoding.dim), options.width, spatial=False, residual=False)
    loop = Loop(model)
    windows = torch.randn(CHARACTERS, model.frames, encoding.dim)
    torch.testing.assert_close(model.loss(windows), loop.loss(windows))
    with torch.no_grad():
        seen = windows[:2, : model.encode]
        torch.testing.assert_close(
            model.extrapolate(seen, 50), loop.extrapolate(seen, 50), rtol=1e-3, atol=1e-4
        )
    numbers = {
        "threads": options.threads, "width": options.width,
        "limits": {"update": UPDATE, f"{CHARACTERS} characters": MANY},
        "update": update(model, loop, windows[:BATCH], options.rounds),
        "open_loop": open_loop(model, loop, windows[:, : model.encode], options.rounds),
    }  # fmt: skip
    if options.save:
        save("bench_strnn", numbers)


def update(model: Strnn, loop: Loop, windows: Tensor, rounds: int) -> dict:
    """Loss, gradient and step of a batch."""
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-6)

    def step(loss) -> None:
        optimizer.zero_grad()
        loss(windows).backward()
        optimizer.step()

    seconds = medians(
        {"loop": lambda: step(loop.loss), "ours": lambda: step(model.loss)},
        rounds,
        time.process_time,
    )
    ratio = seconds["loop"] / seconds["ours"]
    rows = [(name, f"{1e3 * its:.1f} ms", f"{seconds['loop'] / its:.2f} x")
            for name, its in seconds.items()]  # fmt: skip
    rows.append(
        (f"at least {UPDATE:g} x", f"{ratio:.2f} x", "holds" if ratio >= UPDATE else "MISSED")
    )
    table(f"update, {len(windows)} windows, width {model.width}", rows)
    return {"seconds": seconds, "ratio": ratio}


@torch.no_grad()
def open_loop(model: Strnn, loop: Loop, seen: Tensor, rounds: int) -> dict:
    """Frames a second of one character, and of many at once, against a loop of one."""
    jobs = {
        "loop, one character": lambda: loop.extrapolate(seen[:1], FRAMES),
        "ours, one character": lambda: model.extrapolate(seen[:1], FRAMES),
        f"ours, {len(seen)} characters": lambda: model.extrapolate(seen, FRAMES),
        f"loop, {len(seen)} characters": lambda: loop.extrapolate(seen, FRAMES),
    }
    many = dict.fromkeys(jobs, 1) | {name: len(seen) for name in jobs if str(len(seen)) in name}
    rates = {n: many[n] * FRAMES / s for n, s in medians(jobs, rounds, time.process_time).items()}
    first = rates["loop, one character"]
    ratios = {name: rate / first for name, rate in rates.items()}
    best = ratios[f"ours, {len(seen)} characters"]
    rows = [(n, f"{rate:,.0f} /s", f"{ratios[n]:.1f} x") for n, rate in rates.items()]
    rows.append((f"at least {MANY:g} x", f"{best:.1f} x", "holds" if best >= MANY else "MISSED"))
    table(f"open loop, {FRAMES} frames, width {model.width}, frames a second", rows)
    return {"frames_per_second": rates, "ratios": ratios}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
