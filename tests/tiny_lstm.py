"""Networks that learn to walk a little in a second, for tests of what is done with networks."""

from __future__ import annotations

import torch
from torch import Tensor

from motionlab import Motion, datasets
from motionlab.encodings import JointAngles, Normalizer, RootRelative
from motionlab.models import AcLstm, LstmGmm, auto_condition


def tiny_clips(*names: str) -> list[Motion]:
    """Gaits by their names."""
    return [clip for clip in datasets.load("gaits") if clip.name in names]


def tiny_lstm(clips: list[Motion], width: int = 30, updates: int = 30) -> LstmGmm:
    """Trained on the clips (at least 40 frames each), with a start in each of them."""
    torch.manual_seed(0)
    encoding = JointAngles(clips[0].skeleton, clips[0].fps, contacts=True)
    rows = [encoding.encode(clip) for clip in clips]
    model = LstmGmm(encoding, Normalizer.fit(rows), width=width, components=3, skip=0.6)
    noise = lambda batch: {"noise": 0.05 * torch.randn_like(batch)}
    return _trained(model, clips, rows, updates, noise)


def tiny_aclstm(
    clips: list[Motion], width: int = 30, updates: int = 30, staircase: bool = False
) -> AcLstm:
    """The same, of another kind and with other features."""
    torch.manual_seed(0)
    encoding = RootRelative(clips[0].skeleton, clips[0].fps, stature=1.54)
    rows = [encoding.encode(clip) for clip in clips]
    model = AcLstm(encoding, Normalizer.fit(rows), width, staircase=staircase)
    real = auto_condition(40, 5, 5)
    return _trained(model, clips, rows, updates, lambda _: {"real": real})


def _trained(model, clips: list[Motion], rows: list[Tensor], updates: int, extras):
    optimizer = torch.optim.Adam(model.parameters(), 3e-3)
    batch = torch.stack([row[:40] for row in rows])
    for _ in range(updates):
        optimizer.zero_grad()
        model.loss(batch, **extras(batch)).backward()
        optimizer.step()
    model.eval().requires_grad_(False)
    model.starts = model.observe(batch[:, :20])
    model.start_names = tuple(clip.name for clip in clips)
    return model
