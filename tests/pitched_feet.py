"""Feet of given pitches that stand."""

from __future__ import annotations

import roma
import torch

FPS, FRAMES = 30, 60
SOLE = torch.tensor([0.0, -0.0749, 0.0906])


def pitched(degrees: float, frames: int = FRAMES) -> torch.Tensor:
    """Orientations (frames, 3, 3) whose toes point down by so much."""
    angle = torch.full((frames,), float(degrees))
    return roma.euler_to_rotmat("X", angle[:, None], degrees=True)


def standing(*feet: torch.Tensor, lift: float = 0.0) -> tuple[torch.Tensor, torch.Tensor]:
    """Ankles and toes (2, frames, 3) of feet whose toes rest side by side, one perhaps higher."""
    toes = torch.tensor([[0.1, 0.025, 0.0], [-0.1, 0.025 + lift, 0.0]])[:, None].expand(
        2, FRAMES, 3
    )
    reach = torch.stack([foot @ SOLE for foot in feet])
    return toes - reach, toes


def pitch(feet: torch.Tensor) -> torch.Tensor:
    """Degrees (2, frames) by which toes point down."""
    return -torch.rad2deg(torch.atan2(feet[..., 1, 2], feet[..., 1, 1]))
