"""Feet that were scaled to another body, put back on the ground and held still there.

A foot is planned as a path of its ankle and two orientations, of foot and toes. While its heel is
in contact the ankle rests, while its toes are the toe joint rests, while both are the foot lies
flat (`plant`). Heights are corrected stance by stance: floors of recordings lie too high, too low
or aslant.

A knee near straight turns 10 degrees for 3 mm of the leg's length, so legs are kept as stretched as
they were: of a foot that stands, the hips see to that; of one that only its toes hold, the heel
does, and of one in the air, the ankle (`let_go`). What a stance changes is carried over the swings,
from what the end of one asks for to what the beginning of the next one does (Kovar, Schreiner,
Gleicher: Footskate Cleanup for Motion Capture Editing, 2002), so that nothing jumps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from scipy.ndimage import binary_closing, distance_transform_edt, maximum_filter1d, minimum_filter1d
from torch import Tensor

from ..ik.turns import dot, shortest_turn, turn_about
from ..kinematics import yaw_matrix
from .flat import STEP, STILL, steps

# A part of a foot rests if it is slow: metres a second, and share of the body's speed, as markers
# on running feet slip;
_SPEED, _SLIP = 0.20, 0.05
# and low: metres above where it was lowest within so many seconds (heel, toes), which is more where
# it does not move at all;
_HEIGHT, _NEAR = (0.015, 0.020), 0.5
_STILL_HEIGHT = 0.06
# and if the foot is not tipped the other way: radians.
_TIPPED = 0.35
_SHORTEST = 2  # frames
# A stance begins later or ends earlier where it would take the ankle farther from its way than in
# the middle of it: a short foot cannot roll as far as a long one.
_STRAY = 0.025  # metres
_DIP = 0.015  # metres by which an ankle may lie lower than in a flat foot
TIP = 0.003  # metres that the tip of the toes stays above the floor
_ROLL, _ROUNDS = 0.5, 6  # radians that a heel may rise or sink about toes that are down
_CLEAR = 0.35  # radians that toes may go up lest they scrape the floor in a swing
_MENDED = 0.001  # metres that a leg is still too long or short when its heel has mended it
_GAP = 0.02  # metres by which a leg may be too long or short for toes to be down
_EASE = 0.15  # seconds in which a foot that left the floor, or comes to it, is let go of
_TURN = 0.5  # seconds in which a heel that rose or sank about toes on the floor turns back
_FORGOTTEN = 1.0  # seconds from a stance in which what it turned a flat foot by is forgotten
_UP = torch.tensor([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Sole:
    """A flat foot that faces +z."""

    toes: Tensor  # (3,) metres, from ankle to toe joint
    tip: Tensor  # (3,) metres, from toe joint to the tip of the toes
    heights: Tensor  # (2,) metres of ankle and toe joint above the floor


@dataclass(frozen=True)
class Foot:
    """One foot over time."""

    ankle: Tensor  # (frames, 3) metres
    foot: Tensor  # (frames, 3, 3) in the world; identity is a flat foot that faces +z
    toes: Tensor  # (frames, 3, 3) in the world
    contacts: Tensor  # (frames, 2) bool: heel, toe
    shift: Tensor  # (frames, 3) metres by which the ankle was moved
    sole: Sole

    @property
    def touches(self) -> Tensor:
        """Whether heel or toes are in contact, bool (frames,)."""
        return self.contacts.any(1)

    @property
    def reach(self) -> Tensor:
        """Way (frames, 3) in metres from ankle to toe joint."""
        return (self.foot @ self.sole.toes[:, None])[..., 0]

    @property
    def depth(self) -> Tensor:
        """Metres (frames,) by which the foot lies lower than it may, negative where it is higher.

        The toe joint never lies below where it is when the foot stands; an ankle may, a little,
        while the toes are up.
        """
        ankle, toe = self.ankle[:, 1], (self.ankle + self.reach)[:, 1]
        heights = self.sole.heights
        return torch.maximum(heights[0] - _DIP - ankle, heights[1] - toe)


def find_contacts(ankles: Tensor, toes: Tensor, feet: Tensor, speed: Tensor, fps: float) -> Tensor:
    """Contacts bool (2, frames, 2) of heel and toes of both feet: slow, and low.

    Low is told from the lowest in the neighbourhood: floors of recordings may be aslant. A foot
    that is held still in the air is told by the other one.

    Parameters
    ----------
    ankles, toes : (2, frames, 3) metres.
    feet : (2, frames, 3, 3), world orientations; identity is a flat foot that faces +z.
    speed : (frames,) of the body, metres a second.
    fps : frames per second.
    """
    points = torch.stack([ankles, toes], 2)
    height = points[..., 1]
    near = 2 * round(_NEAR * fps) + 1
    lowest = torch.from_numpy(minimum_filter1d(height.numpy(), near, axis=1))
    above, step = height - lowest, steps(points) * fps
    low = (above < torch.tensor(_HEIGHT)) | ((above < _STILL_HEIGHT) & (step < STILL))
    low &= height < lowest.flip(0) + STEP
    found = low & (step < (_SPEED + _SLIP * speed)[:, None])
    toes_up = torch.atan2(feet[..., 1, 2], feet[..., 1, 1])
    found[..., 0] &= toes_up > -_TIPPED
    found[..., 1] &= toes_up < _TIPPED
    found = found.numpy()
    for column in (found[foot, :, part] for foot in (0, 1) for part in (0, 1)):
        column |= binary_closing(column, np.ones(3))  # gaps of one or two frames
        for start, end in runs(column):
            if column[start] and end - start < min(_SHORTEST, len(column)):
                column[start:end] = False
    return torch.from_numpy(found)


def runs(values: np.ndarray) -> list[tuple[int, int]]:
    """Start and end of each run of equal values (n,) or equal rows (n, k)."""
    rows = values.reshape(len(values), -1)
    changes = np.flatnonzero((rows[1:] != rows[:-1]).any(1)) + 1
    edges = [0, *changes.tolist(), len(values)]
    return list(zip(edges[:-1], edges[1:], strict=True))


def plant(
    ankle: Tensor, foot: Tensor, toes: Tensor, contacts: Tensor, sole: Sole, fps: float
) -> Foot:
    """Hold a foot still while it is in contact.

    Parameters
    ----------
    ankle : (frames, 3) metres, its way as scaled from the source.
    foot, toes : (frames, 3, 3), world orientations; identity is a flat foot that faces +z.
    contacts : bool (frames, 2): heel, toe.
    fps : frames per second.

    Returns
    -------
    Foot : where it is in contact, and not below the floor; `let_go` sees to the rest of its way.
    """
    level = _level(foot, contacts)
    flat = contacts.all(1)
    foot = _carried(foot, level, flat, 1 - _loose(flat, fps, _FORGOTTEN))
    toes = _carried(toes, yaw_matrix(_yaw(foot)), contacts[:, 1])
    reach = (foot @ sole.toes[:, None])[..., 0]  # from ankle to toe joint
    shift, contacts = torch.zeros_like(ankle), contacts.clone()
    stances = [(a, b) for a, b in runs(contacts.any(1).numpy()) if contacts[a].any()]
    for start, end in stances:
        part = slice(start, end)
        held = _stance(contacts[part], reach[part], ankle[part], sole.heights)
        shift[part] = held - ankle[part]
        stray = (shift[part] - shift[part].median(0).values).norm(dim=-1)
        near = start + (stray < _STRAY).nonzero()[:, 0]
        if len(near):
            contacts[start : near[0]] = contacts[near[-1] + 1 : end] = False
    shift = bridged(shift, contacts.any(1))
    planted = Foot(ankle + shift, foot, toes, contacts, shift, sole)
    raised = planted.depth.clamp(min=0)[:, None] * _UP
    return replace(planted, ankle=planted.ankle + raised, shift=shift + raised)


def let_go(planted: Foot, hip: Tensor, stretch: Tensor, longest: float, fps: float) -> Foot:
    """A foot whose leg is as stretched as it should be, as far as contacts permit.

    About toes that are down the heel rises or sinks; toes that the leg does not reach then, of feet
    longer than this, are not in contact after all. In the air, the ankle comes nearer to the hip or
    goes away from it. Nothing lies below the floor then. From what a contact leaves to what is
    wanted the knee goes over a while, and its angle does, as near straight a millimetre is much.

    Parameters
    ----------
    planted : where it is in contact (`plant`).
    hip : (frames, 3) metres, where the leg starts.
    stretch : (frames,) metres that it should be long, from there to the ankle.
    longest : metres that it can be.
    fps : frames per second.
    """
    before = planted.ankle - planted.shift
    wanted = _bend(stretch, longest)
    roll, lost = _planned_roll(planted, hip, stretch, longest, fps)
    planted = replace(planted, contacts=planted.contacts & ~lost[:, None])
    touches = planted.touches
    on_toes = touches & ~planted.contacts[:, 0]
    roll = _faded(roll.where(on_toes, 0.0), touches, fps, _TURN)
    foot = replace(planted, foot=turn_about(planted.foot[..., 0], roll) @ planted.foot)
    ankle = before + bridged(planted.shift + planted.reach - foot.reach, touches)
    leg = ankle - hip
    length = leg.norm(dim=-1).clamp(min=1e-6)
    # and what contacts leave too short or too long is let go of after them, taken up before them
    left = _faded(_bend(length, longest) - wanted, touches, fps)
    ankle = hip + leg * (_length(wanted + left, longest) / length)[:, None]
    # toes that scrape the floor in a swing go up before the ankle does
    room = ankle[:, 1].clamp(min=float(foot.sole.heights[0] - _DIP)) - foot.sole.heights[1] + TIP
    clear = roma.rotmat_to_rotvec(off_the_floor(foot.foot, room, foot.sole.toes) @ foot.foot.mT)
    clear *= (_CLEAR / clear.norm(dim=-1, keepdim=True).clamp(min=_CLEAR)) * ~touches[:, None]
    foot = replace(foot, ankle=ankle, foot=roma.rotvec_to_rotmat(clear) @ foot.foot)
    ankle = ankle + foot.depth.clamp(min=0)[:, None] * _UP
    toes = off_the_floor(foot.toes, (ankle + foot.reach)[:, 1], foot.sole.tip)
    return replace(foot, ankle=ankle, toes=toes, shift=ankle - before)


def _planned_roll(
    foot: Foot, hip: Tensor, stretch: Tensor, longest: float, fps: float
) -> tuple[Tensor, Tensor]:
    """Angles (frames,) by which heels rise while toes are down, and where toes are lost (frames,).

    What heels on the floor leave too short or too long, and toes whose heel can't mend it, goes
    over to nothing beside them, so that no heel rises in one frame.
    """
    heels = foot.contacts[:, 0]
    on_toes = foot.touches & ~heels
    missing = _heel_roll(foot, hip, stretch)[1]
    far = (missing.abs() > _GAP) | (stretch - missing > longest)
    lost = on_toes & torch.from_numpy(maximum_filter1d(far.numpy(), 2 * round(_EASE * fps / 3) + 1))
    wanted = _bend(stretch, longest)
    reached = torch.where(heels, (foot.ankle - hip).norm(dim=-1), stretch - missing)
    fixed = heels | (on_toes & (missing.abs() > _MENDED))
    left = _faded(_bend(reached, longest) - wanted, fixed, fps)
    return _heel_roll(foot, hip, _length(wanted + left, longest))[0], lost


def _heel_roll(foot: Foot, hip: Tensor, stretch: Tensor) -> tuple[Tensor, Tensor]:
    """Angles (frames,) to the left about toe joints that stay, for the leg to be as stretched as
    wanted, and metres (frames,) that it is too short then."""
    axis, reach = foot.foot[..., 0], foot.reach
    toe, roll = foot.ankle + reach, torch.zeros(len(hip))
    # no heel sinks into the floor: it would take the toes along when it is lifted out of it
    length, down = reach.norm(dim=-1), -reach[:, 1]
    lowest = torch.minimum(foot.sole.heights[0] - _DIP - toe[:, 1], down)
    lowest = ((lowest / length).clamp(-1, 1).arcsin() - (down / length).arcsin()).clamp(min=-_ROLL)
    # From toe to ankle it goes along the axis and round it: still + cos ahead + sin aside.
    still = -dot(axis, reach, keepdim=True) * axis
    ahead, base, least = -reach - still, toe + still - hip, 0.1 * dot(reach, reach)
    aside = torch.linalg.cross(axis, ahead)
    for _ in range(_ROUNDS):  # Newton's method, damped where a turn hardly changes the length
        cosine, sine = roll.cos()[:, None], roll.sin()[:, None]
        leg = base + cosine * ahead + sine * aside
        length = dot(leg, leg).sqrt().clamp(min=1e-6)
        slope = dot(cosine * aside - sine * ahead, leg) / length
        step = (stretch - length) * slope / (slope**2 + least)
        roll = (roll + step).clamp(max=_ROLL).maximum(lowest)
    return roll, stretch - length


def _bend(length: Tensor, longest: float) -> Tensor:
    """How far (frames,) a leg so long is bent, in radians, if its two bones are alike."""
    return 2 * (length / longest).clamp(0, 1).arccos()


def _length(bend: Tensor, longest: float) -> Tensor:
    """Metres (frames,) that a leg is long which is so far bent."""
    return longest * (bend.clamp(min=0) / 2).cos()


def _faded(values: Tensor, known: Tensor, fps: float, seconds: float = _EASE) -> Tensor:
    """Values (frames,), known in some frames, that go over to zero beside these."""
    return bridged(values[:, None], known)[:, 0] * (1 - _loose(known, fps, seconds))


def _loose(touches: Tensor, fps: float, seconds: float) -> Tensor:
    """How free (frames,) a foot is, from 0 at its contacts to 1 so long away from them."""
    if not touches.any():
        return torch.ones(len(touches))
    away = torch.from_numpy(distance_transform_edt(~touches.numpy())).float()
    part = (away / (seconds * fps)).clamp(max=1)
    return part**2 * (3 - 2 * part)


def off_the_floor(toes: Tensor, height: Tensor, tip: Tensor) -> Tensor:
    """Toes (frames, 3, 3) pitched up where their tip would dip into the floor."""
    long = tip.norm()
    if long < TIP:
        return toes
    x, y, z = (sum(toes[:, i, k] * tip[k] for k in range(3)) / long for i in range(3))
    least = ((TIP - height) / long).clamp(-1, 0)
    level = (1 - least**2).sqrt() / (x * x + z * z).sqrt().clamp(min=1e-6)
    dips = y < least
    point, lifted = torch.stack([x, y, z], -1), torch.stack([x * level, least, z * level], -1)
    toes = toes.clone()
    toes[dips] = shortest_turn(point[dips], lifted[dips]) @ toes[dips]
    return toes


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


def _carried(
    orientations: Tensor, wanted: Tensor, where: Tensor, share: Tensor | None = None
) -> Tensor:
    """Orientations that are as wanted `where` (frames,) says, and change smoothly in between.

    share : (frames,) of what is changed elsewhere; all of it if None.
    """
    if not where.any():
        return orientations
    change = roma.rotmat_to_rotvec(orientations.mT @ wanted)  # in the foot's frame, as feet turn
    change = bridged(change, where)
    if share is not None:
        change = change * share[:, None]
    return orientations @ roma.rotvec_to_rotmat(change)


def bridged(values: Tensor, known: Tensor) -> Tensor:
    """Values (frames, k), known in some frames (frames,), eased from one to the next elsewhere."""
    where = np.flatnonzero(known.numpy())
    if len(where) == 0:
        return values
    frames = np.arange(len(values))
    after = np.searchsorted(where, frames).clip(max=len(where) - 1)
    before = (np.searchsorted(where, frames, side="right") - 1).clip(min=0)
    first, last = where[before], where[after]
    part = ((frames - first) / (last - first).clip(min=1)).clip(0, 1)
    part = torch.from_numpy(part**2 * (3 - 2 * part))[:, None].to(values)
    first, last = (values[torch.from_numpy(of)] for of in (first, last))
    return first + part * (last - first)
