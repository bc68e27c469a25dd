"""What becomes of a drawn frame before the network sees it: bounds of bodies, the pose of who stands, and
a memory of steps for who glides.

A push may lead a network to where no data were, and there it runs on by itself: it was seen to glide
several times as fast as it was asked to, until it came apart. So a frame is kept to what bodies do,
and its step to what is asked and a stride's sway: whatever the network goes on from, it comes back as
it was asked to.
"""

from __future__ import annotations

import torch
from torch import Tensor

from ..encodings.normalizer import Normalizer
from ..feet.contacts import foot_points
from ..models import LstmGmm
from .energy import Before
from .guided import Going
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
RESTS, GLIDES = 0.5, 0.3  # m/s of a foot at most; seconds without: a run's flight is shorter


def bounded(
    seen: Tensor, columns: list[int], normalizer: Normalizer, going: Going, speed: Tensor, bend: Tensor
) -> Tensor:  # fmt: skip
    """Frames (batch, kept), normalised, as near as a body can do them who is asked for this.

    columns : those of the step to the left, the step ahead and the turn.
    going : before the frame; speed : (batch,) m/s and bend : (batch,) rad/s that are asked for.
    """
    mean, std, fps = normalizer.mean[:3], normalizer.std[:3], going.fps
    seen = seen.clamp(-LIMIT, LIMIT)
    left, ahead, turn = (seen[:, columns] * std + mean).mul(fps).unbind(1)  # a second
    pace = going.velocity.norm(dim=1)
    most = (torch.maximum(speed, pace - BRAKES) + SWAY).to(seen)
    share = (most / torch.hypot(left, ahead).clamp(min=1e-9)).clamp(max=1)
    most_turn = (torch.maximum(bend.abs(), going.turn.abs() - SLOWER) + SWING).to(seen)
    root = (share * left).clamp(-ASIDE, ASIDE), (share * ahead).clamp(min=-BACK)
    root = torch.stack([*root, turn.clamp(-most_turn, most_turn)], 1)
    seen[:, columns] = (root / fps - mean) / std
    return seen


def stand_of(model: LstmGmm) -> Tensor | None:
    """How people stand, normalised (kept,): the model's start of that name; None: it has none."""
    names = getattr(model, "start_names", ())
    if "stand" not in names:
        return None
    return model.normalizer(model.starts.frame[names.index("stand")])


def stood(seen: Tensor, last: Tensor, body: Tensor, stand: Tensor | None) -> Tensor:
    """Frames (batch, kept), normalised, of who comes to stand: their bodies move less than was drawn,
    and towards a stand, so that feet which a stop found a stride apart come together.

    last : the frames before; body : bool (kept,), what is no step and no turn.
    """
    moved = (1 - DAMPED) * (seen - last)
    if stand is not None:
        moved = moved + PULLED * (stand - last)
    return torch.where(body, last + moved, seen)


class Gliding:
    """Who goes on without that a foot rests is reminded of how people step.

    The bounds keep a glide short and slow, but a network can't tell that it glides. What it remembers
    (h and C) is then that of one of its starts, the one of the nearest speed; the pose is left as it is,
    and as a frame keeps most of the one before, the body steps out of it in a third of a second.
    """

    def __init__(self, model: LstmGmm, characters: int) -> None:
        self.model, self.feet = model, foot_points(model.encoding.skeleton)
        self.frames = torch.zeros(characters, dtype=torch.long)  # that each has glided for
        self.reminded = [0] * characters

    def remind(self, frames: Tensor, before: Tensor, after: Before, going: Going) -> None:
        """What those remember who glide too long by now, in place.

        frames : (characters, window, dim), raw units, and those before them (characters, dim).
        after, going : where they are then.
        """
        rows = torch.cat([before[:, None], frames], 1)
        feet = self.model.encoding.positions(rows, points=frozenset(self.feet))[:, :, self.feet]
        moved = feet[..., [0, 2]].diff(dim=1).norm(dim=-1).amin(-1) * going.fps
        rested = (moved < RESTS).any(1)
        self.frames = torch.where(rested, 0, self.frames + frames.shape[1])
        if self.model.starts is None:
            return
        for row in (self.frames >= GLIDES * going.fps).nonzero()[:, 0].tolist():
            start = pick_start(self.model, None, float(going.velocity[row].norm()))
            after.state.hidden[row] = self.model.starts.hidden[start]
            after.state.cell[row] = self.model.starts.cell[start]
            self.frames[row] = 0
            self.reminded[row] += 1
