"""Searching: what a trained model must have had in mind, or must do, for something to come true."""

from ..feet.lock import lock_feet
from .denoise import Denoised, NoiseLevels, denoise
from .denoise_rig import clean_recording
from .initial_state import initial_state

__all__ = ["Denoised", "NoiseLevels", "clean_recording", "denoise", "initial_state", "lock_feet"]
