"""Marks of contact along frames: gaps and flickers mended, contacts numbered, the way to the next one."""

from __future__ import annotations

from functools import reduce
from operator import and_, or_

import torch
from torch import Tensor
from torch.nn.functional import pad

GAP, SHORTEST = 0.07, 0.1  # seconds: gaps that are filled, contacts that are too short to count


def clean(contacts: Tensor, fps: float) -> Tensor:
    """Contacts (..., frames, 2) without gaps and flickers."""
    gap, shortest = max(1, round(GAP * fps)), max(1, round(SHORTEST * fps))
    return _opened(closed(contacts, gap), shortest - 1)


def closed(marks: Tensor, most: int) -> Tensor:
    """Gaps of at most so many frames between two marks filled, along the frames (..., frames, 2).

    Closing of binary morphology: filled is where every window of one frame more has a mark.
    """
    frames = marks.shape[-2]
    beyond = pad(marks, (0, 0, most, most))
    near = reduce(or_, (beyond[..., i : i + frames + most, :] for i in range(most + 1)))
    return reduce(and_, (near[..., i : i + frames, :] for i in range(most + 1)))


def _opened(marks: Tensor, most: int) -> Tensor:
    """Runs of at most so many marks taken away; those at the ends may go on beyond, and stay."""
    return ~closed(~marks, most)


def resting(held: Tensor, still: Tensor) -> Tensor:
    """Contacts (..., frames, 2) in most of which a toe is still: from its first rest to its last.

    Labels by speed begin and end in the air. Where nothing slides, nothing is to be held there.
    """
    number, rests = numbered(held), held & still
    frames = torch.arange(held.shape[-2], device=held.device)[:, None].expand_as(number)
    none = torch.zeros_like(torch.cat([number[..., :1, :], number], dim=-2))
    most = none.scatter_add(-2, number, 2 * rests - held.long()) > 0
    first = none.scatter_reduce(
        -2, number, torch.where(rests, frames, held.shape[-2]), "amin", include_self=False
    )
    last = none.scatter_reduce(-2, number, torch.where(rests, frames, -1), "amax")
    within = (frames >= first.gather(-2, number)) & (frames <= last.gather(-2, number))
    return held & (within | ~most.gather(-2, number))


def longest(marks: Tensor, held: Tensor) -> Tensor:
    """Of the marks (..., frames, 2) in each contact of `held` the longest run, the first if there are two.

    A foot that was let go and taken up again a few frames later would be pulled to and fro.
    """
    run, number = numbered(marks), numbered(held)
    frames = torch.arange(held.shape[-2], device=held.device)[:, None].expand_as(number)
    none = torch.zeros_like(torch.cat([number[..., :1, :], number], dim=-2))
    counts = none.scatter_add(-2, run, torch.ones_like(run)).gather(-2, run)
    first = none.scatter_reduce(-2, run, frames, "amin", include_self=False).gather(-2, run)
    rank = (counts * held.shape[-2] - first) * marks
    best = none.scatter_reduce(-2, number, rank, "amax").gather(-2, number)
    return marks & (rank == best)


def numbered(held: Tensor) -> Tensor:
    """Which contact each frame (..., frames, 2) belongs to, from 1; 0 where there is none."""
    begins = held & ~torch.cat([torch.zeros_like(held[..., :1, :]), held[..., :-1, :]], dim=-2)
    return begins.long().cumsum(-2) * held


def distance(marks: Tensor, before: bool) -> Tensor:
    """Frames (..., frames, 2) from each frame to the last mark before it (or the next after it)."""
    frames = torch.arange(marks.shape[-2], device=marks.device)[:, None]
    if before:
        last = torch.where(marks, frames, -marks.shape[-2] * 4).cummax(-2).values
        return frames - last
    following = torch.where(marks, frames, marks.shape[-2] * 5).flip(-2).cummin(-2).values.flip(-2)
    return following - frames
