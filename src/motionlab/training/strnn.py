"""How an STRNN is trained: windows of body-frame features, noise that shrinks, three stages in one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import torch
from tqdm import tqdm

from ..encodings import BodyFrame, JointAngles, Normalizer
from ..errors import TrainingError
from ..models import BidirectionalRnn, Strnn
from ..models.strnn import ALONE, BEHIND, FIRST
from .prepared import Prepared
from .presets import BEST, LAST, Preset
from .windows import Windows


@lru_cache(maxsize=1)  # a model is made, and then trained and validated, on the same rows
def in_body_frame(data: Prepared) -> Prepared:
    """The same clips as rows of `BodyFrame`, with contacts, and their own normaliser.

    They keep the hash of the data that they are made of.

    Raises
    ------
    TrainingError : rows of `RootRelative`, from which no rotations can be told.
    """
    if isinstance(data.encoding, BodyFrame):
        return data
    if not isinstance(data.encoding, JointAngles):
        raise TrainingError(
            f"STRNN learns from BodyFrame features; the data are {type(data.encoding).__name__}, "
            "which no rotations can be told from. `motionlab prepare` one of the data sets."
        )
    encoding = BodyFrame(data.encoding.skeleton, data.encoding.fps)
    clips = tqdm(
        data.features.split(data.lengths.tolist()), "rows of the body's frame", unit="clip",
        leave=False, delay=2,
    )  # fmt: skip
    rows = [encoding.encode(data.motion(clip)) for clip in clips]
    learned = [clip for clip, split in zip(rows, data.splits, strict=True) if split == "train"]
    return replace(
        data, features=torch.cat(rows), encoding=encoding, normalizer=Normalizer.fit(learned)
    )


@dataclass(frozen=True)
class StrnnPreset(Preset):
    """Settings of a training of STRNN; `frames` are those that are read and those that are foretold.

    Hybrid training has three stages: all but the residual network learns, then the residual network
    by itself, then the residual network behind the others, which stay as they are. The learning rate
    rises and falls in each. Paper, section 4.2.4.
    """

    predict: int = 20
    """Frames that are foretold."""
    spatial: bool | str = True
    """Encode and decode frames part by part; "dense": by layers that know no parts."""
    residual: bool = True
    """A network over all frames that were said takes jumps out."""
    conditional: bool = True
    """Decoder and predictor hear themselves, and not, in training, the true frames."""
    backward: bool = True
    """The decoder says the last frame first."""
    smooth: float = 0.0
    """w_s: what mean squared second differences cost. 0 is the paper's MSE, more its LH."""
    penalty: float = 0.0
    """What mean squares of weights and codes cost; 0.01 in the paper."""
    bones: float = 0.0
    """What squared errors of bone lengths cost, by cm²; not in the paper."""
    drop: float = 0.1
    """Share of units of the spatial network that are dropped."""
    quiet: int = 0
    """Updates in which the noise shrinks to nothing; 0: it stays."""
    alone: int = 0
    """Updates of the second stage, just before the third; 0: there are no stages."""
    behind: int = 0
    """Updates of the third stage, the last of all."""
    final: bool = False
    """Whether the last weights are kept and not those that were best in validation, which may be
    from before the residual network has learned anything."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.predict < self.frames:
            raise TrainingError(
                f"predict is {self.predict}; of the {self.frames} frames of a window at least one must "
                "be foretold and at least one read."
            )
        if self.quiet < 0 or min(self.alone, self.behind) < 0:
            raise TrainingError(f"quiet, alone and behind must not be negative: {self}.")
        if self.partial and (not self.residual or self.updates <= self.alone + self.behind):
            raise TrainingError(
                f"Of {self.updates} updates the residual network is to have {self.alone} alone and "
                f"{self.behind} behind the others: there must be such a network (residual), and "
                "updates before."
            )

    @property
    def partial(self) -> bool:
        """Whether it is trained in stages."""
        return self.alone + self.behind > 0

    @property
    def weights(self) -> str:
        """The file that a training is for."""
        return LAST if self.final else BEST

    def stage(self, update: int) -> int:
        """`FIRST`, `ALONE` or `BEHIND`, of an update counted from 0."""
        last = self.updates - self.behind
        return BEHIND if update >= last else ALONE if update >= last - self.alone else FIRST

    def rate(self, update: int) -> float:
        """Learning rate of an update, counted from 0; with stages it rises and falls in each."""
        stage, later = self.stage(update), self.updates - self.behind
        begin, end = {
            FIRST: (0, later - self.alone), ALONE: (later - self.alone, later),
            BEHIND: (later, self.updates),
        }[stage]  # fmt: skip
        decay = self.decay if stage == FIRST else (end - begin) // 3
        rise = (update - begin + 1) / (self.warmup + 1)
        fall = (end - update) / (decay + 1)
        return self.learning_rate * min(1.0, rise, fall) * self.shrink ** (update - begin)

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of the body's frame of a split."""
        return Windows(in_body_frame(data).clips(split), self.frames)

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """Noise on what is read, the seed of what is dropped, and the stage. What the residual network
        alone learns to take away does not shrink."""
        stage, left = self.stage(update), 1.0
        if self.quiet and stage != ALONE:
            left = max(0.0, 1 - update / self.quiet)
        noise = left * self.noise * torch.randn(shape, generator=generator)
        found = {"noise": noise, "lots": torch.randint(2**31, shape[:1], generator=generator)}
        return found | ({"stage": torch.full(shape[:1], stage)} if self.partial else {})

    def model(self, data: Prepared) -> Strnn:
        """An untrained network for some data."""
        data = in_body_frame(data)
        return Strnn(
            data.encoding, data.normalizer, self.width, self.frames - self.predict, self.predict,
            spatial=self.spatial, residual=self.residual, conditional=self.conditional,
            drop=self.drop, smooth=self.smooth, penalty=self.penalty, backward=self.backward,
            bones=self.bones,
        )  # fmt: skip


