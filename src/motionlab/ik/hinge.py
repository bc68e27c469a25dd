"""Knees and elbows: a bent hinge shows how the bone above it is twisted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.linalg import solveh_banded
from torch import Tensor

from .limb import two_bone
from .turns import swing, turn_about

# Sine of the bend at which the neutral pose has as much to say on the twist as the bend has.
STRAIGHT = 0.05
# A limb bent backwards by up to this sine (15 degrees) is overstretched, not twisted half around.
_OVERSTRETCH = 0.26


@dataclass(frozen=True)
class Hinge:
    """A joint that turns about one axis."""

    upper: int  # the joint above
    lower: int  # the hinge itself
    end: int  # the joint at the end of the bone below
    axis: Tensor  # (3,), in the frame of `upper`; a positive turn about it bends the limb
    along: Tensor  # (3,), direction of the bone above, in the frame of `upper`
    below: Tensor  # (3,), direction of the bone below, in the frame of `lower`
    low: float  # radians from straight, negative backwards
    high: float

    def twist_above(self, upper: Tensor, way: Tensor, below: Tensor, smooth: float) -> Tensor:
        """Turn the joint above about its bone until the limb bends in the hinge's plane.

        upper : (batch, frames, 3, 3), world orientation of the joint above, its twist any.
        way, below : (batch, frames, 3), directions of the bones above and below the hinge; zero
            where unknown.
        """
        axis = upper @ self.axis
        normal = torch.linalg.cross(way, below)  # as long as the sine of the bend
        cosine = (axis * normal).sum(-1)
        sine = (way * torch.linalg.cross(axis, normal)).sum(-1)
        return turn_about(way, steady_angle(torch.complex(cosine, sine), smooth)) @ upper

    def middle(
        self, upper: Tensor, at: Tensor, end: Tensor, lengths: tuple[Tensor, Tensor]
    ) -> Tensor:
        """Where the hinge is, (..., 3) metres, when only the limb's two ends are known.

        upper : (..., 3, 3), world orientation that the joint above has in the neutral pose.
        at, end : (..., 3) metres, the joint above and the end of the bone below.
        lengths : of the bones above and below, metres.
        """
        # The limb swings to its end's target, and the hinge points to where it points in rest.
        outward = -torch.linalg.cross(self.axis, self.along)
        pole = swing(upper @ self.along, end - at) @ (upper @ outward)[..., None]
        down = at.new_tensor([0.0, -1.0, 0.0])
        turn, _ = two_bone(at, end, pole[..., 0], lengths[0] * down, lengths[1] * down)
        return at + lengths[0] * (turn @ down)

    def bend_to(self, upper: Tensor, lower: Tensor, way: Tensor) -> Tensor:
        """Turn the hinge about its axis until the bone below is as near a direction as it gets.

        upper, lower : (..., 3, 3), world orientations; way : (..., 3).
        """
        axis = upper @ self.axis
        return turn_about(axis, _angle_about(axis, lower @ self.below, way)) @ lower

    def bend(self, rotations: Tensor) -> Tensor:
        """Radians (...) from straight, of local rotations (..., joints, 3, 3)."""
        below = rotations[..., self.lower, :, :] @ self.below
        return _angle_about(self.axis, self.along.expand_as(below), below)


def _angle_about(axis: Tensor, a: Tensor, b: Tensor) -> Tensor:
    """Angle (...) in radians about a unit axis, from direction a to direction b, all (..., 3)."""
    sine = (torch.linalg.cross(a, b) * axis).sum(-1)
    cosine = (a * b).sum(-1) - (a * axis).sum(-1) * (b * axis).sum(-1)
    return torch.atan2(sine, cosine)


def steady_angle(seen: Tensor, smooth: float) -> Tensor:
    """Angles (batch, frames) in radians that stay calm where they can hardly be seen.

    seen : complex (batch, frames); its angle is the angle, its size (0 to 1) how well that shows.

    A straight arm shows nothing of its twist, a slightly bent one little and that full of noise.
    So each frame holds on to what it shows with weight size², to the neutral angle 0 with a small
    one, and the second difference over time is small: Whittaker's smoother [Eilers, Anal. Chem. 75,
    2003], on complex numbers, whose angle needs no unwrapping.
    """
    seen = torch.complex(seen.real + (-seen.real).clamp(0, _OVERSTRETCH), seen.imag)
    size = seen.abs()
    weight, pull = size**2 + STRAIGHT**2, size * seen + STRAIGHT**2
    frames = seen.shape[-1]
    if not smooth or frames < 3:
        return pull.angle()
    # The smoothness penalty D'D in the banded form of solveh_banded: row 2 is the diagonal.
    penalty, kernel = np.zeros((3, frames)), (1, -2, 1)
    for i in range(3):
        for j in range(i, 3):
            penalty[2 - (j - i), j : frames - 2 + j] += smooth * kernel[i] * kernel[j]
    calm = np.empty(seen.shape, dtype=complex)
    for row in range(len(seen)):
        bands = penalty + np.stack([np.zeros(frames)] * 2 + [weight[row].numpy()])
        calm[row] = solveh_banded(bands, pull[row].numpy())
    return torch.from_numpy(np.angle(calm))
