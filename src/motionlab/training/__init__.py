"""From named motion to weights: prepare, train, keep checkpoints.

Data for training are one file (`prepared`), settings are a `Preset`, and what happens in between is
one loop (`loop.train`), or for a refiner a game (`adversarial.train_game`). Only the loop needs
lightning-fabric.
"""

from . import conv_autoencoder, dances, pfnn, presets, strnn
from .games import GAMES
from .prepared import Prepared, prepare
from .presets import Preset, build

# Of every model that can be trained, by its name.
PRESETS = presets.PRESETS | dances.PRESETS | pfnn.PRESETS | strnn.PRESETS | conv_autoencoder.PRESETS

__all__ = ["GAMES", "PRESETS", "Prepared", "Preset", "build", "prepare"]
