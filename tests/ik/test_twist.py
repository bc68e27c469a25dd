"""twist_error and the hinge's twist on turns that are known."""

import math

import numpy as np
import pytest
import roma
import torch

from motionlab import Skeleton
from motionlab.errors import IkError
from motionlab.ik import twist_error
from motionlab.ik.hinge import steady_angle
from motionlab.ik.turns import swing, twist_about

CANONICAL = Skeleton.canonical()
ARM = CANONICAL.index("left_upper_arm")  # its bone lies along +x


@pytest.mark.parametrize(
    ("turn", "direction", "twist"),
    [((0.5, 0, 0), 0, 0.5), ((0, 0.4, 0), 0.4, 0), ((0, 0, -3.0), 3.0, 0), ((-3.0, 0, 0), 0, 3.0)],
)
def test_error_is_split_into_direction_and_twist(turn, direction, twist):
    true = torch.eye(3).expand(1, 21, 3, 3).clone()
    found = true.clone()
    found[:, ARM] = roma.rotvec_to_rotmat(torch.tensor(turn, dtype=torch.float32))
    way, about = twist_error(found, true, CANONICAL)
    assert way[0, ARM].item() == pytest.approx(math.degrees(direction), abs=1e-3)
    assert about[0, ARM].item() == pytest.approx(math.degrees(twist), abs=1e-3)
    assert way[0, 0].item() == about[0, 0].item() == pytest.approx(0, abs=1e-3)


def test_shapes_must_agree():
    with pytest.raises(IkError, match="21"):
        twist_error(torch.zeros(2, 21, 3, 3), torch.zeros(2, 20, 3, 3), CANONICAL)
    with pytest.raises(IkError, match="None"):
        twist_error([0.0], [0.0], CANONICAL)


def test_swing_is_the_shortest_turn():
    a, b = torch.randn(2, 100, 3, dtype=torch.float64).unbind()
    a, b = a / a.norm(dim=-1, keepdim=True), b / b.norm(dim=-1, keepdim=True)
    turn = swing(a, b)
    torch.testing.assert_close((turn @ a[..., None])[..., 0], b)
    angle = roma.rotmat_to_rotvec(turn).norm(dim=-1)
    torch.testing.assert_close(angle, (a * b).sum(-1).clamp(-1, 1).arccos(), rtol=0, atol=1e-6)
    torch.testing.assert_close(twist_about(turn, a), torch.zeros(100).double(), rtol=0, atol=1e-9)


def test_smoother_solves_its_least_squares_problem():
    random = torch.Generator().manual_seed(0)
    seen = torch.rand(2, 30, generator=random).double() * torch.exp(
        1j * torch.randn(2, 30, generator=random).double().clamp(-1.4, 1.4)
    )
    for row in range(2):
        size = seen[row].abs().numpy()
        second = np.diff(np.eye(30), n=2, axis=0)
        matrix = np.diag(size**2 + 0.05**2) + 3.0 * second.T @ second
        calm = np.linalg.solve(matrix, size * seen[row].numpy() + 0.05**2)
        np.testing.assert_allclose(steady_angle(seen, 3.0)[row], np.angle(calm), atol=1e-9)


def test_a_straight_limb_does_not_flip():
    """The bend passes through straight to slightly overstretched and back: the twist stays."""
    bend = torch.linspace(0.5, -0.15, 40).double()
    bend = torch.cat([bend, bend.flip(0)])
    noise = 0.01 * torch.randn(80, 2, generator=torch.Generator().manual_seed(3)).double()
    seen = torch.complex(bend + noise[:, 0], noise[:, 1])[None]
    angle = torch.rad2deg(steady_angle(seen, 1.0))[0]
    assert angle.abs().max() < 20
    assert angle.diff().abs().max() < 6
