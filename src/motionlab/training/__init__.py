"""From named motion to weights: prepare, train, keep checkpoints.

Data for training are one file (`prepared`), settings are a `Preset`, and what happens in between is
one loop (`loop.train`). Only the loop needs lightning-fabric.
"""

from .prepared import Prepared, prepare
from .presets import PRESETS, Preset, build

__all__ = ["PRESETS", "Prepared", "Preset", "build", "prepare"]
