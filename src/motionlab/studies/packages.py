"""statsmodels, asked for where it is needed: it takes seconds to load, and comes with an extra."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from ..errors import StudyError


def statsmodels(module: str) -> ModuleType:
    """A module of statsmodels; raises StudyError that says how to get it."""
    try:
        return import_module(f"statsmodels.{module}")
    except ModuleNotFoundError as error:
        raise StudyError(
            "To analyse a study takes statsmodels: pip install 'motionlab[study]'."
        ) from error
