"""A network that learns to walk a little in two seconds, for tests of what is done with networks."""

from __future__ import annotations

import torch

from motionlab import Motion, datasets
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm


def tiny_clips(*names: str) -> list[Motion]:
    """Gaits by their names."""
    return [clip for clip in datasets.load("gaits") if clip.name in names]


def tiny_lstm(clips: list[Motion], width: int = 30, updates: int = 30) -> LstmGmm:
    """Trained on the clips (at least 40 frames each), with a start in each of them."""
    torch.manual_seed(0)
    encoding = JointAngles(clips[0].skeleton, clips[0].fps, contacts=True)
    rows = [encoding.encode(clip) for clip in clips]
    model = LstmGmm(encoding, Normalizer.fit(rows), width=width, components=3, skip=0.6)
    optimizer = torch.optim.Adam(model.parameters(), 3e-3)
    batch = torch.stack([row[:40] for row in rows])
    for _ in range(updates):
        optimizer.zero_grad()
        model.loss(batch, 0.05 * torch.randn_like(batch)).backward()
        optimizer.step()
    model.eval().requires_grad_(False)
    model.starts = model.observe(batch[:, :20])
    model.start_names = tuple(clip.name for clip in clips)
    return model
