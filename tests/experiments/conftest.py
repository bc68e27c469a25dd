"""Scripts of experiments/ as modules."""

import importlib
import sys
from pathlib import Path

import pytest

from motionlab.training import prepare

FOLDER = Path(__file__).parents[2] / "experiments"


@pytest.fixture(scope="session")
def experiment():
    """Import a script by its name, and with it what it imports from its folder."""

    def load(name):
        sys.path.insert(0, str(FOLDER))
        try:
            return importlib.import_module(name)
        finally:
            sys.path.remove(str(FOLDER))

    return load


@pytest.fixture(scope="session")
def gaits():
    """The data set "gaits", prepared."""
    return prepare("gaits")
