"""How a model is trained: every number that is not in the model or in the data."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import torch
from torch import nn

from ..errors import TrainingError
from ..models import LstmGmm, Refiner
from .checkpoints import load_weights
from .prepared import Prepared
from .run_on import run_on, running
from .windows import Windows

Optimizer = Literal["adam", "rmsprop", "sgd", "adadelta"]
BEST, LAST = "best.safetensors", "last.safetensors"


@dataclass(frozen=True)
class Preset:
    """Settings of a training by gradient descent.

    The learning rate rises over `warmup` updates, stays, and falls to zero over the last `decay`
    updates. What happens before the fall does not depend on the total: a training can be prolonged,
    or brought to its end, by starting it again with other `updates`.
    """

    updates: int
    """Total number of updates of the weights."""
    decay: int
    """Updates at the end in which the learning rate falls to zero."""
    batch: int
    """Windows in an update."""
    frames: int
    """Frames in a window."""
    validate_every: int
    """Updates from one validation, and checkpoint, to the next."""
    width: int = 512
    """Width of the hidden layers."""
    noise: float = 0.05
    """Standard deviation of the noise on the input frames, in normalised units."""
    optimizer: Optimizer = "adam"
    """Rule by which gradients become steps."""
    learning_rate: float = 1e-3
    """Largest learning rate."""
    warmup: int = 200
    """Updates in which the learning rate rises from zero."""
    shrink: float = 1.0
    """Factor on the learning rate each update, for schedules that fall from the beginning."""
    clip: float = 5.0
    """Largest norm of the gradient; what is longer is shortened to it."""
    snapshots: int = 0
    """Updates from one set of weights that is kept for good to the next; 0: none is."""
    seed: int = 0
    """Start of all chance: first weights, windows, noise."""

    def __post_init__(self) -> None:
        counts = ("updates", "batch", "frames", "validate_every", "width")
        if any(getattr(self, name) < 1 for name in counts) or self.frames < 2:
            raise TrainingError(f"{', '.join(counts)} must be 1 or more, frames 2 or more: {self}.")
        positive = self.learning_rate > 0 and self.clip > 0 and self.shrink > 0  # NaN is not
        if not (positive and self.warmup >= 0 and self.decay >= 0 and self.noise >= 0):
            raise TrainingError(
                "warmup, decay, noise must not be negative, learning_rate, clip and shrink be "
                f"positive: {self}."
            )
        if self.snapshots < 0 or self.snapshots % self.validate_every:
            raise TrainingError(
                f"snapshots is {self.snapshots}; weights are kept at validations only, so it must "
                f"be a multiple of validate_every, {self.validate_every}."
            )
        if self.optimizer not in get_args(Optimizer):
            raise TrainingError(
                f"optimizer is {self.optimizer!r}; use one of {', '.join(get_args(Optimizer))}."
            )
        if not 0 <= self.seed < 2**32:
            raise TrainingError(f"seed is {self.seed}; it must lie between 0 and 2**32.")

    def rate(self, update: int) -> float:
        """Learning rate of an update, counted from 0."""
        rise = (update + 1) / (self.warmup + 1)
        fall = (self.updates - update) / (self.decay + 1)
        return self.learning_rate * min(1.0, rise, fall) * self.shrink**update

    @property
    def weights(self) -> str:
        """The file that a training is for: the weights that were best in validation."""
        return BEST

    @property
    def partial(self) -> bool:
        """Whether there are updates in which a part of the network does not learn."""
        return False

    def windows(self, data: Prepared, split: str) -> Windows:
        """Where the windows of a split come from."""
        return Windows(data.clips(split), self.frames)

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """What the loss of an update takes beside its windows (batch, frames, dim)."""
        return {"noise": self.noise * torch.randn(shape, generator=generator)}

    def judged(self, shape: torch.Size) -> dict:
        """The same in validation, where there is no noise."""
        return {}

    def model(self, data: Prepared) -> nn.Module:
        """An untrained network for some data."""
        raise NotImplementedError


@dataclass(frozen=True)
class MixturePreset(Preset):
    """Settings of a training of the LSTM-GMM."""

    components: int = 5
    """Gaussians in the mixture."""
    skip: float = 0.9
    """Share of the present frame that goes straight into the means; the paper's is 0."""
    run_on: int = 0
    """Frames to which training clips that end in a run are brought by repeating their last strides
    (see `run_on.py`); 0: they end where the recording does."""
    runs: float = 0.0
    """Share of a batch's windows in which the body runs; 0: as many as there are."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.components < 1:
            raise TrainingError(f"components must be 1 or more: {self}.")
        if not 0 <= self.skip <= 1:
            raise TrainingError(f"skip is {self.skip}; it must lie between 0 and 1.")
        if self.run_on < 0 or not 0 <= self.runs < 1:
            raise TrainingError(
                f"run_on is {self.run_on}, runs {self.runs}; run_on must be 0 or more frames, and "
                "runs a share from 0 to below 1."
            )

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of a split; in training, with runs that go on."""
        clips, often = data.clips(split), None
        if split == "train" and self.run_on:
            clips = run_on(clips, data.encoding, data.normalizer, self.run_on)
        if split == "train" and self.runs:
            often = [running(clip, data.encoding) for clip in clips]
        return Windows(clips, self.frames, often, self.runs)

    def model(self, data: Prepared) -> LstmGmm:
        """An untrained network for some data."""
        return LstmGmm(data.encoding, data.normalizer, self.width, self.components, self.skip)


