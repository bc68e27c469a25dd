"""Euler angles, as BVH files hold them, to rotation matrices and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def from_euler(angles: np.ndarray, orders: Sequence[str]) -> np.ndarray:
    """Rotation matrices (frames, joints, 3, 3) from degrees (frames, joints, 3) in file order.

    The order "ZXY" means R = Rz(first) Rx(second) Ry(third).
    """
    rotations = np.empty((*angles.shape, 3), dtype=np.float32)
    for joints, (i, j, k), sign in _by_order(orders):
        # in double precision: float32 would blur angles of many turns
        radians = np.deg2rad(angles[:, joints].transpose(2, 0, 1)) * sign
        (a, b, c), (u, v, w) = np.sin(radians), np.cos(radians)
        rotations[:, joints, i, i] = v * w
        rotations[:, joints, i, j] = -v * c
        rotations[:, joints, i, k] = b
        rotations[:, joints, j, i] = u * c + a * b * w
        rotations[:, joints, j, j] = u * w - a * b * c
        rotations[:, joints, j, k] = -a * v
        rotations[:, joints, k, i] = a * c - u * b * w
        rotations[:, joints, k, j] = a * w + u * b * c
        rotations[:, joints, k, k] = u * v
    return rotations


def to_euler(rotations: np.ndarray, orders: Sequence[str]) -> np.ndarray:
    """Radians (frames, joints, 3) in file order from matrices; the inverse of `from_euler`.

    Near gimbal lock, where the first and third axis coincide, the first angle is noise; the third
    is taken from what the first leaves over, so that their product is right all the same.
    """
    angles = np.empty(rotations.shape[:-1])
    for joints, (i, j, k), sign in _by_order(orders):
        m = rotations[:, joints].transpose(2, 3, 0, 1).astype(np.float64)
        first = np.arctan2(-m[j, k], m[k, k])
        second = np.arctan2(m[i, k], np.hypot(m[i, i], m[i, j]))
        a, u = np.sin(first), np.cos(first)
        third = np.arctan2(u * m[j, i] + a * m[k, i], u * m[j, j] + a * m[k, j])
        angles[:, joints] = np.stack([first, second, third], axis=-1) * sign
    return angles


def unrolled(angles: np.ndarray) -> np.ndarray:
    """The same rotations by angles (frames, joints, 3), radians, that do not jump from frame to frame.

    Of three angles about different axes there is another triple, with half a turn more of the first and
    the third and the second mirrored, and whole turns on top. Each frame has what is nearest to the one
    before; the first stays, and so does one without any turn, which readers know by its zeros.
    """
    rests = np.flatnonzero((np.abs(angles) < 1e-6).all(axis=(1, 2)))
    return np.concatenate([_followed(piece) for piece in np.split(angles, rests)])


def _followed(angles: np.ndarray) -> np.ndarray:
    """`unrolled` from a first frame that stays."""
    if len(angles) < 2:
        return angles
    others = angles * [1, -1, 1] + np.pi
    apart = lambda a, b: np.square((a - b + np.pi) % (2 * np.pi) - np.pi).sum(-1)
    # another frame before asks for the other triple now, as both are equally far from each other
    changes = apart(others[1:], angles[:-1]) < apart(angles[1:], angles[:-1])
    other = np.cumsum(changes, axis=0) % 2 == 1
    found = angles.copy()
    found[1:] = np.where(other[..., None], others[1:], angles[1:])
    return np.unwrap(found, axis=0)


def _by_order(orders: Sequence[str]) -> list[tuple[list[int], list[int], float]]:
    """For each rotation order its joints, its three axes, and the sign of its angles: what is
    written out for axes in cyclic order holds for the others with negated angles."""
    groups = []
    for order in sorted(set(orders)):
        joints = [joint for joint, other in enumerate(orders) if other == order]
        axes = ["XYZ".index(letter) for letter in order]
        groups.append((joints, axes, 1.0 if (axes[1] - axes[0]) % 3 == 1 else -1.0))
    return groups
