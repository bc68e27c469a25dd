"""Feet that were scaled to another body, put back on the ground and held still there.

A foot is planned as a path of its ankle and two orientations, of foot and toes. While its heel is
in contact the ankle rests, while its toes are the toe joint rests, while both are the foot lies
flat. What this changes is carried over the swings, from what the end of one stance asks for to what
the beginning of the next one does (Kovar, Schreiner, Gleicher: Footskate Cleanup for Motion Capture
Editing, 2002), so that nothing jumps. Heights are corrected stance by stance: floors of recordings
lie too high, too low or aslant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import roma
import torch
from scipy.ndimage import binary_closing, minimum_filter1d
from torch import Tensor

from ..ik.turns import shortest_turn
from ..kinematics import yaw_matrix

# A part of a foot rests if it is slow: metres a second, and share of the body's speed, as markers
# on running feet slip;
_SPEED, _SLIP = 0.20, 0.05
# and low: metres above where it was lowest within so many seconds (heel, toes), which is more where
# it does not move at all;
_HEIGHT, _NEAR = (0.015, 0.020), 0.5
_STILL, _STILL_HEIGHT = 0.15, 0.06
# and if the foot is not tipped the other way: radians.
_TIPPED = 0.35
_SHORTEST = 2  # frames
# A stance begins later or ends earlier where it would take the ankle farther from its way than in
# the middle of it: a short foot cannot roll as far as a long one.
_STRAY = 0.025  # metres
_DIP = 0.015  # metres by which an ankle may lie lower than in a flat foot
_TIP = 0.003  # metres that the tip of the toes stays above the floor
_RESTED = 0.3  # seconds of standing that tell how a flat foot looks


@dataclass(frozen=True)
class Foot:
    """One foot over time."""

    ankle: Tensor  # (frames, 3) metres
    foot: Tensor  # (frames, 3, 3) in the world
    toes: Tensor  # (frames, 3, 3) in the world
    contacts: Tensor  # (frames, 2) bool: heel, toe
    shift: Tensor  # (frames, 3) metres by which the ankle was moved


def find_contacts(ankle: Tensor, toes: Tensor, foot: Tensor, speed: Tensor, fps: float) -> Tensor:
    """Contacts bool (frames, 2) of heel and toes: slow, and low.

    Low is told from the lowest in the neighbourhood: floors of recordings may be aslant.

    Parameters
    ----------
    ankle, toes : (frames, 3) metres.
    foot : (frames, 3, 3), world orientations; identity is a flat foot that faces +z.
    speed : (frames,) of the body, metres a second.
    fps : frames per second.
    """
    points = torch.stack([ankle, toes], 1)
    height = points[..., 1].numpy()
    lowest = minimum_filter1d(height, 2 * round(_NEAR * fps) + 1, axis=0)
    above = torch.from_numpy(height - lowest)
    step = steps(points) * fps
    low = (above < torch.tensor(_HEIGHT)) | ((above < _STILL_HEIGHT) & (step < _STILL))
    found = low & (step < (_SPEED + _SLIP * speed)[:, None])
    toes_up = torch.asin(foot[:, 1, 2].clamp(-1, 1))
    found[:, 0] &= toes_up > -_TIPPED
    found[:, 1] &= toes_up < _TIPPED
    found = found.numpy()
    for column in found.T:
        column |= binary_closing(column, np.ones(3))  # gaps of one or two frames
        for start, end in runs(column):
            if column[start] and end - start < min(_SHORTEST, len(column)):
                column[start:end] = False
    return torch.from_numpy(found)


def steps(points: Tensor) -> Tensor:
    """Distance (..., frames, points) to the frame before or after, whichever is nearer.

    What came to rest in a frame is at rest in it already. points : (..., frames, points, 3).
    """
    if points.shape[-3] == 1:
        return points.new_zeros(points.shape[:-1])
    step = points.diff(dim=-3).norm(dim=-1)
    before = torch.cat([step[..., :1, :], step], dim=-2)
    return torch.minimum(before, torch.cat([step, step[..., -1:, :]], dim=-2))


def levelled(foot: Tensor, ankle: Tensor, toes: Tensor, fps: float) -> Tensor:
    """Orientations (frames, 3, 3) of a foot, pitched such that it is level while it stands still.

    Rest poses know little of how a foot stands. A foot that never rests stays as it is.
    """
    still = (steps(torch.stack([ankle, toes], 1)) * fps < _STILL).all(1)
    if int(still.sum()) < _RESTED * fps:
        return foot
    pitch = torch.asin(foot[still][:, 1, 2].clamp(-1, 1)).median()
    return foot @ roma.rotvec_to_rotmat(torch.stack([pitch, 0 * pitch, 0 * pitch]))


def runs(values: np.ndarray) -> list[tuple[int, int]]:
    """Start and end of each run of equal values (n,) or equal rows (n, k)."""
    rows = values.reshape(len(values), -1)
    changes = np.flatnonzero((rows[1:] != rows[:-1]).any(1)) + 1
    edges = [0, *changes.tolist(), len(values)]
    return list(zip(edges[:-1], edges[1:], strict=True))


def plant(
    ankle: Tensor,
    foot: Tensor,
    toes: Tensor,
    contacts: Tensor,
    sole: Tensor,
    tip: Tensor,
    heights: Tensor,
) -> Foot:
    """Hold a foot still while it is in contact.

    Parameters
    ----------
    ankle : (frames, 3) metres, its way as scaled from the source.
    foot, toes : (frames, 3, 3), world orientations; identity is a flat foot that faces +z.
    contacts : bool (frames, 2): heel, toe.
    sole : (3,) metres, from ankle to toe joint of a flat foot that faces +z.
    tip : (3,) metres, from toe joint to the tip of the toes.
    heights : (2,) metres of ankle and toe joint of a flat foot above the floor.
    """
    flat, toe_down = contacts.all(1), contacts[:, 1]
    level = _level(foot, contacts)
    foot = _carried(foot, level, flat)
    toes = _carried(toes, yaw_matrix(_yaw(foot)), toe_down)
    reach = (foot @ sole[:, None])[..., 0]  # from ankle to toe joint
    shift, contacts = torch.zeros_like(ankle), contacts.clone()
    stances = [(a, b) for a, b in runs(contacts.any(1).numpy()) if contacts[a].any()]
    for start, end in stances:
        part = slice(start, end)
        held = _stance(contacts[part], reach[part], ankle[part], heights)
        shift[part] = held - ankle[part]
        stray = (shift[part] - shift[part].median(0).values).norm(dim=-1)
        near = start + (stray < _STRAY).nonzero()[:, 0]
        if len(near):
            contacts[start : near[0]] = contacts[near[-1] + 1 : end] = False
    shift = bridged(shift, contacts.any(1))
    # The toe joint never lies below where it is when the foot stands, the tip never below the
    # floor; an ankle may, a little, while the toes are up.
    low = torch.stack([heights[0] - _DIP - ankle[:, 1], heights[1] - (ankle + reach)[:, 1]], 1)
    shift[:, 1] = shift[:, 1].maximum(low.amax(1))
    toes = off_the_floor(toes, (ankle + shift + reach)[:, 1], tip)
    return Foot(ankle + shift, foot, toes, contacts, shift)


def off_the_floor(toes: Tensor, height: Tensor, tip: Tensor) -> Tensor:
    """Toes (frames, 3, 3) pitched up where their tip would dip into the floor."""
    length = tip.norm()
    if length < _TIP:
        return toes
    point = (toes @ tip) / length
    least = ((_TIP - height) / length).clamp(-1, 0)
    level = (1 - least**2).sqrt() / point[:, [0, 2]].norm(dim=-1).clamp(min=1e-6)
    lifted = torch.stack([point[:, 0] * level, least, point[:, 2] * level], -1)
    return torch.where(
        (point[:, 1] < least)[:, None, None], shortest_turn(point, lifted) @ toes, toes
    )


def _stance(contacts: Tensor, reach: Tensor, ankle: Tensor, heights: Tensor) -> Tensor:
    """Way (frames, 3) of the ankle through one stance, near where it was."""
    held = torch.zeros_like(ankle)
    heel = toe = None
    for start, end in runs(contacts.numpy()):
        part = slice(start, end)
        if contacts[start, 0]:
            if heel is None:  # where it is on the floor follows from the toes, if they rest
                heel = torch.zeros(3) if toe is None else toe - reach[start]
            toe = heel + reach[start] if contacts[start, 1] else None
            held[part] = heel
        else:
            if toe is None:
                toe = torch.zeros(3) if heel is None else heel + reach[start]
            heel = None
            held[part] = toe - reach[part]
    held += (ankle - held).mean(0)
    held[:, 1] = torch.where(contacts[:, 0], heights[0], heights[1] - reach[:, 1])
    return held


def _level(foot: Tensor, contacts: Tensor) -> Tensor:
    """Flat foot orientations (frames, 3, 3), of one direction for each time the foot lies flat."""
    yaw = _yaw(foot)
    for start, end in runs(contacts.numpy()):
        part = yaw[start:end]
        yaw[start:end] = torch.atan2(part.sin().mean(), part.cos().mean())
    return yaw_matrix(yaw)


def _yaw(orientations: Tensor) -> Tensor:
    """Which way feet (frames, 3, 3) point, whatever their pitch: from their left."""
    return torch.atan2(-orientations[:, 2, 0], orientations[:, 0, 0])


def _carried(orientations: Tensor, wanted: Tensor, where: Tensor) -> Tensor:
    """Orientations that are as wanted `where` (frames,) says, and change smoothly in between."""
    if not where.any():
        return orientations
    change = roma.rotmat_to_rotvec(wanted @ orientations.mT)
    return roma.rotvec_to_rotmat(bridged(change, where)) @ orientations


def bridged(values: Tensor, known: Tensor) -> Tensor:
    """Values (frames, k), known in some frames (frames,), eased from one to the next elsewhere."""
    where = known.nonzero()[:, 0]
    if len(where) == 0:
        return values
    frames = torch.arange(len(values))
    after = torch.searchsorted(where, frames).clamp(max=len(where) - 1)
    before = (torch.searchsorted(where, frames, right=True) - 1).clamp(min=0)
    first, last = where[before], where[after]
    part = ((frames - first) / (last - first).clamp(min=1)).clamp(0, 1)
    part = (part**2 * (3 - 2 * part))[:, None].to(values)
    return values[first] + part * (values[last] - values[first])
