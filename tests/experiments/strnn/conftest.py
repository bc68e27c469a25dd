"""What the experiments on STRNN share: walks made ready."""

import pytest
import torch

import motionlab
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles, Normalizer
from motionlab.training import Prepared


@pytest.fixture(scope="module")
def walks():
    """Walks of five seconds as `prepare` makes them."""
    encoding = JointAngles(motionlab.Skeleton.canonical(), 30, contacts=True)
    make = lambda i: gaits.make(seconds=5, speed=1 + 0.1 * i, turn_rate=0.2 * (i % 3 - 1), seed=i)
    clips = [encoding.encode(make(i)) for i in range(8)]
    splits = ("train",) * 5 + ("val",) * 3
    return Prepared(
        torch.cat(clips), torch.tensor([len(clip) for clip in clips]),
        tuple(f"gaits/{i}" for i in range(8)), splits, encoding, Normalizer.fit(clips), "walks",
    )  # fmt: skip
