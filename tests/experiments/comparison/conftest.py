"""What tests of the comparison share: procedural walks of which some frames are seen."""

import pytest
import torch

import motionlab
from experiments.comparison.begun import Begun
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles

SEEN = 60


@pytest.fixture(scope="session")
def walks():
    """Four walks of four seconds (4, 120, dim), in bends and straight."""
    encoding = JointAngles(motionlab.Skeleton.canonical(), 30, contacts=True)
    make = lambda i: gaits.make(seconds=4, speed=1 + 0.1 * i, turn_rate=0.3 * (i % 3 - 1), seed=i)
    return torch.stack([encoding.encode(make(i)) for i in range(4)]), encoding


@pytest.fixture(scope="session")
def begun(walks):
    rows, encoding = walks
    return Begun(rows[:, :SEEN], encoding)
