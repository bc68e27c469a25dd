"""What is asked of steered characters: a speed and a way, a place, or a path; and what that means now.

A wish is turned into two numbers a frame, a speed over the ground and a bend, in rad/s, that a body
can do: nobody is asked for more than the data's fastest, nor to turn at a run as fast as at a walk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..paths import Curves
from .guided import LEAST_LOOK, LOOK, STANDING, Going
from .live_going import Rows, wrapped

GAIN = 3.0  # rad/s that are asked for a radian off the way
BEND, SIDEWAYS = 3.0, 5.0  # rad/s, and m/s² across the way, at most
SLOWED, SHARP = 1.5, 1.0  # m/s at most for who is more than so many radians off his way
HURRY = 0.8  # m/s more than they go, as an average of 0.3 s has it: people gain 3 m/s² or less
STARTS = 0.5  # m/s; who is slower, and more than SHARP off, turns before he goes
STILL = 0.15  # m/s; who is asked for less is asked to stand
ON_THE_SPOT, NEAR = 0.5, 0.35  # radians off beyond which, and on to which, who stands turns
BRAKE, THERE = 1.0, 0.15  # 1/s, speed a metre before a place; m from it, where one stands
STEPS = 0.4  # m/s that are asked for at least until there: a slower stride stops halfway
BEHIND = 2.6  # radians off, beyond which left and right are as good: the side that is begun stays


@dataclass
class Aim:
    """Of each character (batch,): what he should do from now on.

    speed : (batch,) m/s; direction : (batch,) radians, 0 is +z, π/2 is +x.
    target : (batch, 2) metres, x and z, where to go and stand; NaN: none, the direction counts.
    curves : paths to go along; which : (batch,), the path of each, -1: none.
    arcs : (batch,), metres of it behind him.
    lengths : (paths,) metres, where he stands in the end.
    """

    speed: Tensor
    direction: Tensor
    target: Tensor
    which: Tensor
    arcs: Tensor
    curves: Curves | None = None
    lengths: Tensor | None = None

    @classmethod
    def none(cls, going: Going) -> Aim:
        """To go on as they go; who hardly moves, to stand: a stander's sway is no wish to creep."""
        pace, nowhere = going.velocity.norm(dim=1), torch.full_like(going.velocity, torch.nan)
        pace, nobody = torch.where(pace < STANDING, 0.0, pace), torch.full((len(pace),), -1)
        return cls(pace, going.bearing(), nowhere, nobody, torch.zeros_like(pace))

    def __getitem__(self, rows: Tensor) -> Aim:
        each = (self.speed, self.direction, self.target, self.which, self.arcs)
        return Aim(*(part[rows] for part in each), self.curves, self.lengths)

    def wanted(
        self, going: Going | Rows, ahead: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Speed (batch,) m/s, bend (batch,) rad/s, and radians off the way (batch,), as of now.

        going : where the characters are; ahead : seconds since the arcs were true.
        """
        going = Rows.of(going)
        speed, way, bend = self._way(going, ahead)
        off = wrapped(way - going.course())
        begun = np.abs(going.turn) > 0.2
        off = np.where((np.abs(off) > BEHIND) & begun, np.abs(off) * np.sign(going.turn), off)
        still = speed < STILL
        facing = wrapped(way - going.place[:, 2])
        on_the_spot = np.abs(facing) > np.where(np.abs(going.turn) > 0.5, NEAR, ON_THE_SPOT)
        off = np.where(still, facing * on_the_spot, off)
        sharp = (np.abs(off) > SHARP) & ~still
        speed = np.where(sharp, np.minimum(speed, SLOWED), speed)
        speed = np.minimum(speed, np.maximum(going.pace + HURRY, 2 * STILL))
        speed = np.where(sharp & (going.pace < STARTS), np.minimum(speed, 2 * STILL), speed)
        most = np.minimum(SIDEWAYS / np.maximum(going.pace, 0.1), BEND)
        bend = np.where(np.isnan(bend) | still, GAIN * off, bend)
        return speed, bend.clip(-most, most), off

    def _way(self, going: Rows, ahead: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Speed, way and, of those on a path, bend (batch,); else NaN."""
        to = self.target.numpy() - going.place[:, :2]
        far, speed, way = np.hypot(*to.T), self.speed.numpy(), self.direction.numpy()
        near = np.where(far < THERE, 0.0, np.maximum(BRAKE * far, STEPS))
        aimed = np.isfinite(far)
        speed = np.where(aimed, np.minimum(speed, near), speed)
        way = np.where(aimed & (far > THERE), np.arctan2(*to.T), way)
        bend = np.full_like(way, np.nan)
        if self.curves is not None and (self.which >= 0).any():
            led = self.which >= 0
            # as far on as they went since: at the speed that is asked, who stands short of an end
            # would be there within each window, and be told to stand
            which = self.which.clamp(min=0)
            arcs = self.arcs + torch.from_numpy(ahead * going.pace)
            left = (self.lengths[which] - arcs).numpy()
            slow = np.where(left < THERE, 0.0, np.maximum(BRAKE * left, STEPS))
            led = led.numpy()
            speed = np.where(led, np.minimum(speed, slow), speed)
            look = torch.from_numpy((LOOK * speed).clip(min=LEAST_LOOK))
            now = going.going()
            there = self.curves.at((arcs + look)[:, None], which)[:, 0] - now.place[:, :2]
            way = np.where(led, np.arctan2(*there.numpy().T), way)
            bend = np.where(led, now.bend(there, torch.from_numpy(speed)).numpy(), bend)
        return speed, way, bend

    def onward(self, going: Going) -> None:
        """Whoever goes along a path has come so far on it."""
        led = self.which >= 0
        if self.curves is not None and led.any():
            which, places = self.which[led], going.place[led, :2]
            self.arcs = self.arcs.clone()
            self.arcs[led] = self.curves.onward(places, self.arcs[led], which)
