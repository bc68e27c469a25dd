"""What becomes of a drawn frame before the network sees it: bounds of bodies, the pose of who stands, and
a memory of steps for who glides.

A push may lead a network to where no data were, and there it runs on by itself: it was seen to glide
several times as fast as it was asked to, until it came apart. So a frame is kept to what bodies do,
and its step to what is asked and a stride's sway: whatever the network goes on from, it comes back as
it was asked to.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..encodings.normalizer import Normalizer
from ..feet.contacts import foot_points
from ..models import LstmGmm
from ..skeleton import Skeleton
from .energy import Before
from .guided import Going
from .live_going import Rows
from .run_up import pick_start

LIMIT = 4.0  # deviations of the data: few steps and turns lie beyond
SWAY, BRAKES = 0.4, 1.3  # m/s: that a stride sways; that is gone slower, sway aside: 3 m/s² or so
SWING, SLOWER = 1.2, 2.0  # the same of a turn, rad/s
ASIDE, BACK = 0.6, 0.2  # m/s at most: who is steered turns and goes ahead, and is not dragged
READY = 0.6  # m/s; who stops and is slower brings his feet together
DAMPED, PULLED = (
    0.6,
    0.15,
)  # shares a frame: of a body's moves, taken; of what lacks to a stand, given
SLIDES, RESTS = 0.5, (0.2, 0.5)  # share of their pace at which a foot rests at most; m/s of that
GLIDES = 0.3  # seconds without: a run's flight is shorter


class Steps(NamedTuple):
    """Where a root's step to the left, its step ahead and its turn are in a normalised frame.

    columns : of the three; mean, std : (3,) of them, raw units a frame; body : bool (kept,), the rest.
    """

    columns: list[int]
    mean: np.ndarray
    std: np.ndarray
    body: np.ndarray

    @classmethod
    def of(cls, normalizer: Normalizer) -> Steps:
        kept = normalizer.kept.numpy()
        columns = [int(np.flatnonzero(kept == channel)[0]) for channel in range(3)]
        return cls(columns, normalizer.mean[:3].numpy(), normalizer.std[:3].numpy(), kept > 2)

    def raw(self, seen: np.ndarray) -> np.ndarray:
        """Metres and radians (batch, 3) of frames (batch, kept)."""
        return seen[:, self.columns] * self.std + self.mean


def bounded(
    seen: np.ndarray, steps: Steps, going: Rows, speed: np.ndarray, bend: np.ndarray
) -> np.ndarray:
    """Frames (batch, kept), normalised, as near as a body can do them who is asked for this.

    going : before the frame; speed : (batch,) m/s and bend : (batch,) rad/s that are asked for.
    """
    seen = seen.clip(-LIMIT, LIMIT)
    left, ahead, turn = (steps.raw(seen) * going.fps).T  # a second
    most = (np.maximum(speed, going.pace - BRAKES) + SWAY).astype(seen.dtype)
    share = np.minimum(most / np.maximum(np.hypot(left, ahead), 1e-9), 1)
    most_turn = np.maximum(np.abs(bend), np.abs(going.turn) - SLOWER) + SWING
    most_turn = most_turn.astype(seen.dtype)
    root = (share * left).clip(-ASIDE, ASIDE), np.maximum(share * ahead, -BACK)
    root = np.stack([*root, turn.clip(-most_turn, most_turn)], 1)
    seen[:, steps.columns] = (root / going.fps - steps.mean) / steps.std
    return seen


def stand_of(model: LstmGmm) -> np.ndarray | None:
    """How people stand, normalised (kept,): the model's start of that name; None: it has none."""
    names = getattr(model, "start_names", ())
    if "stand" not in names:
        return None
    return model.normalizer(model.starts.frame[names.index("stand")]).numpy()


def stood(
    seen: np.ndarray, last: np.ndarray, body: np.ndarray, stand: np.ndarray | None
) -> np.ndarray:
    """Frames (batch, kept), normalised, of who comes to stand: their bodies move less than was drawn,
    and towards a stand, so that feet which a stop found a stride apart come together.

    last : the frames before; body : bool (kept,), what is no step and no turn.
    """
    moved = (1 - DAMPED) * (seen - last)
    if stand is not None:
        moved = moved + PULLED * (stand - last)
    return np.where(body, last + moved, seen)


def slowest_foot(positions: Tensor, skeleton: Skeleton, fps: float) -> Tensor:
    """Speed over the ground (..., frames - 1), m/s, of the part of the feet that moves least, from
    points (..., frames, points, 3)."""
    feet = positions[..., foot_points(skeleton), :][..., [0, 2]]
    return feet.diff(dim=-3).norm(dim=-1).amin(-1) * fps


class Gliding:
    """Who goes on without that a foot rests is reminded of how people step.

    The bounds keep a glide short and slow, but a network can't tell that it glides. What it remembers
    (h and C) is then that of one of its starts, the one of the nearest speed; the pose is left as it is,
    and as a frame keeps most of the one before, the body steps out of it in a third of a second.
    """

    def __init__(self, model: LstmGmm, characters: int) -> None:
        self.model = model
        self.frames = torch.zeros(characters, dtype=torch.long)  # that each has glided for
        self.reminded = [0] * characters

    def remind(self, slowest: Tensor, after: Before, going: Going) -> None:
        """What those remember who glide too long by now, in place.

        slowest : (characters, window), m/s of the part of their feet that moves least.
        after, going : where they are then.
        """
        rests = (SLIDES * going.velocity.norm(dim=1)).clamp(*RESTS)
        rested = (slowest < rests[:, None]).any(1)
        self.frames = torch.where(rested, 0, self.frames + slowest.shape[1])
        if self.model.starts is None:
            return
        for row in (self.frames >= GLIDES * going.fps).nonzero()[:, 0].tolist():
            start = self.start_for(row, going)
            after.state.hidden[row] = self.model.starts.hidden[start]
            after.state.cell[row] = self.model.starts.cell[start]
            self.frames[row] = 0
            self.reminded[row] += 1

    def start_for(self, row: int, going: Going) -> int:
        """Which of the model's starts a character is reminded of: the one nearest to his pace."""
        return pick_start(self.model, None, float(going.velocity[row].norm()))
