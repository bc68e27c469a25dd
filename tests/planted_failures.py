"""Motions with a planted failure at a known time: positions (frames, points, 3) in and out."""

import torch

KINDS = ("freeze", "statue", "tremble")
ENDS = ("nan", "explosion", "speed", "shrinking", "sinking")


def plant(positions, kind, at, fps, seconds=8.0):
    """The motion up to second `at`, then the failure for `seconds`."""
    start, length = round(at * fps), round(seconds * fps)
    before, last = positions[:start], positions[start]
    time = torch.arange(length)[:, None, None] / fps
    held = last.expand(length, -1, -1)
    offset = held - held[:, :1]
    after = {
        "freeze": lambda: held,
        "statue": lambda: held + time * torch.tensor([0.5, 0.0, 1.0]),
        "tremble": lambda: held + 0.002 * torch.randn(held.shape, generator=_random()),
        "nan": lambda: torch.full_like(held, float("nan")),
        "explosion": lambda: held[:, :1] + offset * torch.exp(2 * time),
        "speed": lambda: held + 20 * time,
        "shrinking": lambda: held[:, :1] + offset * torch.exp(-time),
        "sinking": lambda: held - time * torch.tensor([0.0, 1.0, 0.0]),
    }[kind]()
    return torch.cat([before, after])


def pause(positions, at, seconds, fps):
    """The motion with one frame held for a while."""
    frame = round(at * fps)
    held = positions[frame].expand(round(seconds * fps), -1, -1)
    return torch.cat([positions[:frame], held, positions[frame:]])


def slowed(positions, factor):
    """The motion at a share of its speed, by linear interpolation."""
    count = int((len(positions) - 1) / factor) + 1
    when = (torch.arange(count) * factor).clamp(max=len(positions) - 1.001)
    before = when.floor().long()
    return torch.lerp(positions[before], positions[before + 1], (when - before)[:, None, None])


def _random():
    return torch.Generator().manual_seed(0)
