"""A part of a body: the joints that carry some points, and no others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import torch
from torch import Tensor

from ..kinematics import forward_kinematics
from ..skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Limbs:
    """The joints above some points of a body; points at their ends need no rotations.

    joints : their numbers in the body, the root first; parents : of each among them; offsets : (joints,
    3) metres. ends, end_parents, end_offsets : the same of points at whose joints nothing hangs.
    count : points of the whole body.
    """

    joints: list[int]
    parents: list[int]
    offsets: Tensor
    ends: list[int]
    end_parents: list[int]
    end_offsets: Tensor
    count: int

    @staticmethod
    def to(skeleton: Skeleton, points: Iterable[int]) -> Limbs:
        """Those that carry points, 0 to `skeleton.points` - 1."""
        return _limbs(skeleton, frozenset(points))

    def points(self, root_positions: Tensor, rotations: Tensor) -> Tensor:
        """Points (..., points, 3) of rotations (..., joints, 3, 3): NaN all that were not asked for."""
        found, _ = forward_kinematics(
            self.parents,
            self.offsets,
            root_positions,
            rotations,
            self.end_parents,
            self.end_offsets,
        )
        whole = found.new_full((*found.shape[:-2], self.count, 3), torch.nan)
        whole[..., self.joints + self.ends, :] = found
        return whole


@lru_cache(maxsize=64)
def _limbs(skeleton: Skeleton, points: frozenset[int]) -> Limbs:
    parents = [*skeleton.parents, *skeleton.end_parents]
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
    joints = {0}
    for point in points:
        while (point := parents[point]) > 0:
            joints.add(point)
    joints = sorted(joints)
    ends = sorted(points - {*joints})
    among = {joint: i for i, joint in enumerate(joints)} | {-1: -1}
    with torch.inference_mode(False):
        return Limbs(
            joints, [among[parents[joint]] for joint in joints], offsets[joints].clone(),
            ends, [among[parents[end]] for end in ends], offsets[ends].clone(), len(parents),
        )  # fmt: skip
