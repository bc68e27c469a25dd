"""A step of damped least squares on a tree of joints, in time that grows as the number of joints.

What a joint and all below it can do about their targets depends on the joint's place alone, and on
how the bone above it turns. So joints are left out one by one, the outermost first, each adding to
its parent what its best answer would cost; then the answers are read from the root outwards. That is
how robotics computes the dynamics of a robot [Featherstone, The Calculation of Robot Dynamics Using
Articulated-Body Inertias, 1983], with targets for forces and damping for the inertia of motors.
"""

from __future__ import annotations

import torch
from torch import Tensor

from ..skeleton import Skeleton
from .turns import skew


def tree_step(
    skeleton: Skeleton,
    places: Tensor,
    gaps: Tensor,
    weights: Tensor,
    torques: Tensor,
    turning: Tensor,
    shifting: Tensor,
) -> tuple[Tensor, Tensor]:
    """Shift of the root and small turns of all joints, in world axes, that close the gaps best.

    They minimise the sum over points of weight times squared rest of the gap, plus `turning` times
    all squared turns, minus twice torques times turns, plus `shifting` times the squared shift.

    Parameters
    ----------
    places, gaps : (n, points, 3) metres, where points are, and from there to their targets.
    weights : (n, points).
    torques : (n, joints, 3) square metres, what draws the joints besides their points.
    turning : (n,) square metres, above 0.
    shifting : (n,), from 0.

    Returns
    -------
    shift : (n, 3) metres.
    turns : (n, joints, 3) radians, of each joint against its parent.
    """
    above = torch.tensor(skeleton.point_parents[1:])
    # Frames lie last from here on, joints and points first: sums over long rows are fast.
    places, gaps, torques = (x.permute(1, 2, 0).contiguous() for x in (places, gaps, torques))
    weights = weights.mT[:, None]
    eye = torch.eye(3).to(places)[..., None]
    levers = _skew(places[1:] - places[above])
    weighted = weights[1:, None] * levers
    pulls = weights * gaps

    # What a joint's points cost if it turns by w and moves by v: w'Aw + 2w'Bv + v'Cv - 2a'w - 2c'v.
    collect = lambda parts: parts.new_zeros(skeleton.joints, *parts.shape[1:]).index_add_(
        0, above, parts
    )
    a_matrix, b_matrix = collect(-_product(weighted, levers)), collect(weighted)
    c_matrix = collect(weights[1:, None] * eye)
    a_pull, c_pull = collect(_apply(levers, pulls[1:])), collect(pulls[1:])

    # Joints of one level at a time, from the outermost: each turns as is best for any w and v.
    a_pull += torques
    inverse, gain, best = map(torch.empty_like, (a_matrix, a_matrix, a_pull))
    levels = _levels(skeleton)
    for joints in reversed(levels):
        b = b_matrix[joints]
        turn = inverse[joints] = _inverse(a_matrix[joints] + turning * eye)
        follow = gain[joints] = _product(turn, b)
        answer = best[joints] = _apply(turn, a_pull[joints])
        c_matrix[joints] -= _product(b.transpose(1, 2), follow)
        c_pull[joints] -= _apply(b.transpose(1, 2), answer)
        if joints[0] == 0:
            break
        # and that costs its parent, whose turn moves the joint by its lever
        parents, lever, c = above[joints - 1], levers[joints - 1], c_matrix[joints]
        b, lever_c = turning * follow, _product(lever, c)
        crossed = _product(lever, b.transpose(1, 2))
        a = turning * (eye - turning * turn) + crossed + crossed.transpose(1, 2)
        a_matrix.index_add_(0, parents, a - _product(lever_c, lever))
        b_matrix.index_add_(0, parents, b + lever_c)
        c_matrix.index_add_(0, parents, c)
        pull = turning * answer - torques[joints] + _apply(lever, c_pull[joints])
        a_pull.index_add_(0, parents, pull)
        c_pull.index_add_(0, parents, c_pull[joints])

    stiffness = c_matrix[:1] + (weights[:1] + shifting)[:, None] * eye
    moves, whole = torch.empty_like(a_pull), torch.empty_like(a_pull)
    moves[:1] = _apply(_inverse(stiffness), c_pull[:1] + pulls[:1])
    whole[:1] = best[:1] - _apply(gain[:1], moves[:1])
    for joints in levels[1:]:
        parents = above[joints - 1]
        moves[joints] = moves[parents] - _apply(levers[joints - 1], whole[parents])
        held = turning * _apply(inverse[joints], whole[parents])
        whole[joints] = best[joints] + held - _apply(gain[joints], moves[joints])
    turns = torch.cat([whole[:1], whole[1:] - whole[above[: skeleton.joints - 1]]])
    return moves[0].mT, turns.permute(2, 0, 1)


def _levels(skeleton: Skeleton) -> list[Tensor]:
    """The joints by how many are above them, the root first."""
    depth = [0]
    for parent in skeleton.parents[1:]:
        depth.append(depth[parent] + 1)
    return [
        torch.tensor([joint for joint, its in enumerate(depth) if its == level])
        for level in range(max(depth) + 1)
    ]


def _skew(v: Tensor) -> Tensor:
    """`turns.skew` of vectors (points, 3, n): (points, 3, 3, n)."""
    return skew(v.mT).permute(0, 2, 3, 1)


def _product(a: Tensor, b: Tensor) -> Tensor:
    """Matrix products of two (joints, 3, 3, n) stacks."""
    return (a.unsqueeze(3) * b.unsqueeze(1)).sum(2)


def _apply(matrices: Tensor, vectors: Tensor) -> Tensor:
    """Matrices (joints, 3, 3, n) times vectors (joints, 3, n)."""
    return (matrices * vectors.unsqueeze(1)).sum(2)


def _inverse(matrices: Tensor) -> Tensor:
    """Of symmetric, positive definite matrices (joints, 3, 3, n)."""
    x, y, z = matrices.unbind(1)
    cross = lambda a, b: torch.linalg.cross(a, b, dim=1)
    adjugate = torch.stack([cross(y, z), cross(z, x), cross(x, y)], 1)
    return adjugate / (x * adjugate[:, 0]).sum(1)[:, None, None]
