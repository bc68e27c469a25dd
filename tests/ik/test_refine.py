"""The normal equations against automatic differentiation of the forward kinematics."""

import roma
import torch

from motionlab import Skeleton
from motionlab.ik.refine import moved_by, normal_equations
from motionlab.ik.turns import place

CANONICAL = Skeleton.canonical()


def test_normal_equations_are_those_of_the_true_jacobian():
    random = torch.Generator().manual_seed(0)
    draw = lambda *shape: torch.randn(*shape, generator=random, dtype=torch.float64)
    root, pose = draw(3), roma.rotvec_to_rotmat(draw(21, 3))
    target, weights = draw(26, 3), draw(26).abs()
    places, world = place(CANONICAL, root, pose)
    above = torch.cat([torch.eye(3).double()[None], world[list(CANONICAL.parents[1:])]])

    def points(x):  # world-axis turns of each joint, brought into its parent's frame
        local = (above.mT @ x[3:].reshape(21, 3, 1))[..., 0]
        return place(CANONICAL, root + x[:3], roma.rotvec_to_rotmat(local) @ pose)[0].flatten()

    jacobian = torch.autograd.functional.jacobian(points, torch.zeros(66).double())
    step = 1e-6 * draw(66)
    numeric = (points(step) - points(-step)) / 2
    torch.testing.assert_close(jacobian @ step, numeric, rtol=0, atol=1e-11)
    heavy = weights.repeat_interleave(3)
    gaps = target - places
    matrix, pull = normal_equations(places[None], gaps[None], weights[None], moved_by(CANONICAL))
    torch.testing.assert_close(matrix[0], jacobian.T @ (heavy[:, None] * jacobian))
    torch.testing.assert_close(pull[0], jacobian.T @ (heavy * gaps.flatten()))
