"""What was tried to make the foot lock of a batch faster, part by part, each beside the plain way.

    python benchmarks/bench_foot_lock_parts.py [--clips 32] [--rounds 15] [--save]

* Gaps between contacts: by the distance to the marks on both sides, and by shifts of the marks.
* Places of toes: with the axes side by side in memory, and with the frames.
* Joints of all levels of the forward kinematics: put together, then into order; and both at once.
* Products of orientations in it: multiplied and summed up, and written out.
* The whole lock, eight clips at a time, whose numbers stay near the processor: beside all at once.

And what no lock can do without: legs set by forward kinematics, and the motion copied.
Seconds are those of processors, on one thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
import tyro
from bench_foot_lock import SECONDS
from interleaved import medians, save, table
from torch import Tensor

import motionlab
from motionlab.feet import lock as feet
from motionlab.feet import marks as marks_of
from motionlab.feet.legs import legs_alone
from motionlab.kinematics import _in_order, _product

AT_A_TIME = 8
GAP = 2  # frames


@dataclass
class Options:
    clips: int = 32
    rounds: int = 15
    save: bool = False


@torch.inference_mode()
def main(options: Options) -> None:
    torch.set_num_threads(1)
    model = motionlab.load("lstm-gmm-contacts")
    rows = torch.arange(options.clips) % len(model.starts.frame)
    chance = torch.Generator().manual_seed(0)
    features = model.generate(
        round(SECONDS * model.fps), model.starts[rows], generator=chance, **model.sampling
    )
    place, turns = model.encoding.rotations(features)
    down = model.encoding.contacts(features) > 0.5
    skeleton = model.encoding.skeleton

    def at_once(clips: int) -> None:
        for some in zip(*(all_.split(clips) for all_ in (place, turns, down)), strict=True):
            feet.lock(skeleton, *some, model.fps)

    pairs = {
        "gaps": gaps(down),
        "places": places(down),
        "order": order(place[..., 0].numel()),
        "product": products(place[..., 0].numel()),
        "eight at a time": {
            "plain": lambda: at_once(options.clips),
            "new": lambda: at_once(AT_A_TIME),
        },
    }
    jobs = {f"{name}, {way}": job for name, its in pairs.items() for way, job in its.items()}
    legs, kept = legs_alone(skeleton)
    jobs["legs set"] = lambda: feet._forward(legs, place, feet._picked(turns, kept))
    jobs["motion copied"] = lambda: turns.clone()
    seconds = medians(jobs, options.rounds, time.process_time)
    whole = seconds["eight at a time, plain"]
    found = {
        f"{name}: new / plain": seconds[f"{name}, new"] / seconds[f"{name}, plain"]
        for name in pairs
    }
    found["legs set and motion copied / the lock"] = (
        seconds["legs set"] + seconds["motion copied"]
    ) / whole
    table(
        f"{options.clips} clips of {SECONDS} s, one thread",
        [(name, f"{1e3 * value:.2f} ms", "") for name, value in seconds.items()]
        + [(name, f"{value:.3f}", "") for name, value in found.items()],
    )
    if options.save:
        save("bench_foot_lock_parts", {"clips": options.clips, "seconds": seconds, **found})


def gaps(marks: Tensor) -> dict[str, Callable]:
    def by_distances() -> Tensor:
        since, until = (marks_of.distance(marks, before) for before in (True, False))
        return marks | (since + until - 1 <= GAP)

    by_shifts = lambda: marks_of.closed(marks, GAP)
    assert (by_distances() == by_shifts()).all()
    return {"plain": by_distances, "new": by_shifts}


def places(held: Tensor) -> dict[str, Callable]:
    frames = held.shape[:-1]
    toes = torch.randn(3, 2, *frames).movedim((0, 1), (-1, -2))  # frames last, as they come
    ground = torch.zeros(*frames[:-1], 2)

    def axes_last() -> Tensor:
        number = marks_of.numbered(held)[..., None].expand_as(toes)
        none = toes.new_zeros(*frames[:-1], frames[-1] + 1, 2, 3)
        sums = none.scatter_add(-3, number, toes)
        found = sums / none.scatter_add(-3, number, torch.ones_like(toes)).clamp(min=1)
        found[..., 1] = ground[..., None, :]
        return (found.gather(-3, number) - toes) * held[..., None]

    frames_last = lambda: feet._onto_places(toes, held, ground)
    assert torch.equal(axes_last(), frames_last())
    return {"plain": axes_last, "new": frames_last}


def order(frames: int) -> dict[str, Callable]:
    levels = [torch.randn(2, 3, 3, frames) for _ in range(5)]
    wanted = [0, 2, 4, 6, 8, 1, 3, 5, 7, 9]  # one leg, then the other
    index = torch.tensor(wanted)
    return {"plain": lambda: torch.cat(levels)[index], "new": lambda: _in_order(levels, wanted)}


def products(frames: int) -> dict[str, Callable]:
    a, b = torch.randn(2, 2, 3, 3, frames)

    def written_out() -> Tensor:
        first, second, third = (a[:, :, i, None] * b[:, None, i] for i in range(3))
        return first + second + third

    return {"plain": lambda: _product(a, b), "new": written_out}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
