"""Where steered characters are and how they go, calculated in numpy: `guided.Going` for sampled futures.

A frame of sixteen futures is fifty things to calculate, each next to nothing, and torch takes some
microseconds to begin with any of them, numpy a fraction.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from .guided import SLOW, STANDING, Going

WALKS = 0.9  # m/s; who is slower goes, to a part, where he faces
Angle = TypeVar("Angle", np.ndarray, Tensor)


def wrapped(angle: Angle) -> Angle:
    """From -π to π."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


class Rows:
    """Futures (rows,) of characters.

    place : (rows, 3), x, z in metres and yaw in radians.
    velocity : (rows, 2) m/s over the ground, turn : (rows,) rad/s, slow averages; pace : (rows,) m/s.
    """

    def __init__(
        self, fps: float, place: np.ndarray, velocity: np.ndarray, turn: np.ndarray
    ) -> None:
        self.fps, self.place, self.velocity, self.turn = fps, place, velocity, turn
        self.pace = np.sqrt((velocity * velocity).sum(1))

    @classmethod
    def of(cls, going: Going | Rows, count: int = 1) -> Rows:
        """Each character `count` times."""
        if isinstance(going, Rows):
            return going
        parts = (part.numpy() for part in (going.place, going.velocity, going.turn))
        return cls(going.fps, *(part.repeat(count, 0) for part in parts))

    def going(self, rows: Tensor | slice = slice(None)) -> Going:
        """Some of them, as tensors."""
        parts = (torch.from_numpy(part) for part in (self.place, self.velocity, self.turn))
        return Going(self.fps, *(part[rows] for part in parts))

    def course(self) -> np.ndarray:
        """Which way (rows,) they go, radians. The slower, the more is it the way they face, and at a stand
        nothing else: or else who hardly moves takes a step aside for a turn."""
        yaw = self.place[:, 2]
        aside = wrapped(np.arctan2(self.velocity[:, 0], self.velocity[:, 1]) - yaw)
        return yaw + self.walks() * aside

    def walks(self) -> np.ndarray:
        """How much (rows,) of a walk it is, from 0, a stand, to 1."""
        return ((self.pace - STANDING) / (WALKS - STANDING)).clip(0, 1)

    def move(self, step: np.ndarray) -> None:
        """Go on by a frame's step to the left and ahead, and turn: (rows, 3)."""
        left, ahead, turn = step.astype(float).T
        yaw, keep = self.place[:, 2], 1 / (SLOW * self.fps)
        sine, cosine = np.sin(yaw), np.cos(yaw)
        moved = np.stack([left * cosine + ahead * sine, ahead * cosine - left * sine], 1)
        self.place = np.concatenate([self.place[:, :2] + moved, (yaw + turn)[:, None]], 1)
        self.velocity = self.velocity + keep * (self.fps * moved - self.velocity)
        self.turn = self.turn + keep * (self.fps * turn - self.turn)
        self.pace = np.sqrt((self.velocity * self.velocity).sum(1))
