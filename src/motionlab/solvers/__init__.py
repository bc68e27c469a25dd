"""Searching: what a trained model must have had in mind, or must do, for something to come true."""

from ..feet.lock import lock_feet
from .denoise import Denoised, NoiseLevels, denoise
from .initial_state import initial_state

__all__ = ["Denoised", "NoiseLevels", "denoise", "initial_state", "lock_feet"]
