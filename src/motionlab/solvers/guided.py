"""Guided sampling: a network that walks by itself is pushed a little to where a path leads.

A path asks for a step ahead and a turn in each frame. What the root has done of late, as a slow
average, is set against it, and a small share of the difference, within bounds, is added to the means
of all components before one is drawn. That is all: the network sees that it turns and goes on
turning, with the lean and the steps that belong to it. It costs nothing and keeps the gait; it does
not keep to the path by the centimetre. (To multiply the mixture by a tight Gaussian around what is
asked instead ruins the gait: the whole body is then drawn from where the root's step says.)
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from ..encodings.path import turned
from ..models import LstmGmm
from ..models.noise import noise_to_draw, normal
from ..models.sampler import Chance, choose
from ..paths import Curves
from .energy import Before

SHARE = 0.5  # of what is missing, a frame
SLOW = 0.3  # seconds that averages forget in
LOOK, LEAST_LOOK = 0.6, 0.5  # seconds ahead, and metres at least, that are aimed at
TURN, PACE = 0.6, 0.6  # rad/s and m/s that a push adds at most, a frame's share of them
BEND = 3.0  # rad/s that is asked for at most
STANDING = 0.3  # m/s; who is slower goes no way


@dataclass
class Going:
    """Where characters are, and what they did of late.

    place : (batch, 3), x, z in metres and yaw in radians.
    velocity : (batch, 2) m/s over the ground, turn : (batch,) rad/s, slow averages.
    """

    fps: float
    place: Tensor
    velocity: Tensor
    turn: Tensor

    @classmethod
    def of(cls, fps: float, place: Tensor, recent: Tensor) -> Going:
        """From the last steps and turns `recent` (batch, frames, 3) that led to a place."""
        off, speed, turn = recently(recent.double(), fps)
        going = place[:, 2].double() + off
        velocity = speed[:, None] * torch.stack([going.sin(), going.cos()], 1)
        return cls(fps, place.double(), velocity, turn)

    def __getitem__(self, rows: Tensor) -> Going:
        return Going(self.fps, self.place[rows], self.velocity[rows], self.turn[rows])

    def bearing(self) -> Tensor:
        """Which way (batch,) they go, radians; who stands goes where he faces."""
        going = torch.atan2(self.velocity[:, 0], self.velocity[:, 1])
        return torch.where(self.velocity.norm(dim=1) < STANDING, self.place[:, 2], going)

    def bend(self, to: Tensor, speed: Tensor) -> Tensor:
        """Rad/s (batch,) of the arc of a circle from here, this way, through what is `to` (batch, 2)
        metres from here, at a speed (batch,)."""
        off = torch.atan2(to[:, 0], to[:, 1]) - self.bearing()
        off = torch.remainder(off + torch.pi, 2 * torch.pi) - torch.pi
        bend = 2 * (off.clamp(-1.5, 1.5)).sin() * speed / to.norm(dim=1).clamp(min=0.2)
        return bend.clamp(-BEND, BEND)

    def lacking(self, speed: Tensor, bend: Tensor) -> tuple[Tensor, Tensor]:
        """Metres ahead and radians (batch,) that the next frame should have more of.

        speed : (batch,) m/s and bend : (batch,) rad/s that are wanted.
        """
        pace = self.velocity.norm(dim=1)
        turn = (SHARE * (bend - self.turn)).clamp(-TURN, TURN) / self.fps
        return (SHARE * (speed - pace)).clamp(-PACE, PACE) / self.fps, turn

    def move(self, step: Tensor) -> None:
        """Go on by a frame's step to the left and ahead, and turn: (batch, 3)."""
        step = step.double()
        move = torch.stack([step[:, 0], torch.zeros_like(step[:, 0]), step[:, 1]], -1)
        moved = turned(move, self.place[:, 2])[:, [0, 2]]
        self.place = torch.cat(
            [self.place[:, :2] + moved, (self.place[:, 2] + step[:, 2])[:, None]], 1
        )
        keep = 1 / (SLOW * self.fps)
        self.velocity = self.velocity + keep * (self.fps * moved - self.velocity)
        self.turn = self.turn + keep * (self.fps * step[:, 2] - self.turn)


