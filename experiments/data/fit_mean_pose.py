"""Mean pose of the training data, for rotation vectors relative to it.

    python -m experiments.data.fit_mean_pose

Writes src/motionlab/encodings/mean_pose.json: one rotation vector a joint of the canonical skeleton,
the mean of its local rotations over all frames of the training split of `locomotion`, of the three
sources that it had when this was fitted (shipped weights stand on it), and their mirror images. The
mean is the rotation nearest to all in least squares of their matrices (Moakher 2002, the projected
arithmetic mean), which needs no iteration.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import roma
import torch

from motionlab import Motion, Skeleton, datasets
from motionlab.kinematics import heading, yaw_matrix

TARGET = Path(__file__).parents[2] / "src" / "motionlab" / "encodings" / "mean_pose.json"
SOURCES = ("accad", "bandai-locomotion", "cmu")


def main() -> None:
    motions = [m for m in datasets.load("locomotion", "train") if m.source in SOURCES]
    # the mean of a body is symmetric if left and right are
    motions += [motion.mirror() for motion in motions]
    rotations = torch.cat([upright(motion) for motion in motions])
    mean = roma.special_procrustes(rotations.sum(0))
    vectors = roma.rotmat_to_rotvec(mean).mul(1e5).round().div(1e5) + 0.0
    spread = roma.rotmat_geodesic_distance(mean[None], rotations).max(0).values
    record = {
        "source": "accad, bandai-locomotion and cmu in locomotion, training split, mirrored copies included",
        "frames": len(rotations),
        "unit": "radians",
        "rotation_vectors": dict(zip(Skeleton.canonical().names, vectors.tolist(), strict=True)),
    }
    text = re.sub(r"\[\s+(\S+)\s+(\S+)\s+(\S+)\s+\]", r"[\1 \2 \3]", json.dumps(record, indent=1))
    TARGET.write_text(text + "\n", encoding="utf-8")
    for joint, angle in zip(Skeleton.canonical().names, spread.tolist(), strict=True):
        print(f"{joint:<16} farthest from the mean {angle * 180 / torch.pi:6.1f} degrees")


def upright(motion: Motion) -> torch.Tensor:
    """Local rotations (frames, joints, 3, 3), float64; of the root without its yaw."""
    rotations = motion.rotations.double()
    rotations[:, 0] = yaw_matrix(-heading(rotations[:, 0])) @ rotations[:, 0]
    return rotations


if __name__ == "__main__":
    main()
