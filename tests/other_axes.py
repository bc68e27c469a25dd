"""The same motion on a rig whose joint axes lie any way at all, so that its rest pose is no body."""

from __future__ import annotations

from dataclasses import replace

import roma
import torch

from motionlab import Motion, Skeleton


def in_axes(motion: Motion, turn: torch.Tensor) -> tuple[torch.Tensor, ...]:
    """Offsets, end offsets and rotations of the same places, joints' axes drawn another way.

    turn : (joints, 3, 3), each joint's new axes in its old ones.
    """
    s = motion.skeleton
    offsets, ends, rotations = s.offsets.clone(), s.end_offsets.clone(), motion.rotations @ turn
    for joint, parent in enumerate(s.parents):
        if parent >= 0:
            offsets[joint] = turn[parent].mT @ offsets[joint]
            rotations[:, joint] = turn[parent].mT @ rotations[:, joint]
    for end, parent in enumerate(s.end_parents):
        ends[end] = turn[parent].mT @ ends[end]
    return offsets, ends, rotations


def redrawn(motion: Motion, turn: int | torch.Tensor, factor: float = 1.0) -> Motion:
    """All places as before, of a body `factor` times as large; contacts are not told.

    turn : (joints, 3, 3), each joint's new axes in its old ones; or the seed that they come from.
    """
    s, rig = motion.skeleton, "rig"
    if isinstance(turn, int):
        rig = f"rig{turn}"
        turn = roma.random_rotmat(s.joints, generator=torch.Generator().manual_seed(turn))
    offsets, ends, rotations = in_axes(motion, turn)
    body = Skeleton(
        tuple(f"{rig}_{name}" for name in s.names), s.parents, factor * offsets, s.end_parents,
        factor * ends,
    )  # fmt: skip
    return replace(
        motion, skeleton=body, root_positions=factor * motion.root_positions, rotations=rotations,
        contacts=None,
    )  # fmt: skip