@dataclass
class Steering:
    """Where characters are on their paths, and what they should do.

    curves : the paths; which : (batch,), the path of each character.
    going : where they are, and how they go.
    arcs : (batch,), metres of path behind them.
    """

    curves: Curves
    which: Tensor
    going: Going
    arcs: Tensor

    @classmethod
    def after(
        cls, curves: Curves, which: Tensor, fps: float, place: Tensor, arcs: Tensor, recent: Tensor
    ) -> Steering:
        """From the last steps and turns `recent` (batch, frames, 3) that led to a place."""
        return cls(curves, which, Going.of(fps, place, recent), arcs.double())

    @property
    def place(self) -> Tensor:
        return self.going.place

    def push(self, speed: Tensor) -> tuple[Tensor, Tensor]:
        """Metres ahead and radians (batch,) that the next frame should have more of.

        speed : (batch,) m/s that is wanted.
        """
        look = (LOOK * speed).clamp(min=LEAST_LOOK)
        there = self.curves.at((self.arcs + look)[:, None], self.which)[:, 0]
        bend = self.going.bend(there - self.place[:, :2], speed)
        return self.going.lacking(speed, bend)

    def move(self, step: Tensor) -> None:
        """Go on by a frame's step to the left and ahead, and turn: (batch, 3)."""
        self.going.move(step)
        self.arcs = self.curves.onward(self.place[:, :2], self.arcs, self.which)


def recently(recent: Tensor, fps: float) -> tuple[Tensor, Tensor, Tensor]:
    """Which way (batch,) steps (batch, frames, 3) went, as seen from where they ended, in radians;
    how fast, m/s; and how fast they turned, rad/s."""
    yaw = -recent[..., 2].flip(1).cumsum(1).flip(1)  # before each step; after the last it is 0
    moves = torch.stack([recent[..., 0], torch.zeros_like(yaw), recent[..., 1]], -1)
    way = turned(moves, yaw).mean(1)
    return torch.atan2(way[:, 0], way[:, 2]), fps * way.norm(dim=1), fps * recent[..., 2].mean(1)


@torch.no_grad()
def guided(
    model: LstmGmm,
    before: Before,
    steering: Steering,
    arcs: Tensor,
    chance: Chance,
    push: bool = True,
) -> tuple[Tensor, Tensor]:
    """Motion that goes on from where it is along its path.

    Parameters
    ----------
    model : on `JointAngles`, whose first channels are step to the left, step ahead, turn.
    before : (batch), where it goes on.
    steering : the same characters, moved along.
    arcs : (batch, frames), metres of path that should lie behind them, frame by frame.
    chance : how frames are drawn.
    push : without it they are drawn freely.

    Returns
    -------
    The frames (batch, frames, kept) in normalised units, and what disturbed the network when it saw
    them (batch, frames, dim), in normalised units.
    """
    generator, temperature, component_temperature, disturbed, memory = chance
    mixture, state, std = model.predict(before.state), before.state, model.normalizer.std
    frames, disturbances = [], []
    last = steering.arcs
    for t in range(arcs.shape[1]):
        # what the timetable wants next, and a share of what is late or early
        due = (arcs[:, t] - last) + 0.1 * (last - steering.arcs)
        last = arcs[:, t]
        pushes = steering.push((due * model.fps).clamp(min=0)) if push else ()
        chosen = choose(mixture.log_weights / component_temperature, generator)
        rows = torch.arange(len(chosen))
        mean, deviation = mixture.means[rows, chosen], mixture.stds[rows, chosen]
        pushed = mean.clone()
        for channel, more in zip((1, 2), pushes, strict=False):
            pushed[:, model.normalizer.kept == channel] += (more.to(std) / std[channel])[:, None]
        noise = noise_to_draw(state.noise, deviation, memory, generator)
        seen = pushed + temperature * deviation * noise
        frame = model.normalizer.inverse(seen)
        frames.append(seen)
        disturbance = disturbed * normal(frame, generator) if disturbed else torch.zeros_like(frame)
        disturbances.append(disturbance)
        mixture, state = model.step(frame, state._replace(noise=noise), disturbance)
        steering.move(frame[:, :3])
    return torch.stack(frames, 1), torch.stack(disturbances, 1)
