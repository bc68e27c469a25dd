"""Encodings against plain loops over the frames, 3 000 frames of a made gait.

    python benchmarks/bench_encodings.py [--rounds 10] [--threads 1] [--save]

The loops are what one writes first: one frame after the other in numpy, with scipy for the
rotations, joints by joints down the tree. They give the same numbers, which is checked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import tyro
from interleaved import medians, save, table
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Encoding, JointAngles, RootRelative

FRAMES, LIMIT = 3000, 10


@dataclass
class Options:
    rounds: int = 10
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    motion = gaits.make(seconds=FRAMES / 30, speed=1.5, turn_rate=0.2)
    skeleton = Skeleton.canonical()
    numbers = {}
    for encoding in (JointAngles(skeleton), RootRelative(skeleton), BodyFrame(skeleton)):
        kind = type(encoding).__name__
        loop = LOOPS[kind](encoding)
        features, start = encoding.encode(motion), encoding.start_of(motion)
        differences = {
            "encode": np.abs(features.numpy() - loop.encode(motion)).max(),
            "positions": np.abs(
                encoding.positions(features, start).numpy() - loop.positions(features, start)
            ).max(),
        }
        assert max(differences.values()) < 1e-4, (kind, differences)
        jobs = {
            "encode": lambda e=encoding: e.encode(motion),
            "encode by loop": lambda o=loop: o.encode(motion),
            "positions": lambda e=encoding, f=features, s=start: e.positions(f, s),
            "positions by loop": lambda o=loop, f=features, s=start: o.positions(f, s),
        }
        seconds = medians(jobs, options.rounds)
        rows = []
        for job in ("encode", "positions"):
            ratio = seconds[f"{job} by loop"] / seconds[job]
            holds = "holds" if ratio >= LIMIT else "MISSED"
            rate = f"{len(motion) / seconds[job]:,.0f} /s"
            rows.append((f"{kind}.{job}", rate, f"{ratio:.0f} x, at least {LIMIT}: {holds}"))
            numbers[f"{kind}.{job}"] = {
                "frames_per_second": len(motion) / seconds[job],
                "loop_frames_per_second": len(motion) / seconds[f"{job} by loop"],
                "ratio": ratio,
                "difference": float(differences[job]),
            }
        table(f"{kind}, {len(motion)} frames, medians of {options.rounds} rounds", rows)
    if options.save:
        save("bench_encodings", numbers)


class Loop:
    """What the three loops share: a body, frame by frame."""

    def __init__(self, encoding: Encoding) -> None:
        self.encoding, self.fps = encoding, encoding.fps
        skeleton = encoding.skeleton
        self.parents = skeleton.point_parents
        self.offsets = torch.cat([skeleton.offsets, skeleton.end_offsets]).double().numpy()

    def points(self, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Positions of one frame, down the tree."""
        places, turns = [root], [rotations[0]]
        for point, parent in enumerate(self.parents[1:], start=1):
            places.append(places[parent] + turns[parent] @ self.offsets[point])
            if point < len(rotations):
                turns.append(turns[parent] @ rotations[point])
        return np.array(places)

    def encode(self, motion: Motion) -> np.ndarray:
        rows, before = [], None
        for root, rotations in zip(*(t.astype(float) for t in motion.numpy()), strict=True):
            row, before = self.row(root, rotations, before)
            rows.append(row)
        rows[0][self.steps] = rows[1][self.steps]
        return np.array(rows)


def yaw_of(rotation: np.ndarray) -> float:
    return np.arctan2(rotation[0, 2] - rotation[2, 0], rotation[0, 0] + rotation[2, 2])


def about_y(yaw: float) -> np.ndarray:
    return Rotation.from_euler("Y", yaw).as_matrix()


def step_from(before: tuple | None, root: np.ndarray, yaw: float) -> np.ndarray:
    """Step to the left, step ahead, turn, since the frame before."""
    old_root, old_yaw = (root, yaw) if before is None else before
    x, _, z = about_y(old_yaw).T @ (root - old_root)
    return np.array([x, z, (yaw - old_yaw + np.pi) % (2 * np.pi) - np.pi])


class JointAnglesLoop(Loop):
    steps = slice(0, 3)

    def row(self, root, rotations, before):
        yaw = yaw_of(rotations[0])
        tilt = Rotation.from_matrix(about_y(yaw).T @ rotations[0]).as_rotvec()
        joints = self.encoding.mean_pose[1:].numpy().swapaxes(1, 2) @ rotations[1:]
        vectors = Rotation.from_matrix(joints).as_rotvec().ravel()
        row = [step_from(before, root, yaw), [root[1], tilt[0], tilt[2]], vectors]
        return np.concatenate(row), (root, yaw)

    def positions(self, features, start):
        frames = []
        x, z, yaw = start.tolist()
        mean = self.encoding.mean_pose[1:].numpy()
        for t, row in enumerate(features.double().numpy()):
            if t:
                step = about_y(yaw) @ [row[0], 0, row[1]]
                x, z, yaw = x + step[0], z + step[2], yaw + row[2]
            tilt = Rotation.from_rotvec([row[4], 0, row[5]]).as_matrix()
            joints = mean @ Rotation.from_rotvec(row[6:].reshape(-1, 3)).as_matrix()
            turns = np.concatenate([[about_y(yaw) @ tilt], joints])
            frames.append(self.points(np.array([x, row[3], z]), turns))
        return np.array(frames)


class RootRelativeLoop(Loop):
    steps = slice(0, 3, 2)

    def row(self, root, rotations, before):
        points = self.points(root, rotations)
        step = root - (root if before is None else before)
        return np.concatenate([[step[0], root[1], step[2]], (points[1:] - root).ravel()]), root

    def positions(self, features, start):
        frames = []
        x, z, yaw = start.tolist()
        for t, row in enumerate(features.double().numpy()):
            if t:
                step = about_y(yaw) @ [row[0], 0, row[2]]
                x, z = x + step[0], z + step[2]
            root = np.array([x, row[1], z])
            others = row[3:].reshape(-1, 3) @ about_y(yaw).T
            frames.append(np.concatenate([[root], root + others]))
        return np.array(frames)


class BodyFrameLoop(Loop):
    steps = slice(66, 69)

    def encode(self, motion):
        return np.concatenate([super().encode(motion), motion.contacts.numpy()], axis=1)

    def row(self, root, rotations, before):
        yaw = yaw_of(rotations[0])
        tilt = about_y(yaw).T @ rotations[0]
        points = self.points(np.array([0, root[1], 0]), np.array([tilt, *rotations[1:]]))
        joints = points[1 : self.encoding.points].ravel()
        vector = Rotation.from_matrix(tilt).as_rotvec()
        step = step_from(before, root, yaw) * self.fps
        return np.concatenate([joints, [0, root[1], 0], vector, step]), (root, yaw)

    def positions(self, features, start):
        frames = []
        x, z, yaw = start.tolist()
        for t, row in enumerate(features.double().numpy()):
            vx, vz, turn_rate = row[66:69]
            if t:
                step = about_y(yaw) @ [vx / self.fps, 0, vz / self.fps]
                x, z, yaw = x + step[0], z + step[2], yaw + turn_rate / self.fps
            joints = np.concatenate([row[60:63], row[:60]]).reshape(-1, 3)
            frames.append(np.array([x, 0, z]) + joints @ about_y(yaw).T)
        return np.array(frames)


LOOPS = {
    "JointAngles": JointAnglesLoop,
    "RootRelative": RootRelativeLoop,
    "BodyFrame": BodyFrameLoop,
}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
