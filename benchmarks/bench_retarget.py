"""Retargeting of all of "locomotion": seconds, against reading alone, against the limit, and against
an older build.

    MOTIONLAB_DATA=folder python benchmarks/bench_retarget.py [--every 20] [--rounds 3] [--save]
        [--against FOLDER]

Every n-th clip of each source is read and retargeted in turn, so that what else the machine does
hits both; seconds of the whole set follow by its frames. One process, one thread; the cache, which
makes a second load a matter of reading one file, plays no part. FOLDER holds an older build of
motionlab, which does the same in the same run with the clips of those sources that it knows. Seconds
are those of processors.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from interleaved import OtherBuild, answer, medians, save, table, verdict

from motionlab import Motion
from motionlab.datasets import files, loader, locomotion, registry
from motionlab.io.bvh import parse_bvh

LIMIT = 15 * 60  # seconds for all clips
OLD = ("accad", "bandai-locomotion", "cmu")  # what was in "locomotion" at commit 1dea26a
OF_OLDER = "reading and retargeting / the older build"
LIMITS = {OF_OLDER: 25 / 53}
CLOCK = time.process_time


@dataclass
class Options:
    every: int = 20
    rounds: int = 3
    save: bool = False
    against: Path | None = None
    sources: str = "all"  # or their names, with commas between
    answer: bool = False  # to the process that asks for jobs on the standard input


def main(options: Options) -> None:
    torch.set_num_threads(1)
    sources = sources_of(options.sources.split(","), options.every)
    if options.answer:
        return answer({name: job for its in sources for name, job in its.jobs.items()}, CLOCK)
    older = None
    if options.against:
        told = [f"--every={options.every}", f"--sources={','.join(OLD)}"]
        older = OtherBuild(options.against, told)
    seconds, rates = {}, {}
    for source in sources:
        jobs = dict(source.jobs)
        if older and source.name in OLD:
            jobs |= {f"older build: {job}": older.job(job) for job in source.jobs}
        found = medians(jobs, options.rounds, CLOCK)
        rates |= {name: source.frames / value for name, value in found.items()}
        seconds |= {name: source.share * value for name, value in found.items()}
        rows = [(name, f"{rates[name]:.0f}", "frames/s") for name in found]
        table(f"{source.clips} of {source.of_all} clips", rows)
    if older:
        older.close()
    show(seconds, rates, options)


def show(seconds: dict[str, float], rates: dict[str, float], options: Options) -> None:
    """seconds : of all clips of a source, by job."""
    total = {
        what: sum(value for name, value in seconds.items() if name.startswith(what))
        for what in ("reading", "retargeting")
    }
    whole = sum(total.values())
    found = {"of_limit": whole / LIMIT, "ratio": total["retargeting"] / total["reading"]}
    if options.against:
        theirs = {name: value for name, value in seconds.items() if name.startswith("older")}
        ours = sum(seconds[name.removeprefix("older build: ")] for name in theirs)
        found[OF_OLDER] = ours / sum(theirs.values())
        found["older build: reading and retargeting (s)"] = sum(theirs.values())
    table(
        "all clips, one core",
        [
            *((name, f"{value:.0f} s", "") for name, value in total.items()),
            ("  retargeting / reading", f"{found['ratio']:.1f} x", ""),
            ("  both, of what is allowed", f"{whole:.0f} s", verdict(whole / LIMIT, 1)),
            *(
                (name, f"{found[name]:.3f}", verdict(found[name], LIMITS[name]))
                for name in LIMITS
                if name in found
            ),
        ],
    )
    if options.save:
        record = {"limits": LIMITS, "seconds": total, "frames a second": rates, **found}
        save("bench_retarget", record)


@dataclass
class Source:
    """What is timed of one source."""

    name: str
    clips: int
    of_all: int
    frames: int
    share: float  # frames of all clips, of one that is timed
    jobs: dict[str, Callable[[], object]]


def sources_of(names: list[str], every: int) -> list[Source]:
    by_source = defaultdict(list)
    for clip in registry.members("locomotion"):
        by_source[clip.source].append(clip)
    found = []
    for name, clips in by_source.items():
        if names != ["all"] and name not in names:
            continue
        sample = clips[::every]
        contents = list(files.read(sample))
        motions = [read(*each) for each in contents]
        bring = brings(name)
        bring(motions[0])  # reads what the source's stance is told by
        jobs = {
            f"reading {name}": lambda contents=contents: [read(*each) for each in contents],
            f"retargeting {name}": lambda motions=motions, bring=bring: [*map(bring, motions)],
        }
        frames = [sum(clip.frames for clip in some) for some in (clips, sample)]
        share = frames[0] / frames[1]
        found.append(
            Source(name, len(sample), len(clips), sum(map(len, motions)), share, jobs)
        )  # fmt: skip
    return found


def read(clip: registry.Clip, contents: bytes | tuple[bytes, ...]) -> Motion:
    if hasattr(loader, "parse"):
        return loader.parse(clip, *contents)
    units = registry.sources()[clip.source].units  # so did commit 1dea26a
    how = {"units": units, "fps": clip.fps, "source": clip.source}
    return parse_bvh(contents, clip.path, **how)[clip.skip :]


def brings(source: str) -> Callable[[Motion], Motion]:
    """What retargets a clip of a source; the older build finds out by itself how it stands."""
    if not hasattr(loader, "stance"):
        return locomotion.bring
    stance = loader.stance(source)
    return lambda motion: locomotion.bring(motion, stance)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
