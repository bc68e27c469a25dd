"""Levenberg-Marquardt on joint rotations, a batch of frames at a time.

The unknowns are a shift of the root and a small turn of every joint, in world axes. A turn w of
joint j moves every point p below it by w x l, with the lever l from j to p. So the Jacobian is made
of levers, and its normal equations are sums of their products.
"""

from __future__ import annotations

from collections.abc import Callable

import roma
import torch
from torch import Tensor

from ..skeleton import Skeleton
from .turns import place, skew

_CHUNK = 512  # frames solved at once: bounds the memory
_EXACT = 1e-5  # metres; a frame whose points are this near has nothing to gain
_STALLED = 1e-4  # a step that saves a smaller share of the cost is the last
_DAMPING = 1e-3, 1e-9, 1e2  # square metres: first, least, and the one at which a frame gives up


def refine(
    skeleton: Skeleton,
    targets: Tensor,
    weights: Tensor,
    root: Tensor,
    rotations: Tensor,
    *,
    hold: float,
    clamp: Callable[[Tensor], Tensor],
    iterations: int,
) -> tuple[Tensor, Tensor]:
    """Bring the points of each frame nearer to their targets.

    Minimises, frame by frame, the sum of weight times squared distance, plus `hold` times the
    squared angle of each joint from where it started: what the points leave open stays.

    Parameters
    ----------
    targets : (n, points, 3) metres.
    weights : (n, points).
    root, rotations : (n, 3) metres and (n, joints, 3, 3), where to start.
    hold : square metres per square radian.
    clamp : brings local rotations (n, joints, 3, 3) inside their limits.
    iterations : at most this many; a frame that has arrived stops earlier.

    Returns
    -------
    root, rotations : like the given ones.
    """
    mask = moved_by(skeleton)
    done = []
    for chunk in zip(*(x.split(_CHUNK) for x in (targets, weights, root, rotations)), strict=True):
        search = _Search(skeleton, mask, *chunk, hold, clamp)
        for _ in range(iterations):
            if not len(search.busy):
                break
            search.step()
        done.append((search.root, search.rotations))
    return torch.cat([root for root, _ in done]), torch.cat([turns for _, turns in done])


def moved_by(skeleton: Skeleton) -> Tensor:
    """Bool (points, joints): whether turning the joint moves the point."""
    mask = torch.zeros(skeleton.points, skeleton.joints, dtype=torch.bool)
    for point, parent in enumerate(skeleton.point_parents):
        if parent >= 0:
            mask[point] = mask[parent]
            mask[point, parent] = True
    return mask


def normal_equations(
    places: Tensor, gaps: Tensor, weights: Tensor, mask: Tensor
) -> tuple[Tensor, Tensor]:
    """J'WJ and J'W gap of the points, for the unknowns [root shift, turn of each joint].

    places, gaps : (n, points, 3) metres, where the points are, and from there to their targets.
    weights : (n, points).
    mask : (points, joints), from `moved_by`.

    Returns (n, size, size) and (n, size), where size = 3 + 3 joints.
    """
    n, joints = len(places), mask.shape[1]
    eye = torch.eye(3).to(places)
    levers = (places[:, :, None] - places[:, None, :joints]) * mask[..., None]
    weighted = levers * weights[:, :, None, None]
    # Joints i and j: the sum over points of w [l_i]x' [l_j]x = w ((l_i · l_j) I - l_j l_i').
    products = (levers.flatten(2).mT @ weighted.flatten(2)).reshape(n, joints, 3, joints, 3)
    dots = products.diagonal(dim1=2, dim2=4).sum(-1)
    turns = dots[:, :, None, :, None] * eye[:, None] - products.transpose(2, 4)
    matrix = places.new_zeros(n, 3 + 3 * joints, 3 + 3 * joints)
    matrix[:, 3:, 3:] = turns.reshape(n, 3 * joints, 3 * joints)
    matrix[:, :3, :3] = weights.sum(1)[:, None, None] * eye
    shift_turn = skew(-weighted.sum(1)).transpose(1, 2).reshape(n, 3, 3 * joints)
    matrix[:, :3, 3:] = shift_turn
    matrix[:, 3:, :3] = shift_turn.mT
    pull = (weights[..., None] * gaps).sum(1)
    torque = torch.linalg.cross(weighted, gaps[:, :, None].expand_as(weighted)).sum(1)
    return matrix, torch.cat([pull, torque.flatten(1)], dim=1)


class _Search:
    """Where the search of a chunk of frames stands. `busy` are the frames still under way."""

    def __init__(self, skeleton, mask, targets, weights, root, rotations, hold, clamp) -> None:
        self.skeleton, self.mask, self.hold, self.clamp = skeleton, mask, hold, clamp
        self.targets, self.weights, self.start = targets, weights, rotations
        self.root, self.rotations = root.clone(), clamp(rotations)
        self.damping = torch.full_like(root[:, 0], _DAMPING[0])
        frames = torch.arange(len(root))
        self.cost = self._cost(frames, self.root, self.rotations)
        self.busy = frames[self.cost > _EXACT**2 * weights.sum(1)]

    def step(self) -> None:
        """One step of every busy frame, kept where it makes the frame better."""
        busy = self.busy
        shift, turn = self._proposal()
        root = self.root[busy] + shift
        rotations = self.clamp(roma.rotvec_to_rotmat(turn) @ self.rotations[busy])
        cost = self._cost(busy, root, rotations)
        better = cost < self.cost[busy]
        saved = self.cost[busy] - cost
        won = busy[better]
        self.root[won], self.rotations[won] = root[better], rotations[better]
        self.cost[won] = cost[better]
        _, least, most = _DAMPING
        self.damping[busy] *= torch.where(better, 0.2, 10.0)
        self.damping.clamp_(min=least)
        going = torch.where(better, saved > _STALLED * cost, self.damping[busy] < most)
        self.busy = busy[going]

    def _proposal(self) -> tuple[Tensor, Tensor]:
        """Shift of the root (busy, 3), and turn vectors of the joints in their parents' frames."""
        rotations, start = self.rotations[self.busy], self.start[self.busy]
        places, world = place(self.skeleton, self.root[self.busy], rotations)
        gaps = self.targets[self.busy] - places
        matrix, pull = normal_equations(places, gaps, self.weights[self.busy], self.mask)
        # Joints in the world's axes, from their parents'.
        above = torch.eye(3).to(world).expand_as(world).clone()
        above[:, 1:] = world[:, list(self.skeleton.parents[1:])]
        away = roma.rotmat_to_rotvec(rotations @ start.mT)
        pull[:, 3:] -= self.hold * (above @ away[..., None]).flatten(1)
        ridge = self.damping[self.busy, None].expand_as(pull).clone()
        ridge[:, 3:] += self.hold
        matrix.diagonal(dim1=1, dim2=2).add_(ridge)
        step = torch.cholesky_solve(pull[..., None], torch.linalg.cholesky(matrix))[..., 0]
        return step[:, :3], (above.mT @ step[:, 3:].reshape(*away.shape, 1))[..., 0]

    def _cost(self, frames: Tensor, root: Tensor, rotations: Tensor) -> Tensor:
        places, _ = place(self.skeleton, root, rotations)
        apart = (places - self.targets[frames]).square().sum(-1)
        away = roma.rotmat_to_rotvec(rotations @ self.start[frames].mT)
        return (self.weights[frames] * apart).sum(-1) + self.hold * away.square().sum((-1, -2))