# smoke: seconds, for tests. table: the equal budget of all rows of a comparison. ship: what is
# shipped. paper: as the paper has it (300 epochs of about 200 updates; its widths are not known; it
# clips each entry of the gradient to 5, we its norm).
_LSTM_GMM = {
    "smoke": MixturePreset(
        updates=40, decay=10, batch=8, frames=16, validate_every=10, width=32, warmup=5
    ),
    "table": MixturePreset(
        updates=3_000, decay=600, batch=32, frames=64, validate_every=200, width=128
    ),
    "ship": MixturePreset(
        updates=10_000, decay=6_000, batch=32, frames=64, validate_every=200, width=256,
        learning_rate=4e-3, run_on=180, runs=0.2,
    ),
    "paper": MixturePreset(
        updates=60_000, decay=0, batch=20, frames=50, validate_every=1_000, optimizer="rmsprop",
        warmup=0, shrink=0.95 ** (1 / 200), skip=0.0,
    ),
}  # fmt: skip

# with contacts, but for the first; the last on what is free for commercial use: half as much, of
# which more updates learn by heart, and in which people stop so often that walks end in a shuffle
# unless the network learns to walk on from frames that are a little off
PRESETS = dict.fromkeys(("lstm-gmm", "lstm-gmm-contacts", "lstm-gmm-permissive"), _LSTM_GMM)
PRESETS["lstm-gmm-permissive"] = _LSTM_GMM | {
    "ship": replace(_LSTM_GMM["ship"], updates=4_000, decay=3_000, noise=0.15)
}


def build(data: Prepared, preset: Preset, start: Path | None = None) -> nn.Module:
    """The model to train: with weights drawn from the preset's seed, or those of a file.

    Raises
    ------
    TrainingError : the weights are of another model, or for other features than the data's.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(preset.seed)
        anew = preset.model(data)
    if start is None:
        return anew
    model, _ = load_weights(start)
    if isinstance(model, Refiner):
        raise TrainingError(f"{start}: is a refiner, which is trained by a game, not to predict.")
    if type(model) is not type(anew):
        kinds = type(model).__name__, type(anew).__name__
        raise TrainingError(
            f"{start}: holds the weights of a {kinds[0]}; this trains a {kinds[1]}."
        )
    if any(model.config().get(what) != anew.config().get(what) for what in ("encoding", "layout")):
        raise TrainingError(
            f"{start}: these weights are for features of another kind than the data."
        )
    return model
