"""Reading BVH: against pybvh, and six channels a joint against three.

    python benchmarks/bench_bvh.py [--rounds 15] [--threads 1] [--save]

With MOTIONLAB_DATA the files are real: a 4 MB clip of `aclstm-cmu`, and a clip of
`bandai-locomotion` against one of `cmu` of about its size. Without, they are made up.
"""

from __future__ import annotations

import os
import tempfile
import warnings
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybvh
import torch
import tyro
from interleaved import medians, save, table, verdict

from motionlab import read_bvh

REAL = {
    "large": ("aclstm-cmu", "train_data_bvh/martial/06.bvh"),
    "six": ("bandai-locomotion", "data/dataset-2_walk_elderly_004.bvh"),
    "three": ("cmu", "05/05_06.bvh"),
}


@dataclass
class Options:
    rounds: int = 15
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    warnings.simplefilter("ignore")  # pybvh guesses which way is up and says so
    with tempfile.TemporaryDirectory() as folder:
        files = clips(Path(folder))
        seconds = medians(
            {
                "pybvh": lambda: pybvh.read_bvh_file(files["large"]),
                "motionlab": lambda: read_bvh(files["large"]),
                "six": lambda: read_bvh(files["six"]),
                "three": lambda: read_bvh(files["three"]),
            },
            options.rounds,
        )
        megabytes = {name: path.stat().st_size / 1e6 for name, path in files.items()}
    rate = {name: megabytes[name] / seconds[name] for name in ("six", "three")}
    against_pybvh = seconds["motionlab"] / seconds["pybvh"]
    against_three = rate["three"] / rate["six"]
    table(
        f"read_bvh, medians of {options.rounds} rounds, {options.threads} thread(s)",
        [
            (f"pybvh.read_bvh_file, {megabytes['large']:.1f} MB", *ms(seconds["pybvh"])),
            (f"motionlab.read_bvh, {megabytes['large']:.1f} MB", *ms(seconds["motionlab"])),
            ("  ratio", "", verdict(against_pybvh, 1.6)),
            (f"three channels a joint, {megabytes['three']:.1f} MB", *speed(rate["three"])),
            (f"six channels a joint, {megabytes['six']:.1f} MB", *speed(rate["six"])),
            ("  ratio", "", verdict(against_three, 1.5)),
        ],
    )
    if options.save:
        save("bench_bvh", {"seconds": seconds, "vs_pybvh": against_pybvh, "six": against_three})


def ms(seconds: float) -> tuple[str, str]:
    return f"{seconds * 1e3:.1f} ms", ""


def speed(rate: float) -> tuple[str, str]:
    return f"{rate:.1f} MB/s", ""


def clips(folder: Path) -> dict[str, Path]:
    """A large clip, one with six channels a joint, one with three."""
    data = os.environ.get("MOTIONLAB_DATA")
    if not data:
        return {
            "large": made_up(folder / "large.bvh", joints=43, frames=3300, six=False),
            "six": made_up(folder / "six.bvh", joints=22, frames=450, six=True),
            "three": made_up(folder / "three.bvh", joints=31, frames=630, six=False),
        }
    files = {}
    for name, (source, end) in REAL.items():
        files[name] = folder / f"{name}.bvh"
        with zipfile.ZipFile(Path(data) / f"{source}.zip") as archive:
            path = next(path for path in archive.namelist() if path.endswith(end))
            files[name].write_bytes(archive.read(path))
    return files


def made_up(path: Path, joints: int, frames: int, six: bool) -> Path:
    """A chain of joints; the position channels of inner joints repeat their offset."""
    lines, position = ["HIERARCHY"], "Xposition Yposition Zposition"
    for joint in range(joints):
        channels = f"6 {position}" if six or joint == 0 else "3"
        lines += [
            f"{'JOINT' if joint else 'ROOT'} j{joint}", "{", "OFFSET 0.0 5.0 0.0",
            f"CHANNELS {channels} Zrotation Xrotation Yrotation",
        ]  # fmt: skip
    lines += ["End Site", "{", "OFFSET 0.0 5.0 0.0", "}", *["}"] * joints]
    lines += ["MOTION", f"Frames: {frames}", "Frame Time: 0.0333333"]
    values = np.random.default_rng(0).uniform(-180, 180, (frames, joints, 6))
    values[:, 1:, :3] = (0, 5, 0)
    keep = np.ones((joints, 6), dtype=bool)
    keep[1:, :3] = six
    with path.open("w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
        np.savetxt(file, values[:, keep], fmt="%.6f")
    return path


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
