"""Levenberg-Marquardt on joint rotations, a batch of frames at a time.

The unknowns are a shift of the root and a small turn of every joint, in world axes. `tree_step`
finds the step for them.
"""

from __future__ import annotations

from collections.abc import Callable

import roma
import torch
from torch import Tensor
from tqdm import tqdm

from ..skeleton import Skeleton
from .tree_step import tree_step
from .turns import place

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
    done = []
    chunks = zip(*(x.split(_CHUNK) for x in (targets, weights, root, rotations)), strict=True)
    with tqdm(total=len(targets), desc="solving", unit="frame", leave=False, delay=5) as bar:
        for chunk in chunks:
            search = _Search(skeleton, *chunk, hold, clamp)
            for _ in range(iterations):
                if not len(search.busy):
                    break
                search.step()
            done.append((search.root, search.rotations))
            bar.update(len(search.root))
    return torch.cat([root for root, _ in done]), torch.cat([turns for _, turns in done])


class _Search:
    """Where the search of a chunk of frames stands. `busy` are the frames still under way."""

    def __init__(self, skeleton, targets, weights, root, rotations, hold, clamp) -> None:
        self.skeleton, self.hold, self.clamp = skeleton, hold, clamp
        self.targets, self.weights, self.start = targets, weights, rotations
        self.root, self.rotations = root.clone(), clamp(rotations)
        self.damping = torch.full_like(root[:, 0], _DAMPING[0])
        frames = torch.arange(len(root))
        self.cost = self._cost(frames, self.root, self.rotations)
        self.exact = _EXACT**2 * weights.sum(1)
        self.busy = frames[self.cost > self.exact]

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
        self.busy = busy[going & (self.cost[busy] > self.exact[busy])]

    def _proposal(self) -> tuple[Tensor, Tensor]:
        """Shift of the root (busy, 3), and turn vectors of the joints in their parents' frames."""
        rotations, start = self.rotations[self.busy], self.start[self.busy]
        places, world = place(self.skeleton, self.root[self.busy], rotations)
        # Joints in the world's axes, from their parents'.
        above = torch.eye(3).to(world).expand_as(world).clone()
        above[:, 1:] = world[:, list(self.skeleton.parents[1:])]
        away = roma.rotmat_to_rotvec(rotations @ start.mT)
        damping = self.damping[self.busy]
        shift, turns = tree_step(
            self.skeleton,
            places,
            self.targets[self.busy] - places,
            self.weights[self.busy],
            -self.hold * (above @ away[..., None])[..., 0],
            turning=damping + self.hold,
            shifting=damping,
        )
        return shift, (above.mT @ turns[..., None])[..., 0]

    def _cost(self, frames: Tensor, root: Tensor, rotations: Tensor) -> Tensor:
        places, _ = place(self.skeleton, root, rotations)
        apart = (places - self.targets[frames]).square().sum(-1)
        away = roma.rotmat_to_rotvec(rotations @ self.start[frames].mT)
        return (self.weights[frames] * apart).sum(-1) + self.hold * away.square().sum((-1, -2))
