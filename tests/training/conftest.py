"""What the tests of training share: gaits made ready, and a training of a second."""

from dataclasses import replace

import pytest
import torch

from motionlab.training import PRESETS, build, prepare


@pytest.fixture(scope="session")
def gaits():
    """The data set "gaits", prepared."""
    return prepare("gaits")


@pytest.fixture(scope="session")
def smoke():
    """The preset, with another value here and there."""
    return lambda **other: replace(PRESETS["lstm-gmm-contacts"]["smoke"], **other)


@pytest.fixture
def train(gaits):
    """Train on gaits into a folder; gives the curve. One thread: sums in one order."""
    from motionlab.training import loop

    threads = torch.get_num_threads()
    torch.set_num_threads(1)

    def run(folder, preset, data=gaits, name="lstm-gmm-contacts", model=None, start=None):
        model = model or build(data, preset)
        return loop.train(model, data, preset, folder, name=name, start=start, accelerator="cpu")

    yield run
    torch.set_num_threads(threads)
