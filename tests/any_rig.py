"""Bodies like a given one whose joints' axes are drawn any way at all: rigs as programs make them."""

from __future__ import annotations

from dataclasses import replace

import roma
import torch

from motionlab import Motion


def drawn(motion: Motion, axes: torch.Tensor, names: list[str] | None = None) -> Motion:
    """The same movement of the same points, each joint with other axes.

    axes : (joints, 3, 3), each joint's new axes in its old ones.
    """
    s = motion.skeleton
    above = torch.stack([axes[p] if p >= 0 else torch.eye(3) for p in s.parents])
    ends = torch.stack([axes[p] for p in s.end_parents]) if s.end_parents else torch.zeros(0, 3, 3)
    turned = lambda offsets, turns: (turns.mT @ offsets[..., None])[..., 0]
    skeleton = replace(
        s,
        names=s.names if names is None else tuple(names),
        offsets=turned(s.offsets, above),
        end_offsets=turned(s.end_offsets, ends),
    )
    return replace(motion, skeleton=skeleton, rotations=above.mT @ motion.rotations @ axes)


def random_axes(joints: int, seed: int) -> torch.Tensor:
    """(joints, 3, 3), all different."""
    return roma.random_rotmat(joints, generator=torch.Generator().manual_seed(seed))


def about_y(degrees: float) -> torch.Tensor:
    """A turn (3, 3) to the left."""
    return roma.rotvec_to_rotmat(torch.tensor([0.0, degrees * torch.pi / 180, 0.0]))


def moved(motion: Motion, degrees: float, way: tuple[float, float, float]) -> Motion:
    """The motion turned to the left about the origin, and then moved."""
    turn = about_y(degrees)
    return replace(
        motion,
        root_positions=motion.root_positions @ turn.mT + torch.tensor(way),
        rotations=torch.cat([turn @ motion.rotations[:, :1], motion.rotations[:, 1:]], 1),
    )
