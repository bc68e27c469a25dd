"""The hop between the first frame and the second (claim W8): writes results/initial_state.json.

    python -m experiments.rnn_gan.initial_state [--model lstm-gmm] [--data locomotion] [--split test]

In the middle of each clip a network begins anew at a recorded frame, frame 1: with its memory at
zero; with the memory that `solvers.initial_state` finds from two frames (the paper's equation 27)
and from three; and with what it remembers of the recorded second before. A hop is an acceleration of
all points, at frame 1 and the frames after it.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import torch
from torch import Tensor, nn

import motionlab
from motionlab import metrics, weights
from motionlab.models import State
from motionlab.solvers import initial_state
from motionlab.training import Prepared

from ..common.record import about_weights, provenance, run, write

HOP = 1.25  # times the warm state's hop: more is one that is seen
OBSERVED, FOLLOWED = 30, 10  # frames seen before by the last way, frame 1 included; looked at after
SAMPLES = 16  # of each start
SEED = 0
LIKELIEST = {"temperature": 1e-6, "component_temperature": 1e-3}  # the mean of that component


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--output", type=Path, default=Path("results/initial_state.json"))
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model = motionlab.load(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    clips = middles(data.clips(chosen.split))
    found = measured(model, clips, chosen.iterations)
    about = about_weights(model, weights.find(chosen.model))
    more = {"weights": about, "split": chosen.split, "clips": len(clips), "samples": SAMPLES,
            "observed": OBSERVED, "iterations": chosen.iterations}  # fmt: skip
    write({**provenance(begin, SEED, data, **more), **found}, chosen.output)


def middles(clips: list[Tensor]) -> Tensor:
    """The middle of every clip that is long enough, (clips, OBSERVED + FOLLOWED, dim)."""
    length = OBSERVED + FOLLOWED
    long = [clip for clip in clips if len(clip) >= length]
    if not long:
        raise motionlab.MotionLabError(f"No clip has the {length} frames that are needed.")
    return torch.stack([clip[(len(clip) - length) // 2 :][:length] for clip in long])


def measured(model: nn.Module, clips: Tensor, iterations: int) -> dict:
    """Medians over clips, from frame 1 on, for each way to begin, and for the recording itself."""
    onward = clips[:, OBSERVED - 1 :]  # from frame 1
    states = {
        "zero": model.observe(onward[:, :1]),
        "estimated": initial_state(model, onward[:, :2], iterations=iterations),
        "estimated from three": initial_state(model, onward[:, :3], iterations=iterations),
        "observed": model.observe(clips[:, :OBSERVED]),
    }
    second = model.normalizer(onward[:, 1])
    real = model.encoding.positions(clips[:, OBSERVED - 2 :])
    found = {
        "hop (m/s²)": {}, "hop of the likeliest (m/s²)": {}, "from the recording (cm)": {},
        "log-likelihood of frame 2 (nats)": {}, "excess hop at frame 1 (m/s²)": {},
    }  # fmt: skip
    hops, halves = {}, {}
    for name, state in states.items():
        likely = model.predict(state).log_prob(second)
        found["log-likelihood of frame 2 (nats)"][name] = _interval(likely)
        cold = going_on(model, clips, state, 1, LIKELIEST)
        found["hop of the likeliest (m/s²)"][name] = _medians(hop(cold, model.fps))
        made = going_on(model, clips, state, SAMPLES, model.sampling)
        hops[name] = hop(made, model.fps)
        halves[name] = [hop(half, model.fps) for half in made.chunk(2, dim=1)]
        found["hop (m/s²)"][name] = _medians(hops[name])
        away = 100 * (made - real[:, None])[:, :, 2:].norm(dim=-1).mean((1, 3))
        found["from the recording (cm)"][name] = _medians(away)
    found["hop (m/s²)"]["recorded"] = _medians(hop(real[:, None], model.fps))
    for name, values in hops.items():
        excess = (values - hops["observed"])[:, 0]
        found["excess hop at frame 1 (m/s²)"][name] = _interval(excess)
    return found | {"cases": _cases(halves)}


def _cases(halves: dict[str, list[Tensor]]) -> dict:
    """Clips that hop with a state of zeros, chosen by half of the samples, judged by the other half."""
    chosen = halves["zero"][0][:, 0] >= HOP * halves["observed"][0][:, 0]
    hops = {name: _medians(judged[chosen]) for name, (_, judged) in halves.items() if chosen.any()}
    return {"clips": int(chosen.sum()), "hop (m/s²)": hops}


def going_on(model: nn.Module, clips: Tensor, state: State, samples: int, sampling: dict) -> Tensor:
    """Points of frames 0 and 1 as recorded, then of generated ones, (clips, samples, frames, ...)."""
    generator = torch.Generator().manual_seed(SEED)
    rows = torch.arange(len(clips)).repeat_interleave(samples)
    with torch.no_grad():
        made = model.generate(FOLLOWED, state[rows], generator=generator, **sampling)
    before = clips[rows, OBSERVED - 2 : OBSERVED]
    whole = model.encoding.positions(torch.cat([before, made], dim=1))
    return whole.unflatten(0, (-1, samples))


def hop(positions: Tensor, fps: float) -> Tensor:
    """Mean acceleration of the points at frames 1, 2, ... (clips, frames - 2), over the samples."""
    size = positions.diff(n=2, dim=-3).norm(dim=-1) * fps**2
    return size.mean((1, 3))


def _medians(values: Tensor) -> list[float]:
    """Over clips, for each frame of (clips, frames)."""
    return values.double().quantile(0.5, dim=0).tolist()


def _interval(values: Tensor) -> metrics.Interval:
    return metrics.bootstrap(values, seed=SEED)


if __name__ == "__main__":
    run(main)
