"""Forward kinematics, held against plain loops in numpy."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionlab.errors import MotionError
from motionlab.kinematics import forward_kinematics, heading, yaw_matrix


def random_body(seed: int, batch: tuple[int, ...], joints: int, ends: int = 2):
    rng = np.random.default_rng(seed)
    parents = [-1] + [int(rng.integers(0, j)) for j in range(1, joints)]
    count = int(np.prod(batch)) * joints
    rotations = Rotation.random(count, rng=rng).as_matrix() if count else np.zeros((0, 3, 3))
    return dict(
        parents=parents,
        offsets=torch.tensor(rng.normal(size=(joints, 3))),
        root_positions=torch.tensor(rng.normal(size=(*batch, 3))),
        rotations=torch.tensor(rotations.reshape(*batch, joints, 3, 3)),
        end_parents=rng.integers(0, joints, ends).tolist(),
        end_offsets=torch.tensor(rng.normal(size=(ends, 3))),
    )  # fmt: skip


def by_loops(parents, offsets, root_positions, rotations, end_parents, end_offsets):
    """One frame: joint by joint, homogeneous 4 x 4 matrices."""
    world = []
    for joint, parent in enumerate(parents):
        local = np.eye(4)
        local[:3, :3] = rotations[joint]
        local[:3, 3] = root_positions if parent < 0 else offsets[joint]
        world.append(local if parent < 0 else world[parent] @ local)
    tips = [
        (world[parent] @ np.append(offset, 1))[:3]
        for parent, offset in zip(end_parents, end_offsets, strict=True)
    ]
    return np.array([w[:3, 3] for w in world] + tips), np.array([w[:3, :3] for w in world])


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    batch=st.sampled_from([(), (1,), (4,), (2, 3)]),
    joints=st.integers(1, 12),
    ends=st.integers(0, 3),
)
def test_every_frame_as_by_loops(seed, batch, joints, ends):
    body = random_body(seed, batch, joints, ends)
    positions, orientations = forward_kinematics(**body)
    assert positions.shape == (*batch, joints + ends, 3)
    assert orientations.shape == (*batch, joints, 3, 3)
    for frame in np.ndindex(*batch):
        one = {name: np.asarray(value) for name, value in body.items()}
        one["root_positions"] = one["root_positions"][frame]
        one["rotations"] = one["rotations"][frame]
        expected = by_loops(**one)
        np.testing.assert_allclose(positions[frame].numpy(), expected[0], atol=1e-12)
        np.testing.assert_allclose(orientations[frame].numpy(), expected[1], atol=1e-12)


def test_float32_is_good_to_a_micrometre():
    body = random_body(0, (200,), 40)
    single = {k: v.float() if isinstance(v, torch.Tensor) else v for k, v in body.items()}
    exact, rounded = forward_kinematics(**body)[0], forward_kinematics(**single)[0]
    assert rounded.dtype == torch.float32
    assert (exact - rounded).abs().max() < 1e-5  # on a body of some ten metres


def test_gradients():
    body = random_body(1, (2,), 5)
    variables = ("offsets", "root_positions", "rotations", "end_offsets")

    def positions_and_orientations(*values):
        return forward_kinematics(**{**body, **dict(zip(variables, values, strict=True))})

    values = [body[name].requires_grad_() for name in variables]
    assert torch.autograd.gradcheck(positions_and_orientations, values)


@pytest.mark.parametrize("batch", [(0,), (3, 0), (0, 2)])
def test_no_frames(batch):
    positions, orientations = forward_kinematics(**random_body(2, batch, 4))
    assert positions.shape == (*batch, 6, 3) and orientations.shape == (*batch, 4, 3, 3)


def test_a_body_without_end_sites():
    body = random_body(3, (2,), 4, ends=0)
    del body["end_parents"], body["end_offsets"]
    assert forward_kinematics(**body)[0].shape == (2, 4, 3)


def test_inputs_are_left_alone():
    body = random_body(4, (3,), 5)
    before = {name: torch.as_tensor(value).clone() for name, value in body.items()}
    positions, orientations = forward_kinematics(**body)
    positions.zero_(), orientations.zero_()
    for name, value in body.items():
        assert torch.equal(torch.as_tensor(value), before[name]), name


def test_sampling_first_does_not_spoil_training():
    body = random_body(3, (2,), 7, ends=0)  # a tree that no other test has cached
    with torch.inference_mode():
        forward_kinematics(**body)
    body["rotations"] = body["rotations"].clone().requires_grad_()
    forward_kinematics(**body)[0].sum().backward()
    assert body["rotations"].grad.abs().sum() > 0


@pytest.mark.parametrize(
    ("name", "shape"),
    [("offsets", (3, 3)), ("root_positions", (3, 3)), ("root_positions", (3,)),
     ("rotations", (2, 5, 3, 3)), ("rotations", (2, 4, 9)), ("end_offsets", (1, 3))],
    ids=["offsets", "roots", "one root", "joints", "flat", "ends"],
)  # fmt: skip
def test_shapes_that_do_not_fit(name, shape):
    with pytest.raises(MotionError, match="4 joints and 2 end sites need"):
        forward_kinematics(**random_body(6, (2,), 4) | {name: torch.zeros(shape)})


# -- heading ---------------------------------------------------------------------------------------


def random_rotations(seed: int, count: int) -> torch.Tensor:
    return torch.tensor(Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix())


def test_yaw_matrix_turns_forward_to_the_left():
    yaw = torch.linspace(-7, 7, 29, dtype=torch.float64)
    expected = Rotation.from_euler("y", yaw[:, None].numpy()).as_matrix()
    np.testing.assert_allclose(yaw_matrix(yaw).numpy(), expected, atol=1e-15)
    quarter = yaw_matrix(torch.tensor(torch.pi / 2)) @ torch.tensor([0.0, 0.0, 1.0])
    torch.testing.assert_close(quarter, torch.tensor([1.0, 0.0, 0.0]))  # left is +x
    assert yaw_matrix(torch.zeros(2, 0, 4)).shape == (2, 0, 4, 3, 3)


def test_heading_leaves_a_swing_without_yaw():
    rotations = random_rotations(0, 2000)
    yaw = heading(rotations)
    swing = Rotation.from_matrix((yaw_matrix(yaw).mT @ rotations).numpy())
    np.testing.assert_allclose(swing.as_rotvec()[:, 1], 0, atol=1e-12)
    # the twist of scipy's quaternion
    quaternions = Rotation.from_matrix(rotations.numpy()).as_quat(scalar_first=True)
    twist = 2 * np.arctan2(quaternions[:, 2], quaternions[:, 0])
    np.testing.assert_allclose(np.cos(twist - yaw.numpy()), 1, atol=1e-12)
    # the nearest of all turns about y
    others = torch.linspace(-torch.pi, torch.pi, 200, dtype=torch.float64)
    nearest = (yaw_matrix(others) - rotations[:20, None]).flatten(2).norm(dim=-1).min(-1).values
    own = (yaw_matrix(yaw[:20]) - rotations[:20]).flatten(1).norm(dim=-1)
    assert (own <= nearest + 1e-12).all()


@settings(max_examples=50, deadline=None)
@given(turn=st.floats(-10, 10), seed=st.integers(0, 2**32))
def test_heading_follows_a_turn_of_the_world(turn, seed):
    rotations = random_rotations(seed, 5)
    turn = torch.tensor(turn, dtype=torch.float64)
    gained = heading(yaw_matrix(turn) @ rotations) - heading(rotations) - turn
    torch.testing.assert_close(gained.cos(), torch.ones_like(gained), rtol=0, atol=1e-12)


@pytest.mark.parametrize("pitch", [-1.57, 0.0, 1.0, 1.5708, 3.0])
def test_heading_of_a_pitched_body(pitch):
    """An Euler angle is lost at a pitch of 90 degrees; the heading is not."""
    pitch = torch.tensor(Rotation.from_euler("x", pitch).as_matrix())
    torch.testing.assert_close(
        heading(yaw_matrix(torch.tensor(0.7, dtype=torch.float64)) @ pitch).item(), 0.7
    )


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("axis", ["x", "z"])
def test_heading_upside_down_is_finite(axis, dtype):
    turned = Rotation.from_euler(axis, np.pi).as_matrix()
    for near in (0, 1e-9, 1e-7, 1e-5, 1e-3):
        rotation = torch.tensor(turned + near * np.eye(3), dtype=dtype, requires_grad=True)
        yaw = heading(rotation)
        yaw.backward()
        assert yaw.isfinite() and rotation.grad.isfinite().all()


def test_heading_gradients():
    rotations = random_rotations(1, 4).requires_grad_()
    assert torch.autograd.gradcheck(heading, rotations)
    yaw = torch.tensor([0.0, 3.1, -2.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(yaw_matrix, yaw)