@dataclass(frozen=True)
class BidirectionalPreset(StrnnPreset):
    """Settings of a training of the bidirectional RNN, STRNN's rival under the same scheme."""

    def model(self, data: Prepared) -> BidirectionalRnn:
        """An untrained network for some data."""
        data = in_body_frame(data)
        return BidirectionalRnn(
            data.encoding, data.normalizer, self.width, self.frames - self.predict, self.predict,
            smooth=self.smooth, penalty=self.penalty,
        )  # fmt: skip


# Composite_20_20_HY. smoke: seconds, for tests. table: the equal budget of all rows of a comparison.
# ship: what is shipped. paper: as the paper has it; how long an iteration is, in which the noise
# shrinks by a hundredth of what it was, is not said there.
_TABLE = StrnnPreset(
    updates=6_000, decay=1_500, batch=32, frames=40, validate_every=500, width=128, noise=0.1,
    smooth=0.1, quiet=3_000, alone=500, behind=1_000,
)  # fmt: skip
_STRNN = {
    "smoke": replace(
        _TABLE, updates=40, decay=5, batch=8, validate_every=10, width=32, warmup=5, quiet=10,
        alone=10, behind=10,
    ),
    "table": _TABLE,
    "ship": replace(
        _TABLE, updates=40_000, decay=16_000, validate_every=1_000, width=256, quiet=43_000,
        alone=2_000, behind=6_000, bones=0.1, final=True,
    ),
    "paper": replace(
        _TABLE, updates=500_000, decay=0, width=512, validate_every=5_000, optimizer="adadelta",
        learning_rate=1.0, warmup=0, smooth=1.0, penalty=0.01, quiet=100_000, alone=50_000,
        behind=50_000,
    ),
}  # fmt: skip


def _changed(**changes) -> dict[str, StrnnPreset]:
    """The same presets for another row of the ablation, without stages and with the paper's costs."""
    changes = {"alone": 0, "behind": 0, "bones": 0.0, **changes}
    return {name: replace(preset, **changes) for name, preset in _STRNN.items()}


_TEMPORAL = {"spatial": False, "residual": False}
PRESETS = {
    "strnn": _STRNN,
    "strnn-composite": _changed(smooth=0.0),
    "strnn-spatiotemp": _changed(residual=False),
    "strnn-temporal": _changed(**_TEMPORAL),
    # what is shipped: the residual network behind a Temporal, which learns faster than with parts
    "strnn-temporal-hy": {name: replace(preset, spatial=False) for name, preset in _STRNN.items()},
    "bidirectional-rnn": {
        name: BidirectionalPreset(**vars(preset)) for name, preset in _changed(**_TEMPORAL).items()
    },
    **{
        f"strnn-temporal-{40 - predict}-{predict}": _changed(
            **_TEMPORAL, smooth=0.0, predict=predict
        )
        for predict in (1, 5, 10, 20)
    },
    **{
        f"strnn-{half}-{half}": {
            name: replace(preset, frames=2 * half, predict=half) for name, preset in _STRNN.items()
        }
        for half in (10, 5)
    },
}
