"""`Refiner.refine` of a few frames, calculated in numpy, for characters that are followed as they move.

The same network. One frame of one character is little to calculate in two hundred pieces, and torch
takes some microseconds to begin with any of them, numpy a fraction. What does not wait for the frame before
is calculated for all frames at once. Whole motions, gradients, other devices and other rotations than
vectors go the way of refiner.py.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from ..encodings.effectors import chain_ends, effector_chains
from .state import State
from .unchanged import made_of

if TYPE_CHECKING:
    from ..encodings import Normalizer
    from .refiner import Refiner

MOST = 8  # frames; torch, which knows of many, is faster with more
_TINY = 1e-6  # radians; a smaller angle is as good as its sine
# vector (3) to the matrix, row by row, that takes the cross product with it from the left
_CROSS = np.zeros((9, 3), np.float32)
_CROSS[[7, 2, 3], [0, 1, 2]], _CROSS[[5, 6, 1], [0, 1, 2]] = 1, -1


def step(refiner: Refiner, features: Tensor, state: State | None) -> tuple[Tensor, State] | None:
    """`Refiner.refine`, if it is asked for few frames of each motion, and for no gradient.

    Else, and if anything at all is wrong with what was given, None: refiner.py knows what to say.
    """
    if torch.is_grad_enabled():
        return None
    network = made_of(refiner, "step", lambda: _Step.of(refiner))
    with np.errstate(all="ignore"):  # as torch: who leaves all bounds is told by the numbers
        given = network and _arrays(refiner, features, state)
        if not given:
            return None
        refined, hidden, cell = (torch.from_numpy(part) for part in network(*given))
    return refined, State(features[:, -1], hidden[:, None], cell[:, None])


def _arrays(refiner: Refiner, features: Tensor, state: State | None) -> list[np.ndarray] | None:
    """Frames (batch, frames, dim) and the one before them (batch, dim), h and C (batch, width); None if
    they aren't sound."""
    if not torch.is_tensor(features) or features.ndim != 3 or not 1 <= features.shape[1] <= MOST:
        return None
    (batch, frames, _), dim, width = features.shape, refiner.encoding.dim, refiner.width
    if state is None:
        memory = torch.zeros(batch, 1, width)
        state = State(features[:, 0], memory, memory)
    elif not isinstance(state, State) or state.noise.shape[-1] or state.seen.shape[-1]:
        return None
    shapes = (batch, frames, dim), (batch, dim), (batch, 1, width), (batch, 1, width)
    given = features, state.frame, state.hidden, state.cell
    arrays = [_array_of(*pair) for pair in zip(given, shapes, strict=True)]
    if any(array is None for array in arrays):
        return None
    now, before, hidden, cell = arrays
    return [now, before, hidden[:, 0], cell[:, 0]]


def _array_of(tensor: Tensor, shape: tuple[int, ...]) -> np.ndarray | None:
    """A tensor's numbers, if it is such a tensor, and they are finite."""
    if tensor.shape != shape or not _plain(tensor) or tensor.requires_grad:
        return None
    array = tensor.numpy()
    return array if math.isfinite(array.sum()) else None


def _plain(tensor: Tensor) -> bool:
    return tensor.dtype == torch.float32 and tensor.device.type == "cpu"


