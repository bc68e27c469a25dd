"""Joint rotations as numbers: rotation vectors, Euler angles, or six numbers."""

from __future__ import annotations

from collections.abc import Sequence

import roma
import torch
from torch import Tensor

from ..io.euler import to_euler

WIDTHS = {"vector": 3, "euler": 3, "6d": 6}


def to_numbers(rotations: Tensor, kind: str, mean: Tensor, orders: Sequence[str]) -> Tensor:
    """Rotations (frames, joints, 3, 3) as (frames, joints, 3 or 6) numbers, float64.

    "vector" : rotation vector of ``mean.T @ rotation``, at most pi long. A joint half a turn from
        its mean pose jumps from v to -v. We let it: following it past pi would give one pose two
        encodings, depending on what came before, and the encoding of a cut would not be the cut of
        the encoding. What keeps joints away from the jump is the mean pose.
    "euler" : Euler angles in radians, in the order of the file, within half a turn.
    "6d" : the first two columns of the matrix (Zhou et al. 2019, On the Continuity of Rotation
        Representations in Neural Networks).
    """
    if kind == "euler":
        angles = to_euler(rotations.numpy(force=True), orders)
        return torch.from_numpy(angles).to(rotations.device)
    rotations = rotations.double()
    if kind == "6d":
        return torch.cat([rotations[..., 0], rotations[..., 1]], dim=-1)
    return roma.rotmat_to_rotvec(torch.einsum("jba,...jbc->...jac", mean.to(rotations), rotations))


def from_numbers(numbers: Tensor, kind: str, mean: Tensor, orders: Sequence[str]) -> Tensor:
    """Rotations (..., joints, 3, 3) from any numbers (..., joints, 3 or 6); differentiable."""
    if kind == "6d":
        # numbers from a network need not be of unit length, nor perpendicular
        return roma.special_gramschmidt(numbers.unflatten(-1, (2, 3)).mT, epsilon=1e-9)
    if kind == "vector":
        turns = roma.rotvec_to_rotmat(numbers)
        return torch.einsum("jab,...jbc->...jac", mean.to(turns), turns)
    groups = {o: [j for j, other in enumerate(orders) if other == o] for o in sorted(set(orders))}
    turns = [euler_matrix(numbers[..., joints, :], order) for order, joints in groups.items()]
    places = torch.tensor([joint for joints in groups.values() for joint in joints])
    return torch.cat(turns, dim=-3)[..., places.argsort(), :, :]


def euler_matrix(angles: Tensor, order: str) -> Tensor:
    """Rotations (..., 3, 3) from radians (..., 3): "ZXY" is Rz(first) Rx(second) Ry(third)."""
    return roma.euler_to_rotmat(order, angles)
