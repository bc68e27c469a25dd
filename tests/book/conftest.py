"""The tools in book/ import each other as scripts do: by name, from their own folder."""

import importlib
import importlib.util
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


@pytest.fixture(scope="session")
def extension():
    """An extension of Sphinx in book/_ext by its name, which may be that of another module."""

    def load(name):
        for package in ("sphinx", "bs4"):
            pytest.importorskip(package)
        spec = importlib.util.spec_from_file_location(name, BOOK / "_ext" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return load
