"""What inverse kinematics recovers of rotations: writes results/ik_twist.json.

    MOTIONLAB_DATA=folder python -m experiments.data.ik_twist [--output results/ik_twist.json]

Validation clips of `locomotion` are turned into points and back by `motionlab.ik.solve`. Per source
and joint: errors of bone direction and of twist. And the grid on which the smoother's two constants
are judged: that is best which adds least to the largest step from frame to frame.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import roma
import torch

import motionlab
from motionlab import Motion, datasets, ik
from motionlab.datasets import splits
from motionlab.datasets.registry import choose
from motionlab.ik import hinge

from ..common import record

STRAIGHT, SMOOTH = (0.025, 0.05, 0.1), (0.25, 1.0, 4.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", default="results/ik_twist.json")
    output, begin = Path(parser.parse_args().output), time.perf_counter()
    clips = datasets.load("locomotion", "val")
    sources = {name: [m for m in clips if m.source == name] for name in {m.source for m in clips}}
    some = [m for motions in sources.values() for m in motions[:16]]
    result = {
        "command": " ".join(record.command()),
        "code_version": motionlab.__version__,
        "data_hash": splits.digest([(c.source, c.where, c.split) for c in choose("locomotion")]),
        "sources": {name: recovered(motions) for name, motions in sorted(sources.items())},
        "constants": {"straight": hinge.STRAIGHT, "smooth": 1.0},
        "grid": [row for straight in STRAIGHT for row in grid(some, straight)],
        "seconds": round(time.perf_counter() - begin, 1),
    }
    output.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(f"{output}: {result['seconds']} s")


def solved(motion: Motion, smooth: float = 1.0) -> Motion:
    """The motion again, from its points alone."""
    root, rotations = ik.solve(motion.skeleton, motion.positions(), limits="human", smooth=smooth)
    return replace(motion, root_positions=root, rotations=rotations)


def recovered(motions: Sequence[Motion]) -> dict:
    """Errors of a source: the worst point in mm, per joint direction and twist in degrees."""
    again = [solved(motion) for motion in motions]
    pairs = list(zip(again, motions, strict=True))
    worst = max(float((a.positions() - b.positions()).norm(dim=-1).max()) for a, b in pairs)
    errors = [ik.twist_error(a.rotations, b.rotations, b.skeleton) for a, b in pairs]
    way, twist = (torch.cat(kind) for kind in zip(*errors, strict=True))
    return {
        "clips": len(motions),
        "worst point (mm)": round(1000 * worst, 4),
        "joints": {
            name: {
                "direction, median (deg)": round(float(way[:, j].nanmedian()), 5),
                "twist, median (deg)": round(float(twist[:, j].median()), 2),
                "twist, 95 % (deg)": round(float(twist[:, j].quantile(0.95)), 1),
            }
            for j, name in enumerate(motions[0].skeleton.names)
        },
    }


def grid(motions: Sequence[Motion], straight: float) -> list[dict]:
    """Twist above hinges, and steps that the source lacks, for each strength of smoothing."""
    usual, hinge.STRAIGHT = hinge.STRAIGHT, straight
    skeleton, rows = motions[0].skeleton, []
    above = [
        skeleton.index(f"{s}_{p}") for s in ("left", "right") for p in ("upper_arm", "upper_leg")
    ]
    for smooth in SMOOTH:
        twists, added = [], []
        for motion in motions:
            again = solved(motion, smooth)
            twists.append(ik.twist_error(again.rotations, motion.rotations, skeleton)[1][:, above])
            steps = [
                roma.rotmat_geodesic_distance(r[1:, above], r[:-1, above]).amax(0)
                for r in (again.rotations, motion.rotations)
            ]
            added.append(torch.rad2deg((steps[0] - steps[1]).clamp(min=0)))
        row = {"straight": straight, "smooth": smooth}
        row["twist, median (deg)"] = round(float(torch.cat(twists).median()), 3)
        row["added step, mean (deg)"] = round(float(torch.cat(added).mean()), 3)
        row["added step, largest (deg)"] = round(float(torch.cat(added).max()), 2)
        rows.append(row)
    hinge.STRAIGHT = usual
    return rows


if __name__ == "__main__":
    main()
