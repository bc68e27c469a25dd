"""What the recurrent networks have in common besides their layers: rates, states, settings."""

from __future__ import annotations

from typing import Self

from torch import Tensor, nn

from .. import encodings
from ..encodings import Encoding, Normalizer
from .checks import as_features, check_normalizer, checked_features
from .familiar import Familiar, warn_of_strange
from .state import State


class Recurrent(nn.Module):
    """A network that reads features frame after frame and keeps what it knows in a `State`.

    An heir says in `_seen` what state features leave behind. Its memory has `layers` layers of
    `width` numbers; `settings` names the arguments that it was made with besides encoding and
    normaliser.
    """

    layers = 2
    settings: tuple[str, ...] = ("width",)
    familiar: Familiar | None = None  # what `motionlab.load` found with the weights

    def __init__(self, encoding: Encoding, normalizer: Normalizer, width: int) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.kept = width, len(normalizer.kept)

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    def zero_state(self, batch: int = 1) -> State:
        """The state of a network that has seen nothing; its frame is the mean frame."""
        mean = self.normalizer.mean
        memory = mean.new_zeros(batch, self.layers, self.width)
        return State(mean.expand(batch, -1), memory, memory)

    def observe(self, features: Tensor, *, doubt: bool = True) -> State:
        """The state after features (batch, frames, dim), or (frames, dim) for a batch of one.

        doubt : warn of what is like hardly anything that the network has learned, if `familiar`
            says what that is (see `models.familiar`).
        """
        features = as_features(self, features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        if doubt and self.familiar is not None:
            warn_of_strange(self, features, self.familiar)
        return self._seen(features)

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        kept = {name: getattr(self, name) for name in self.settings}
        return {"encoding": self.encoding.config(), "kept": self.kept, **kept}

    @classmethod
    def from_config(cls, config: dict) -> Self:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, config["kept"])
        return cls(encoding, normalizer, **{name: config[name] for name in cls.settings})