class _Step:
    """The network's weights as arrays, and what it does with frames."""

    @classmethod
    def of(cls, refiner: Refiner) -> _Step | None:
        """None for a network that is not calculated here."""
        here = refiner.encoding.rotation == "vector" and all(map(_plain, refiner.parameters()))
        return cls(refiner) if here else None

    def __init__(self, refiner: Refiner) -> None:
        lstm, self.reach, self.slow = refiner.lstm, refiner.reach, refiner.slow
        self.normal, self.kept = _normal(refiner.normalizer), refiner.normalizer.kept.numpy()
        self.mean, self.effectors = _array(refiner.normalizer.mean), _normal(refiner.effectors)
        self.enter, self.leave = _product(refiner.enter[0]), _product(refiner.leave)
        self.aside = None if self.reach is None else _product(refiner.aside)
        # one product does for what comes in and for h, and one tanh for all four gates: that of the
        # others is sigmoid(x) = (1 + tanh(x / 2)) / 2
        weight = np.concatenate([_array(lstm.weight_ih_l0), _array(lstm.weight_hh_l0)], 1)
        bias = _array(lstm.bias_ih_l0) + _array(lstm.bias_hh_l0)
        half = np.repeat(np.float32([0.5, 0.5, 1, 0.5]), refiner.width)
        self.gates = np.ascontiguousarray((half[:, None] * weight).T), half * bias

        encoding = refiner.encoding
        self.fps, chains = encoding.fps, effector_chains(encoding.skeleton)
        self.levels, self.offsets = [*map(np.array, chains.levels)], _array(chains.offsets)
        pose = encoding.slices["pose"].start
        vectors = [[4, 4, 5], *([pose + 3 * (joint - 1) + k for k in range(3)]
                                for joint in chains.joints[1:])]  # fmt: skip
        self.vectors = np.array(vectors).ravel()  # columns; the second of the root's is no number
        self.mean_pose = _array(encoding.mean_pose[chains.joints])
        self.mean_pose[0] = np.eye(3)

    def __call__(
        self, now: np.ndarray, before: np.ndarray, hidden: np.ndarray, cell: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Refined frames (batch, frames, dim), h and C (batch, width) after them.

        now : (batch, frames, dim), raw units; before : (batch, dim), the frame before them.
        """
        shape, (mean, std) = now.shape, self.normal
        earlier = np.concatenate([before[:, None], now[:, :-1]], 1).reshape(-1, shape[2])
        now = now.reshape(-1, shape[2])  # (rows, dim): frame after frame of each
        normalized = (now[:, self.kept] - mean) / std
        entered = _through(self.enter, np.concatenate([normalized, *self._felt(now, earlier)], 1))
        entered = np.maximum(entered, 0).reshape(*shape[:2], -1)
        felt = [hidden]
        for t in range(shape[1]):
            gates = np.concatenate([entered[:, t], felt[-1]], 1)
            gates = np.tanh(_through(self.gates, gates)).reshape(shape[0], 4, -1)
            enter, keep, new, show = (gates[:, i] for i in range(4))
            cell = ((1 + keep) * cell + (1 + enter) * new) / 2
            felt.append((1 + show) * np.tanh(cell) / 2)
        was, after = (np.stack(part, 1).reshape(len(now), -1) for part in (felt[:-1], felt[1:]))
        refined = np.repeat(self.mean[None], len(now), 0)
        refined[:, self.kept] = (normalized + _through(self.leave, after)) * std + mean
        if self.reach is not None:
            refined[:, :3] = self._steps(now, was, after)
        return refined.reshape(shape), felt[-1], cell

    def _felt(self, now: np.ndarray, before: np.ndarray) -> list[np.ndarray]:
        """What the network sees of end effectors (rows, numbers), see `refiner._felt`."""
        mean, std = self.effectors
        moving = self._moving(now, before)  # (rows, effectors, 6)
        felt = [(moving.reshape(len(now), -1) - mean) / std]
        if self.slow is not None:
            felt.append(np.arcsinh(moving[:, :2, 3:] / np.float32(self.slow)).reshape(len(now), -1))
        return felt

    def _moving(self, now: np.ndarray, before: np.ndarray) -> np.ndarray:
        """End effectors (rows, effectors, 6) as `JointAngles.end_effectors` gives them."""
        both = np.concatenate([before, now]).T  # (dim, batch): kinematics take batches last
        local = turns_of(both.take(self.vectors, 0).reshape(-1, 3, both.shape[1]), self.mean_pose)
        points = chain_ends(local, self.levels, self.offsets)  # (effectors, 3, batch)
        points[:, 1] += both[3]
        count = len(now)
        before, now = points[..., :count], points[..., count:]
        x, z, turn = both[:3, count:]
        sine, cosine = np.sin(turn), np.cos(turn)
        moved = now.copy()  # less where they were, seen from here
        x, z = before[:, 0] - x, before[:, 2] - z
        moved[:, 0] -= x * cosine - z * sine
        moved[:, 1] -= before[:, 1]
        moved[:, 2] -= z * cosine + x * sine
        return np.concatenate([now, np.float32(self.fps) * moved], 1).transpose(2, 0, 1)

    def _steps(self, now: np.ndarray, hidden: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Steps and turns (rows, 3) of a tethered root, see `Refiner._steps`."""
        offsets = np.float32(self.reach) * np.tanh(
            _through(self.aside, np.concatenate([hidden, after]))
        )
        (x_before, x), (z_before, z) = offsets.T.reshape(2, 2, -1)
        turn = now[:, 2]
        sine, cosine = np.sin(turn), np.cos(turn)
        steps = now[:, :3].copy()
        steps[:, 0] += x * cosine + z * sine - x_before
        steps[:, 1] += z * cosine - x * sine - z_before
        return steps


def turns_of(vectors: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Rotations (joints, 3, 3, batch) of vectors (joints, 3, batch) from a mean (joints, 3, 3).

    The root, joint 0, tilts and does not turn: its vector has no y component, whatever it says.
    """
    vectors[0, 1] = 0
    angle = np.maximum(np.sqrt((vectors * vectors).sum(1)), np.float32(_TINY))
    part = 2 * (np.sin(angle / 2) / angle) ** 2  # (1 - cos) / angle²
    cross = _CROSS @ (vectors * (np.sin(angle) / angle)[:, None])
    turns = vectors[:, :, None] * (vectors * part[:, None])[:, None]
    cross[:, ::4] += np.cos(angle)[:, None]
    turns += cross.reshape(turns.shape)
    return (mean @ turns.reshape(len(mean), 3, -1)).reshape(turns.shape)


def _through(product: tuple[np.ndarray, np.ndarray], inputs: np.ndarray) -> np.ndarray:
    weight, bias = product
    return inputs @ weight + bias


def _product(layer: torch.nn.Linear) -> tuple[np.ndarray, np.ndarray]:
    """Weights (in, out), as the product reads them, and biases."""
    return np.ascontiguousarray(layer.weight.numpy(force=True).T), _array(layer.bias)


def _normal(normalizer: Normalizer) -> tuple[np.ndarray, np.ndarray]:
    kept = normalizer.kept
    return _array(normalizer.mean[kept]), _array(normalizer.std[kept])


def _array(tensor: Tensor) -> np.ndarray:
    return tensor.float().numpy(force=True).copy()
