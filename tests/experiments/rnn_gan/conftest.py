"""What tests of RNN-GAN share: gaits made ready for training."""

import pytest

from motionlab.training import prepare


@pytest.fixture(scope="session")
def gaits():
    """The data set "gaits", prepared."""
    return prepare("gaits")
