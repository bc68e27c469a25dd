"""What the numbers that a PFNN sees and says mean.

Holden, Komura and Saito (2017), *Phase-Functioned Neural Networks for Character Control*, *System
Input/Output*; the order of the numbers is that of the code that they published.

A character stands on its *root*: the place on the ground below its hips, and the way its body
faces. Its *trajectory* is where the root was a second ago, is and is to be in a second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from ...errors import ModelError
from ...skeleton import Skeleton

GAITS = ("stand", "walk", "jog", "crouch", "jump", "unused")


@dataclass(frozen=True, eq=False)
class Layout:
    """Sizes and order of inputs and outputs. Lengths are metres, velocities metres a frame.

    What is seen, in the present root frame unless said otherwise:

    * places (2, N), x and z, and directions (2, N) of the trajectory; gaits (gaits, N);
    * joints (J, 3) and velocities (J, 3) of the frame before, in the root frame of that one;
    * grounds (grounds, N), heights over the root's.

    What is said:

    * step (2,) of the root to the next frame, x and z; turn (1,) in radians, about -y; phase (1,), a
      step in parts of a cycle; contacts (4,) of left heel, left toe, right heel, right toe;
    * places (2, N / 2) and directions (2, N / 2) from the next frame on, in that one's root frame;
    * joints (J, 3), velocities (J, 3) and rotations (J, 3) of the present frame: half a rotation
      vector (the logarithm of a quaternion) from the root to the joint.

    Velocities are those in the step to a frame; in the authors' data, in the step from it.

    Parameters
    ----------
    skeleton : the body; J is the number of its joints.
    fps : frames per second.
    reach : frames of trajectory behind the present one, and as many from the present one on.
    stride : of them every so manieth is seen, N points in all.
    gaits : weights of gaits at each point (those of `GAITS`), 0 for a network that is told none.
    grounds : heights of the ground at each point, right, below and left of it; 0: it is flat.

    Raises
    ------
    ModelError : a stride that does not divide the reach.
    """

    skeleton: Skeleton
    fps: float
    reach: int
    stride: int
    gaits: int = 0
    grounds: int = 0

    def __post_init__(self) -> None:
        if not (1 <= self.stride <= self.reach and self.reach % self.stride == 0):
            raise ModelError(
                f"Layout: a stride of {self.stride} does not divide a reach of {self.reach} frames."
            )

    @property
    def points(self) -> int:
        """N, points of the trajectory that are seen."""
        return 2 * self.reach // self.stride

    @cached_property
    def seen(self) -> dict[str, tuple[int, int]]:
        """Shape of each part of the input, in order."""
        n, body = self.points, (self.skeleton.joints, 3)
        return {
            "places": (2, n), "directions": (2, n), "gaits": (self.gaits, n),
            "joints": body, "velocities": body, "grounds": (self.grounds, n),
        }  # fmt: skip

    @cached_property
    def said(self) -> dict[str, tuple[int, ...]]:
        """Shape of each part of the output, in order."""
        ahead, body = (2, self.points // 2), (self.skeleton.joints, 3)
        return {
            "step": (2,), "turn": (1,), "phase": (1,), "contacts": (4,),
            "places": ahead, "directions": ahead,
            "joints": body, "velocities": body, "rotations": body,
        }  # fmt: skip


LENGTHS = ("places", "joints", "velocities", "grounds", "step")  # parts that are measured in metres


def size(parts: dict[str, tuple[int, ...]]) -> int:
    """Numbers in a row of all parts."""
    return sum(math.prod(shape) for shape in parts.values())


def join(parts: dict[str, tuple[int, ...]], values: dict[str, Tensor]) -> Tensor:
    """Rows (..., size) of the values of all parts, each (...) and its shape."""
    flat = [values[name].flatten(-len(shape)) for name, shape in parts.items()]
    return torch.cat(flat, dim=-1)


def split(parts: dict[str, tuple[int, ...]], rows: Tensor) -> dict[str, Tensor]:
    """Each part, (...) and its shape, of rows (..., size)."""
    pieces = rows.split([math.prod(shape) for shape in parts.values()], dim=-1)
    named = zip(parts.items(), pieces, strict=True)
    return {name: piece.unflatten(-1, shape) for (name, shape), piece in named}
