"""A training update of the LSTM-GMM at the preset "ship", against an older build and bare products.

    python benchmarks/bench_training.py [--data locomotion] [--updates 200] [--threads 1] [--save]
        [--against FOLDER]

An update draws windows and noise, finds the loss and its slope, shortens the slope and takes a step;
a validation belongs to every 200 of them. FOLDER holds an older build of motionlab, which makes the
same updates from the same seed, a slice of them by turns with ours. The bare products are the matrix
products that no network of this size can do without, in float32 (see bench_lstm_gmm.py). Seconds
are those of processors, of the clock if there are more threads. With it: where ours takes its time,
and how far the losses of both builds lie apart, as a share of what they are and in nats.

A seed draws the windows of a build without `run_on`: runs that go on are made beforehand and once.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import torch
import tyro
from bench_lstm_gmm import products_of_a_step
from interleaved import OtherBuild, answer, medians, save, table, verdict

from motionlab.training.loop import OPTIMIZERS, draw
from motionlab.training.prepared import Prepared
from motionlab.training.presets import PRESETS, build

NAME, SLICE = "lstm-gmm-contacts", 10  # updates by turns
AS_SHIPPED = {"learning_rate": 4e-3, "decay": 6_000}  # an older build's preset has others
LIMITS = {"an update / the older build's": 0.6, "losses apart (share)": 1e-4}
PARTS = ("draw", "loss", "slope", "shorten", "step")


@dataclass
class Options:
    data: str = "locomotion"
    updates: int = 200
    threads: int = 1
    save: bool = False
    against: Path | None = None
    losses: Path | None = None  # where to write them, if asked to
    answer: bool = False  # to the process that asks for jobs on the standard input


class Training:
    """Updates one after the other, with their losses and the seconds of their parts."""

    def __init__(self, data: Prepared, clock: Callable[[], float]) -> None:
        preset = PRESETS[NAME]["ship"]
        same = AS_SHIPPED | {name: 0 for name in ("run_on", "runs") if hasattr(preset, name)}
        self.preset, self.clock = replace(preset, **same), clock
        self.windows = self.preset.windows(data, "train")
        self.tiles = self.preset.windows(data, "val").tiles(4 * preset.batch)
        self.model = build(data, self.preset)
        self.optimizer = OPTIMIZERS[preset.optimizer](
            self.model.parameters(), lr=preset.learning_rate
        )
        self.losses, self.parts = [], []

    def slice(self) -> None:
        for _ in range(SLICE):
            marks = [self.clock()]
            for _ in self.update():
                marks.append(self.clock())
            self.parts.append([b - a for a, b in zip(marks, marks[1:], strict=False)])

    def update(self) -> Iterator[None]:
        """An update, in as many pieces as it has parts."""
        number, weights = len(self.losses), [*self.model.parameters()]
        self.optimizer.param_groups[0]["lr"] = self.preset.rate(number)
        windows, extras = draw(self.windows, self.preset, number)
        yield
        loss = self.model.loss(windows, **extras)
        self.losses.append(loss.item())
        yield
        loss.backward()
        yield
        torch.nn.utils.clip_grad_norm_(weights, self.preset.clip)
        yield
        self.optimizer.step()
        self.optimizer.zero_grad()
        yield

    @torch.no_grad()
    def validate(self) -> None:
        for windows in self.tiles:
            self.model.loss(windows).item()


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    clock = time.perf_counter if options.threads > 1 else time.process_time
    ours = Training(Prepared.find(options.data), clock)
    if options.answer:
        tell = lambda: options.losses.write_text(json.dumps(ours.losses), encoding="utf-8")
        jobs = {"updates": ours.slice, "validation": ours.validate, "losses": tell}
        return answer(jobs, clock)
    with tempfile.TemporaryDirectory() as folder:
        seconds, found = timed(ours, Path(folder) / "losses.json", clock, options)
    found["bare products / an update"] = SLICE * seconds["bare products"] / seconds["updates"]
    each = zip(PARTS, zip(*ours.parts, strict=True), strict=True)
    show(seconds, {name: statistics.median(times) for name, times in each}, found, options)


def timed(
    ours: Training, file: Path, clock: Callable[[], float], options: Options
) -> tuple[dict[str, float], dict[str, float]]:
    """Seconds of all jobs, by turns with the older build's, and what they come to.

    file : where the older build is to write its losses.
    """
    often = {"updates": ours.slice, "bare products": lambda: products_of_a_step(ours.model)}
    seldom = {"validation": ours.validate}
    if options.against:
        told = [f"--data={options.data}", f"--threads={options.threads}", f"--losses={file}"]
        older = OtherBuild(options.against, told)
        often["older build: updates"] = older.job("updates")
        seldom["older build: validation"] = older.job("validation")
    rounds = max(1, options.updates // SLICE - 1)  # and one that does not count
    seconds = medians(often, rounds, clock) | medians(seldom, 3, clock)
    if not options.against:
        return seconds, {}
    older.job("losses")()
    older.close()
    theirs = torch.tensor(json.loads(file.read_text(encoding="utf-8")))
    return seconds, compared(seconds, torch.tensor(ours.losses), theirs)


def compared(
    seconds: dict[str, float], ours: torch.Tensor, theirs: torch.Tensor
) -> dict[str, float]:
    older, apart = "older build: ", (ours - theirs).abs()
    share = PRESETS[NAME]["ship"].validate_every / SLICE  # slices from one validation to the next
    whole = lambda whose: seconds[f"{whose}updates"] + seconds[f"{whose}validation"] / share
    return {
        "an update / the older build's": seconds["updates"] / seconds[f"{older}updates"],
        "with its share of a validation": whole("") / whole(older),
        "bare products / an older update": SLICE
        * seconds["bare products"]
        / seconds[f"{older}updates"],
        "losses apart (share)": float((apart / theirs.abs()).max()),
        "losses apart (nats)": float(apart.max()),
        "losses apart in the first ten updates (nats)": float(apart[:10].max()),
    }


def show(
    seconds: dict[str, float], parts: dict[str, float], found: dict[str, float], options: Options
) -> None:
    slices = [name for name in seconds if "updates" in name]
    table(
        f"{NAME}, an update; threads: {options.threads}",
        [(name, f"{1e3 * value / (SLICE if name in slices else 1):.1f} ms", "")
         for name, value in seconds.items()]
        + [(f"  of it: {name}", f"{1e3 * value:.1f} ms", "") for name, value in parts.items()]
        + [(name, f"{value:.3g}", verdict(value, LIMITS[name]) if name in LIMITS else "")
           for name, value in found.items()],
    )  # fmt: skip
    if options.save:
        save(
            "bench_training",
            {
                "threads": options.threads,
                "updates": options.updates,
                "limits": LIMITS,
                "seconds": seconds,
                "seconds of an update's parts": parts,
                **found,
            },
        )


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
