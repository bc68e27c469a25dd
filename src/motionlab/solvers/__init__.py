"""Searching: what a trained model must have had in mind, or must do, for something to come true."""

from ..feet.lock import lock_feet
from .initial_state import initial_state

__all__ = ["initial_state", "lock_feet"]
