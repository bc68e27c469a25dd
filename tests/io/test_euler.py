"""Euler angles against scipy, in every order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionlab.io.euler import from_euler, to_euler, unrolled

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


def test_unrolled_angles_are_the_same_turns_and_do_not_jump():
    """Joints that turn round and round and over the top: no step is larger than theirs, in any order."""
    time = np.linspace(0, 1, 400)[:, None, None]
    wanted = np.array([3.0, 0.9, -2.0]) * np.sin(2 * np.pi * time * np.array([1.0, 2.0, 1.5]))
    wanted = wanted + np.array([9.0, 2.5, 0.0]) * time
    wanted = np.repeat(wanted, len(ORDERS), axis=1)
    matrices = from_euler(np.rad2deg(wanted), ORDERS)
    raw = to_euler(matrices, ORDERS)
    found = unrolled(raw)
    np.testing.assert_allclose(from_euler(np.rad2deg(found), ORDERS), matrices, atol=1e-5)
    assert np.abs(np.diff(raw, axis=0)).max() > 3
    assert np.abs(np.diff(found, axis=0)).max() < 1.1 * np.abs(np.diff(wanted, axis=0)).max() + 0.01
    np.testing.assert_array_equal(found[0], raw[0])


def test_one_frame_has_nothing_to_unroll():
    angles = np.zeros((1, 2, 3))
    np.testing.assert_array_equal(unrolled(angles), angles)


def test_a_frame_without_any_turn_stays_zero_and_is_gone_on_from():
    """Files begin with one, and readers know it by its zeros."""
    bent = np.full((3, 2, 3), 3.0)
    angles = np.concatenate([bent[:1], np.zeros((1, 2, 3)), bent, np.zeros((1, 2, 3))])
    found = unrolled(angles)
    np.testing.assert_array_equal(found[[1, 5]], 0)
    orders = ("XYZ", "ZYX")
    np.testing.assert_allclose(
        from_euler(np.rad2deg(found), orders), from_euler(np.rad2deg(angles), orders), atol=1e-6
    )
