"""How a foot looks that stands flat: told by the frames in which it rests.

Of the frames in which a foot is still, those are of a flat one in which ankle and toes together are
lowest: who stands on the toes has a higher heel, who stands on the heel has higher toes. A body has
one flat foot, so all its clips are asked together (`flat_pitch`); a dancer's are flat in few frames
of some clips, and in none of others.
"""

from __future__ import annotations

from collections.abc import Sequence

import roma
import torch
from torch import Tensor

from ..ik.turns import length

STILL = 0.15  # metres a second, of what does not move at all
STEP = 0.06  # metres by which what one foot stands on is higher than what the other does
# A flat foot points so many radians below the horizontal, and its toes so many down or up from
# where they are in a stance.
_FLAT, _NEAR_STANCE = (-0.25, 0.95), (-0.45, 0.25)
_LOWEST = 0.25, 0.005  # share of a clip's frames at rest that are lowest, and metres above these
_STEEPER = 0.25  # radians by which one foot, if not flat, is steeper than the other
_RESTED = 0.3  # seconds of standing that tell how a flat foot looks


def steps(points: Tensor) -> Tensor:
    """Distance (..., frames, points) to the frame before or after, whichever is nearer.

    What came to rest in a frame is at rest in it already. points : (..., frames, points, 3).
    """
    if points.shape[-3] == 1:
        return points.new_zeros(points.shape[:-1])
    step = length(points.diff(dim=-3))
    before = torch.cat([step[..., :1, :], step], dim=-2)
    return torch.minimum(before, torch.cat([step, step[..., -1:, :]], dim=-2))


def pitch_of(feet: Tensor) -> Tensor:
    """Radians (...,) by which toes of feet (..., 3, 3) point up; identity is one that faces +z."""
    return torch.atan2(feet[..., 1, 2], feet[..., 1, 1])


def levelled(
    feet: Tensor,
    ankles: Tensor,
    toes: Tensor,
    fps: float,
    stance: Tensor | None = None,
    flat: Tensor | None = None,
) -> Tensor:
    """Orientations (2, frames, 3, 3) of both feet, each pitched to be level where it stands flat.

    If how a flat foot looks is not known, the clip itself is asked; if it doesn't tell, both are level
    where they are so in the stance, or stay as they are. flat : (2,) radians by which toes of flat
    feet point up in these orientations; other parameters as for `resting`.
    """
    if flat is None:
        flat = torch.zeros(2) if stance is None else stance
        own = flat_pitch([resting(feet, ankles, toes, fps, stance)], fps)
        flat = flat if own is None else flat + own
    turn = torch.zeros(2, 1, 3)
    turn[:, 0, 0] = flat
    return feet @ roma.rotvec_to_rotmat(turn)


def resting(
    feet: Tensor, ankles: Tensor, toes: Tensor, fps: float, stance: Tensor | None = None
) -> list[Tensor]:
    """Of both feet how toes point in those frames of a clip in which they may be flat.

    A foot that stands still tells how a flat one looks, unless it stands on its toes or its heel: it
    must point as a flat one can, and nearly as in the stance where that is known.

    Parameters
    ----------
    feet : (2, frames, 3, 3), world orientations; identity is a flat foot that faces +z.
    ankles, toes : (2, frames, 3) metres.
    fps : frames per second.
    stance : (2,) radians by which toes point up in these orientations while the body stands.

    Returns
    -------
    list of two Tensor : radians (frames,) by which toes point up, from where they do in the stance.
    """
    way = toes - ankles
    down = torch.asin((-way[..., 1] / way.norm(dim=-1).clamp(min=1e-6)).clamp(-1, 1))
    off, height = pitch_of(feet), (ankles + toes)[..., 1] / 2
    still = (steps(torch.stack([ankles, toes], 2)) * fps < STILL).all(2)
    still &= toes[..., 1] < toes[..., 1].flip(0) + STEP
    still &= (down > _FLAT[0]) & (down < _FLAT[1])
    if stance is not None:
        off = off - stance[:, None]
        still &= (off > _NEAR_STANCE[0]) & (off < _NEAR_STANCE[1])
    found = []
    for its, rests, high in zip(off, still, height, strict=True):
        if rests.any():
            share, more = _LOWEST
            rests = rests & (high <= high[rests].quantile(share) + more)
        found.append(its[rests])
    return found


def flat_pitch(clips: Sequence[Sequence[Tensor]], fps: float) -> Tensor | None:
    """Radians (2,) by which the toes of flat feet point up, as all clips of a body tell together.

    A foot that is steeper than the other, or never stands so, is flat as the other one is.

    Parameters
    ----------
    clips : of each what `resting` gives.
    fps : of these; None is returned if neither foot stands long enough.
    """
    if not clips:
        return None
    least = round(_RESTED * fps)
    seen: list[Tensor | None] = []
    for foot in zip(*clips, strict=True):
        if sum(map(len, foot)) < least:
            seen.append(None)
            continue
        # a clip that stands for long counts no more than others: it may do so on the toes
        each = [its.sort().values[_evenly(len(its), least)] for its in foot]
        seen.append(torch.cat(each).quantile(0.5, interpolation="higher"))
    for i, (own, other) in enumerate((seen, seen[::-1])):
        if other is not None and (own is None or own < other - _STEEPER):
            seen[i] = other
    return None if seen[0] is None else torch.stack(seen)


def _evenly(frames: int, most: int) -> Tensor:
    """Indices of so many frames at most, at even distances."""
    return torch.linspace(0, max(frames - 1, 0), min(frames, most)).round().long()
