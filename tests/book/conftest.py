"""The tools in book/ import each other as scripts do: by name, from their own folder."""

import importlib
import sys
from pathlib import Path

import pytest

BOOK = Path(__file__).parents[2] / "book"


@pytest.fixture(scope="session")
def tool():
    """A tool of the book by its name."""
    for package in ("nbclient", "myst_nb"):
        pytest.importorskip(package)

    def load(name):
        sys.path.insert(0, str(BOOK))
        try:
            return importlib.import_module(name)
        finally:
            sys.path.remove(str(BOOK))

    return load
