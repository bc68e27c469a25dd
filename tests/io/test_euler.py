"""Euler angles against scipy, in every order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionlab.io.euler import from_euler, to_euler

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
ANGLES = np.random.default_rng(0).uniform(-400, 400, (50, 6, 3))


def test_matrices_are_scipys():
    ours = from_euler(ANGLES, ORDERS)
    for joint, order in enumerate(ORDERS):
        theirs = Rotation.from_euler(order, ANGLES[:, joint], degrees=True).as_matrix()
        np.testing.assert_allclose(ours[:, joint], theirs, atol=1e-6)


def test_matrices_are_pybvhs():
    """The convention of the format: what the file lists first is applied last."""
    from pybvh.rotations import euler_to_rotmat

    for joint, order in enumerate(ORDERS):
        theirs = euler_to_rotmat(np.deg2rad(ANGLES[:, joint]), order)
        np.testing.assert_allclose(from_euler(ANGLES, ORDERS)[:, joint], theirs, atol=1e-6)


def test_angles_give_the_matrices_back():
    matrices = from_euler(ANGLES, ORDERS)
    again = from_euler(np.rad2deg(to_euler(matrices, ORDERS)), ORDERS)
    np.testing.assert_allclose(again, matrices, atol=1e-6)


@pytest.mark.parametrize("middle", [-90, 90])
def test_gimbal_lock_keeps_the_rotation(middle):
    angles = ANGLES.copy()
    angles[..., 1] = middle
    matrices = from_euler(angles, ORDERS)
    again = from_euler(np.rad2deg(to_euler(matrices, ORDERS)), ORDERS)
    np.testing.assert_allclose(again, matrices, atol=1e-6)


def test_angles_of_a_hundred_thousand_turns():
    far = from_euler(ANGLES + 360 * 100_000, ORDERS)
    np.testing.assert_allclose(far, from_euler(ANGLES, ORDERS), atol=1e-6)
