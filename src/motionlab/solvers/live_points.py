"""Where the feet of futures are, and how a window's bodies stand, in numpy, as `models.refiner_step` has it.

The same as `JointAngles.positions` and `rotations`. It is little to calculate in a hundred pieces.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from ..encodings import JointAngles
from ..encodings.effectors import chain_ends
from ..feet.contacts import foot_points
from ..models.refiner_step import turns_of


class FeetPoints:
    """The chains of joints from the root to heels and toes."""

    def __init__(self, encoding: JointAngles) -> None:
        self.encoding, skeleton = encoding, encoding.skeleton
        self.feet = foot_points(skeleton)
        parents = [*skeleton.parents, *skeleton.end_parents]
        chains = [[point] for point in self.feet]
        for chain in chains:
            while (above := parents[chain[0]]) >= 0:
                chain.insert(0, above)  # from the root to the point itself
        joints = sorted({0}.union(*(chain[:-1] for chain in chains)))
        depth = max(map(len, chains))
        self.levels = np.zeros((depth - 1, len(chains)), int)
        self.offsets = np.zeros((depth, len(chains), 3), np.float32)
        offsets = torch.cat([skeleton.offsets, skeleton.end_offsets]).numpy()
        for i, chain in enumerate(chains):
            self.levels[: len(chain) - 1, i] = [joints.index(joint) for joint in chain[:-1]]
            self.offsets[1 : len(chain), i] = offsets[chain[1:]]
        pose = encoding.slices["pose"].start
        columns = [
            [4, 4, 5],
            *([pose + 3 * (joint - 1) + k for k in range(3)] for joint in joints[1:]),
        ]
        self.columns = np.ravel(columns)  # the second of the root's is no number
        self.mean = encoding.mean_pose[joints].float().numpy(force=True).copy()
        self.mean[0] = np.eye(3)

    def __call__(self, features: Tensor, place: np.ndarray) -> Tensor:
        """Points (batch, frames, points, 3) metres; of all but the feet NaN.

        features : (batch, frames, dim), raw units; place : (batch, frames, 3), where they stand.
        """
        batch, frames = features.shape[:2]
        points = np.full((batch, frames, self.encoding.points, 3), np.nan, np.float32)
        rows = features.numpy().reshape(batch * frames, -1).T  # kinematics take the batch last
        vectors = rows.take(self.columns, 0).reshape(-1, 3, batch * frames)
        x, y, z = chain_ends(turns_of(vectors, self.mean), self.levels, self.offsets).swapaxes(0, 1)
        x_at, z_at, yaw = place.reshape(-1, 3).T
        sine, cosine = np.sin(yaw), np.cos(yaw)
        world = x * cosine + z * sine + x_at, y + rows[3], z * cosine - x * sine + z_at
        points[:, :, self.feet] = np.stack(world, -1).swapaxes(0, 1).reshape(batch, frames, -1, 3)
        return torch.from_numpy(points)


def led(steps: np.ndarray, yaw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and z (...) of what is to the left and ahead (..., 2) of who faces that way."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    left, ahead = steps[..., 0], steps[..., 1]
    return left * cosine + ahead * sine, ahead * cosine - left * sine


def way_of(rows: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Roots (batch, frames, 3) and yaw (batch, frames) of rows (batch, frames, dim), raw units, the first of
    which stands at a place (batch, 3); both float64."""
    yaw = np.concatenate([place[:, 2:], rows[:, 1:, 2]], 1).cumsum(1)
    root = np.zeros((*rows.shape[:2], 3))
    root[:, 0, 0], root[:, 0, 2] = place[:, 0], place[:, 1]
    root[:, 1:, 0], root[:, 1:, 2] = led(rows[:, 1:, :2], yaw[:, :-1])
    root = root.cumsum(1)
    root[..., 1] = rows[..., 3]
    return root, yaw


def rotations_of(encoding: JointAngles, features: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
    """Root positions (batch, frames, 3) and local rotations (batch, frames, joints, 3, 3), float32.

    features : (batch, frames, dim), raw units; place : (batch, 3), where the first frames stand.
    """
    if encoding.rotation != "vector" or features.dtype != torch.float32:
        return encoding.rotations(features, place.to(features))
    batch, frames, _ = features.shape
    root, yaw = way_of(features.numpy().astype(float), place.numpy())
    rows = features.numpy().reshape(batch * frames, -1).T
    pose = rows[encoding.slices["pose"]]
    vectors = np.concatenate([rows[[4, 4, 5]], pose]).reshape(-1, 3, batch * frames)
    mean = encoding.mean_pose.float().numpy(force=True).copy()
    mean[0] = np.eye(3)
    turns = np.ascontiguousarray(turns_of(vectors, mean).transpose(3, 0, 1, 2))
    sine, cosine, none = np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)
    faces = [cosine, none, sine, none, none + 1, none, -sine, none, cosine]
    faces = np.stack(faces, -1).reshape(-1, 3, 3).astype(np.float32)
    turns[:, 0] = faces @ turns[:, 0]
    turns = turns.reshape(batch, frames, *turns.shape[1:])
    return torch.from_numpy(root.astype(np.float32)), torch.from_numpy(turns)


@lru_cache(maxsize=8)
def feet_of(encoding: JointAngles) -> FeetPoints | None:
    """None for joints whose numbers are no rotation vectors."""
    return FeetPoints(encoding) if encoding.rotation == "vector" else None
