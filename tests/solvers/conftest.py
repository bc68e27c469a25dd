"""A network in double precision, windows to go on with, and ways to walk."""

import pytest
import torch

from motionlab import datasets
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm, State
from motionlab.solvers.energy import Before


@pytest.fixture(scope="session")
def clips():
    return datasets.load("gaits", "val")[:2]


@pytest.fixture(scope="session")
def network(clips):
    """Untrained, but with components that differ, on features with contacts."""
    encoding = JointAngles(clips[0].skeleton, clips[0].fps, contacts=True)
    rows = [encoding.encode(clip) for clip in clips]
    torch.manual_seed(0)
    model = LstmGmm(encoding, Normalizer.fit(rows), width=12, components=3, skip=0.9)
    torch.nn.init.normal_(model.leave.weight, std=0.2)
    return model.double().eval().requires_grad_(False)


@pytest.fixture(scope="session")
def window(network, clips):
    """Two windows of six frames: what is before them, s and d."""
    rows = torch.stack([network.encoding.encode(clip)[:26] for clip in clips]).double()
    contacts = network.encoding.slices["contacts"]
    rows[:, 20:, contacts] = torch.tensor([0.0, 1.0])
    rows[:, 23:, contacts] = 1.0  # a left toe sets down
    chance = torch.Generator().manual_seed(1)
    noise = lambda like: 0.05 * torch.randn(like.shape, generator=chance, dtype=torch.double)
    state = network.observe(rows[:, :20])
    state = State(state.frame, state.hidden, state.cell)
    before = Before(state, rows[:, 19], torch.tensor([[1.0, 2.0, 0.5], [0.0, -1.0, 3.0]]).double())
    s = network.normalizer(rows[:, 20:])
    return before, s + noise(s), noise(rows[:, 20:])
