"""Retargeting of all of "locomotion": seconds, against reading alone and against the limit.

    MOTIONLAB_DATA=folder python benchmarks/bench_retarget.py [--every 20] [--rounds 3] [--save]

Every n-th clip of each source is read and retargeted in turn, so that what else the machine does
hits both; seconds of the whole set follow by its frames. One process, one thread; the cache, which
makes a second load a matter of reading one file, plays no part.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table, verdict

from motionlab.datasets import files, loader, locomotion, registry

LIMIT = 15 * 60  # seconds for all clips


@dataclass
class Options:
    every: int = 20
    rounds: int = 3
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(1)
    by_source = defaultdict(list)
    for clip in registry.members("locomotion"):
        by_source[clip.source].append(clip)
    total = {"reading": 0.0, "retargeting": 0.0}
    numbers = {}
    for source, clips in by_source.items():
        sample = clips[:: options.every]
        contents = list(files.read(sample))
        motions = [loader.parse(clip, *data) for clip, data in contents]
        stance = loader.stance(source)
        seconds = medians(
            {
                "reading": lambda c=contents: [loader.parse(clip, *data) for clip, data in c],
                "retargeting": lambda m=motions, s=stance: [
                    locomotion.bring(motion, s) for motion in m
                ],
            },
            options.rounds,
        )
        share = sum(clip.frames for clip in clips) / sum(clip.frames for clip in sample)
        rates = {name: sum(map(len, motions)) / value for name, value in seconds.items()}
        for name, value in seconds.items():
            total[name] += share * value
        numbers[source] = {"clips": len(clips), "frames_per_second": rates}
        rows = [(f"{source}: {name}", f"{rate:.0f}", "frames/s") for name, rate in rates.items()]
        table(f"{len(sample)} of {len(clips)} clips", rows)
    whole = sum(total.values())
    table(
        "all clips, one core",
        [
            *((name, f"{value:.0f} s", "") for name, value in total.items()),
            ("  retargeting / reading", f"{total['retargeting'] / total['reading']:.1f} x", ""),
            ("  both, of what is allowed", f"{whole:.0f} s", verdict(whole / LIMIT, 1)),
        ],
    )
    if options.save:
        numbers |= {"seconds": total, "ratio": total["retargeting"] / total["reading"]}
        save("bench_retarget", {**numbers, "of_limit": whole / LIMIT})


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
