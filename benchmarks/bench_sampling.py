"""Sampling: one character in Python beside ONNX Runtime's bare step, and 256 of them.

    python benchmarks/bench_sampling.py [--width 256] [--rounds 9] [--threads 1] [--save]
        [--against FOLDER]

A frame of one character is drawn with all that belongs to it: network, mixture, decoding to raw
features, and its share of what a call checks. ONNX Runtime's step is the network alone, its memory fed
back, if `onnx` and `onnxruntime` are installed. FOLDER holds an older build of motionlab, which does
the same in the same run. Seconds are those of processors, of the clock if there are more threads.

With it: how far the fast way lies from the plain loop after 10 s from one seed, and what rounding
to "int8" changes in 100 motions of the shipped `lstm-gmm-contacts`, drawn one by one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import torch
import tyro
from interleaved import OtherBuild, answer, medians, save, table, verdict

import motionlab
from motionlab import Skeleton, metrics
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm
from motionlab.models.sampler import can_round

FRAMES, CHARACTERS, OF_MANY = 200, 256, 20
TWO = "many, two threads"
SECONDS, SAMPLES = 10, 100  # what differences are measured on
LIMITS = {
    "one / the older build's best": 0.5,
    "one / ONNX Runtime's bare step": 1.5,
    "many on two threads / the older build on one": 1 / 1.5,
}


@dataclass
class Options:
    width: int = 256
    many_width: int = 512
    rounds: int = 9
    threads: int = 1
    save: bool = False
    against: Path | None = None
    answer: bool = False  # to the process that asks for jobs on the standard input


@torch.no_grad()
def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    one, many = one_character(options.width), many_characters(options.many_width)
    clock = time.perf_counter if options.threads > 1 else time.process_time
    if options.answer:
        return answer({**one, **many}, clock)
    jobs = {**one, **many, TWO: two_threads(many, options.threads)}
    if find_spec("onnxruntime") and find_spec("onnx"):
        from onnx_step import bare_steps

        jobs["ONNX Runtime's bare step"] = bare_steps(model_of(options.width), FRAMES)
    if options.against:
        told = [f"--{name}={getattr(options, name)}" for name in ("width", "threads")]
        older = OtherBuild(options.against, [*told, f"--many-width={options.many_width}"])
        jobs |= {f"older build: {name}": older.job(name) for name in (*one, *many)}
    seconds = medians(jobs, options.rounds, clock)
    if options.against:
        older.close()
    show(seconds, list(one), list(many), differences("one, int8" in one), options)


def show(
    seconds: dict[str, float],
    one: list[str],
    many: list[str],
    apart: dict[str, float],
    options: Options,
) -> None:
    best = min(seconds[name] for name in one)
    found = {}
    if options.against:
        older = lambda names: min(seconds[f"older build: {name}"] for name in names)
        found["one / the older build's best"] = best / older(one)
        found["many / the older build"] = min(seconds[name] for name in many) / older(many)
        found["many on two threads / the older build on one"] = seconds[TWO] / older(many)
    if "ONNX Runtime's bare step" in seconds:
        found["one / ONNX Runtime's bare step"] = best / seconds["ONNX Runtime's bare step"]
    frames = lambda name: OF_MANY * CHARACTERS if "many" in name else FRAMES
    table(
        f"a frame at width {options.width}, of many at {options.many_width}, "
        f"threads: {options.threads}",
        [(name, f"{1e6 * value / frames(name):.1f} µs", "") for name, value in seconds.items()]
        + [(name, f"{value:.3f}", judged(name, value)) for name, value in found.items()],
    )
    table("what it changes", [(name, f"{value:.4g}", "") for name, value in apart.items()])
    if options.save:
        save(
            "bench_sampling",
            {
                "threads": options.threads,
                "width": options.width,
                "width of many": options.many_width,
                "limits": LIMITS,
                "seconds": seconds,
                **found,
                **apart,
            },
        )


def model_of(width: int) -> LstmGmm:
    torch.manual_seed(0)
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    return LstmGmm(encoding, Normalizer(encoding.dim), width=width, skip=0.9)


def one_character(width: int) -> dict[str, Callable]:
    model = model_of(width)
    start = model.zero_state()
    kinds = ("full", "half", "int8") if can_round(start.hidden) else ("full",)
    return {
        f"one, {kind}": lambda kind=kind: model.generate(FRAMES, start, precision=kind)
        for kind in kinds
    }


def many_characters(width: int) -> dict[str, Callable]:
    model = model_of(width)
    start = model.zero_state(CHARACTERS)
    kinds = ("full", "int8") if can_round(start.hidden) else ("full",)
    return {
        f"many, {kind}": lambda kind=kind: model.generate(OF_MANY, start, precision=kind)
        for kind in kinds
    }


def two_threads(many: dict[str, Callable], threads: int) -> Callable[[], float]:
    """The fastest of them on two threads; seconds of the clock, which need a second core that is free."""
    fastest = [*many.values()][-1]

    def job() -> float:
        torch.set_num_threads(2)
        began = time.perf_counter()
        fastest()
        took = time.perf_counter() - began
        torch.set_num_threads(threads)
        return took

    return job


def judged(name: str, value: float) -> str:
    return verdict(value, LIMITS[name]) if name in LIMITS else ""


# -- what it changes ------------------------------------------------------------------------------


def differences(rounds: bool) -> dict[str, float]:
    """Numpy against the plain loop, in mm; "int8", if there is any, against "full", as shares."""
    model = motionlab.load("lstm-gmm-contacts")
    fast = ends(model, "full")
    with torch.enable_grad():  # nothing asks for a gradient, but numpy knows of none
        apart = {"apart after 10 s (mm)": 1000 * float((fast - ends(model, "full")).norm())}
    if rounds:
        whole, rounded = (means(model, kind) for kind in ("full", "int8"))
        apart |= {f"int8 / full: {name}": rounded[name] / whole[name] for name in whole}
    return apart


def drawn(model: LstmGmm, seed: int, precision: str) -> torch.Tensor:
    """Features of one motion (frames, dim)."""
    start, chance = model.starts[seed % len(model.starts.frame)], torch.Generator()
    return model.generate(
        round(SECONDS * model.fps), start, generator=chance.manual_seed(seed),
        precision=precision, **model.sampling,
    )[0].detach()  # fmt: skip


def ends(model: LstmGmm, precision: str) -> torch.Tensor:
    """Where the root ends (3)."""
    return model.encoding.to_motion(drawn(model, 0, precision)).root_positions[-1]


def means(model: LstmGmm, precision: str) -> dict[str, float]:
    """Speed, acceleration and sliding of feet, over all samples."""
    rows = []
    for seed in range(SAMPLES):
        motion = model.encoding.to_motion(drawn(model, seed, precision))
        points, fps = motion.positions(), motion.fps
        toes = motion.contacts[:, [1, 3]]
        skate = metrics.foot_skate(points, toes, motion.skeleton, fps)
        rows.append([metrics.speed(points, fps).mean(), metrics.acceleration(points, fps), skate])
    found = torch.tensor(rows).nanmean(0).tolist()
    return dict(zip(("speed", "acceleration", "slide of toes"), found, strict=True))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
