"""Forward kinematics: Motion.positions() against PyMotion's torch `fk`, 3 000 frames, 43 joints.

    python benchmarks/bench_kinematics.py [--rounds 30] [--threads 1] [--save]

PyMotion's has no end sites; ours computes 14 of them besides. Small batches are what a network
that generates frame by frame asks for.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import tyro
from interleaved import medians, save, table, verdict
from pymotion.ops.skeleton_torch import fk

from motionlab import Motion, Skeleton

JOINTS, ENDS = 43, 14


@dataclass
class Options:
    rounds: int = 30
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    numbers = {}
    for frames in (3000, 64, 1):
        motion = tumble(frames)
        skeleton, parents = motion.skeleton, torch.tensor(motion.skeleton.parents)
        arguments = (motion.rotations, motion.root_positions, skeleton.offsets, parents)
        ours, theirs = motion.positions()[:, :JOINTS], fk(*arguments)[0]
        difference = float((ours - theirs).abs().max())
        seconds = medians(
            {"PyMotion": lambda a=arguments: fk(*a), "motionlab": motion.positions},
            options.rounds,
        )
        ratio = seconds["motionlab"] / seconds["PyMotion"]
        table(
            f"{frames} frames, {JOINTS} joints, {options.threads} thread(s), medians of "
            f"{options.rounds} rounds; largest difference {difference:.1e} m",
            [
                ("pymotion.ops.skeleton_torch.fk", f"{seconds['PyMotion'] * 1e3:.2f} ms", ""),
                ("motionlab Motion.positions", f"{seconds['motionlab'] * 1e3:.2f} ms", ""),
                ("  ratio", "", verdict(ratio, 1)),
            ],
        )
        numbers[str(frames)] = {"seconds": seconds, "ratio": ratio, "difference": difference}
    if options.save:
        save("bench_kinematics", numbers)


def tumble(frames: int) -> Motion:
    """A tree as deep as a body with fingers (11 levels), tumbling."""
    random = torch.Generator().manual_seed(0)
    parents = [-1, *(max(0, j - 1) if j % 11 else 0 for j in range(1, JOINTS))]
    skeleton = Skeleton(
        tuple(f"j{j}" for j in range(JOINTS)),
        tuple(parents),
        torch.randn(JOINTS, 3, generator=random) * 0.1,
        tuple(range(JOINTS - ENDS, JOINTS)),
        torch.randn(ENDS, 3, generator=random) * 0.1,
    )
    turns = torch.linalg.qr(torch.randn(frames, JOINTS, 3, 3, generator=random))[0]
    turns = turns * torch.linalg.det(turns)[..., None, None]
    return Motion(skeleton, torch.randn(frames, 3, generator=random), turns, fps=120)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
