"""upc-pymotion: speed after resampling, what a mirror does to its caller's arrays, angles re-written."""

import json

import numpy as np
from given import BVH as FILE
from pymotion.io.bvh import BVH
from pymotion.ops import skeleton


def loaded():
    clip = BVH()
    clip.load(FILE)
    return clip


def sped(clip, target):
    """Length of the root's way over seconds, before and after."""
    speeds = []
    for _ in range(2):
        way, step = clip.data["positions"][:, 0], clip.data["frame_time"]
        speeds.append(np.linalg.norm(way[-1] - way[0]) / (len(way) - 1) / step)
        if len(speeds) == 1:
            clip.resample(1 / target)
    return speeds[1] / speeds[0]


def first(clip, frames):
    """A clip of its first frames."""
    clip.data["positions"] = clip.data["positions"][:frames]
    clip.data["rotations"] = clip.data["rotations"][:frames]
    return clip


clip = loaded()
angles = clip.data["rotations"].copy()
rotations, positions, parents, offsets, ends, _ = clip.get_data()
clip.set_data(rotations, positions)
way = positions[:, 0].copy()
skeleton.mirror(
    local_rotations=rotations, global_translation=way, parents=parents, offsets=offsets, end_sites=ends,
    joints_mapping=clip._generate_mirror_mapping(), mode="symmetry", axis="X",
)  # fmt: skip
print(
    json.dumps(
        {
            "speed after 120 to 30 fps, of 31 frames": sped(first(loaded(), 31), 30),
            "speed after 120 to 30 fps, of all": sped(loaded(), 30),
            "mirror changed the way it was given by (cm)": float(
                np.abs(way - positions[:, 0]).max()
            ),
            "angles written again that are 360 degrees off": float(
                (np.abs(clip.data["rotations"] - angles) > 180).mean()
            ),
        }
    )
)
