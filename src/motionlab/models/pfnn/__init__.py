"""The rival: a Phase-Functioned Neural Network, by its authors and trained here.

network = pfnn.load_authors()
motion, = pfnn.follow(network, [points], speed=1.2)
"""

from .authors import load_authors
from .following import follow
from .layout import Layout
from .network import Pfnn

__all__ = ["Layout", "Pfnn", "follow", "load_authors"]
