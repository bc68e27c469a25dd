"""What the tests of all encodings share: the encodings themselves, and motions made to hurt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.datasets.registry import sources
from motionlab.encodings import BodyFrame, Encoding, JointAngles, RootRelative
from motionlab.io.bvh import parse_bvh
from motionlab.kinematics import yaw_matrix

MAKERS: dict[str, Callable[..., Encoding]] = {
    "vector": lambda s, fps=30.0: JointAngles(s, fps),
    "vector+contacts": lambda s, fps=30.0: JointAngles(s, fps, contacts=True),
    "euler": lambda s, fps=30.0: JointAngles(s, fps, rotation="euler"),
    "6d": lambda s, fps=30.0: JointAngles(s, fps, rotation="6d"),
    "root-relative": lambda s, fps=30.0: RootRelative(s, fps),
    "root-relative 1.54 m": lambda s, fps=30.0: RootRelative(s, fps, 1.54, "difference"),
    "body-frame": lambda s, fps=30.0: BodyFrame(s, fps),
}


@pytest.fixture(params=MAKERS.values(), ids=MAKERS.keys(), scope="session")
def make(request) -> Callable[..., Encoding]:
    """One after the other, a function from skeleton (and fps) to an encoding."""
    return request.param


@pytest.fixture(scope="session")
def gait() -> Motion:
    """A walk that turns to a run, seven seconds, somewhere in the world."""
    motion = gaits.make(seconds=7, speed=[0.5, 1.5, 3.0], turn_rate=0.9)
    return moved(motion, yaw=2.5, x=3.0, z=-4.0)


@pytest.fixture(scope="session")
def long_gait() -> Motion:
    """More than 10 000 frames of jogging to and fro in bends, some 700 m."""
    return gaits.make(seconds=334, speed=2.0, turn_rate=lambda t: np.sin(t / 20))


@pytest.fixture(scope="session")
def real_motions(real_clips) -> dict[str, list[Motion]]:
    """At most 200 frames of each real clip, in metres, by source."""
    return {
        source: [
            parse_bvh(data, path, units=sources()[source].units, tpose_first=True)[:200]
            for path, data in clips.items()
        ]
        for source, clips in real_clips.items()
    }


@pytest.fixture(scope="session")
def move() -> Callable[..., Motion]:
    return moved


@pytest.fixture(scope="session")
def wild() -> Callable[..., Motion]:
    return wild_motion


def moved(motion: Motion, yaw: float, x: float, z: float) -> Motion:
    """The whole motion turned about the vertical through the origin, then moved."""
    turn = yaw_matrix(torch.tensor(yaw, dtype=torch.float64))
    rotations = motion.rotations.double()
    rotations[:, 0] = turn @ rotations[:, 0]
    places = motion.root_positions.double() @ turn.T
    return replace(motion, root_positions=places + torch.tensor([x, 0.0, z]), rotations=rotations)


def wild_motion(seed: int, special: str = "random", frames: int = 5) -> Motion:
    """A body with every order of axes, whose joints are where rotations are awkward."""
    rng = np.random.default_rng(seed)
    canonical = Skeleton.canonical()
    orders = rng.permutation(["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"] * 4)[: canonical.joints]
    skeleton = replace(canonical, rotation_orders=tuple(orders.tolist()))
    count = frames * canonical.joints
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    axes[::3] = np.eye(3)[rng.integers(0, 3, len(axes[::3]))]  # and the coordinate axes
    sizes = {
        "random": rng.uniform(0, np.pi, count),
        "zero": np.zeros(count),
        "tiny": 10.0 ** rng.uniform(-9, -3, count),
        "half turn": np.full(count, np.pi),
        "nearly half a turn": np.pi - 10.0 ** rng.uniform(-8, -3, count),
    }
    if special == "gimbal":
        angles = rng.uniform(-3, 3, (count, 3))
        angles[:, 1] = rng.choice([-1, 1], count) * np.pi / 2
        rotations = [
            Rotation.from_euler(order, turn).as_matrix()
            for order, turn in zip(np.tile(orders, frames), angles, strict=True)
        ]
    elif special == "facing backwards":
        rotations = Rotation.from_rotvec(axes * sizes["tiny"][:, None]).as_matrix()
        back = np.pi + rng.choice([-1, 1], frames) * 10.0 ** rng.uniform(-8, -2, frames)
        rotations[:: canonical.joints] = Rotation.from_euler("Y", back[:, None]).as_matrix()
    else:
        rotations = Rotation.from_rotvec(axes * sizes[special][:, None]).as_matrix()
    return Motion(
        skeleton,
        rng.uniform(-5, 5, (frames, 3)),
        np.array(rotations).reshape(frames, canonical.joints, 3, 3),
        fps=30,
        contacts=rng.random((frames, 4)) < 0.5,
    )
