"""A step on the tree against the normal equations that automatic differentiation gives."""

import roma
import torch

from motionlab import Skeleton
from motionlab.ik.tree_step import tree_step
from motionlab.ik.turns import place

CANONICAL = Skeleton.canonical()


def test_a_step_solves_the_normal_equations_of_the_true_jacobian():
    random = torch.Generator().manual_seed(0)
    draw = lambda *shape: torch.randn(*shape, generator=random, dtype=torch.float64)
    root, pose = draw(3), roma.rotvec_to_rotmat(draw(21, 3))
    target, weights, torques = draw(26, 3), draw(26).abs(), draw(21, 3)
    turning, shifting = 0.02, 0.005
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
    ridge = torch.tensor([shifting] * 3 + [turning] * 63)
    matrix = jacobian.T @ (heavy[:, None] * jacobian) + torch.diag(ridge)
    pull = jacobian.T @ (heavy * gaps.flatten())
    pull[3:] += torques.flatten()
    one = torch.ones(1).double()
    shift, turns = tree_step(
        CANONICAL, places[None], gaps[None], weights[None], torques[None], turning * one,
        shifting * one,
    )  # fmt: skip
    found = torch.cat([shift[0], turns[0].flatten()])
    torch.testing.assert_close(found, torch.linalg.solve(matrix, pull))
