"""How acLSTM and its rivals are trained: on a few dances, at half their rate, turned every way.

Features of these data are `RootRelative`, at a higher rate (60 frames a second) than that of the
windows a network sees (30): every frame is the first of some window, and windows can be played a
little faster or slower than they were danced.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import torch
from torch import Tensor, nn

from .. import encodings
from ..encodings import Normalizer, RootRelative
from ..errors import TrainingError
from ..models import AcLstm, Erd, Seq2Seq, auto_condition
from ..models.erd import noise_schedule
from .prepared import DANCES, Prepared
from .presets import LAST, Preset

Method = Literal["lstm-3lr", "erd", "seq2seq"]
Feeding = Literal["teacher", "auto", "scheduled"]


def turned(features: Tensor, yaw: Tensor) -> Tensor:
    """Features (..., frames, 3 points) of `RootRelative`, of the motion turned by yaw (...), radians."""
    x, y, z = features.unflatten(-1, (-1, 3)).unbind(-1)
    cos, sin = yaw.cos()[..., None, None], yaw.sin()[..., None, None]
    return torch.stack([cos * x + sin * z, y, cos * z - sin * x], dim=-1).flatten(-2)


class DanceWindows:
    """Windows of clips of `RootRelative` features, at a rate of their own.

    Parameters
    ----------
    clips : list of (frames, dim), heights absolute.
    frames : length of a window.
    stride : frames of a clip from one frame of a window to the next; 2 from 60 to 30 a second.
    tempo : windows are drawn at 1 - tempo to 1 + tempo times the speed of the dance.
    turn : draw them turned by a yaw from all round the circle.

    Raises
    ------
    TrainingError : no clip is long enough.
    """

    def __init__(
        self, clips: Sequence[Tensor], frames: int, stride: float, tempo: float, turn: bool
    ) -> None:
        # A displacement is from the frame before: each window needs one frame more.
        self.frames, self.stride, self.tempo, self.turn = frames, stride, tempo, turn
        self.clips = [_with_path(clip) for clip in clips if len(clip) > self._span(1 + tempo)]
        if not self.clips:
            longest = max(map(len, clips), default=0)
            raise TrainingError(
                f"All {len(clips)} clips are shorter than a window of {frames} frames at every "
                f"{stride:g}th frame (the longest has {longest}); train on longer clips, or with "
                "fewer frames."
            )

    def draw(self, count: int, generator: torch.Generator) -> Tensor:
        """Windows (count, frames, dim): each clip as likely as any other, as in the paper's code."""
        which = torch.randint(len(self.clips), (count,), generator=generator).tolist()
        place, tempo, yaw = torch.rand(3, count, generator=generator)
        tempo = 1 + self.tempo * (2 * tempo - 1)
        windows = torch.stack(
            [
                self._cut(self.clips[i], float(p), float(t))
                for i, p, t in zip(which, place, tempo, strict=True)
            ]
        )
        return turned(windows, 2 * math.pi * yaw) if self.turn else windows

    def tiles(self, batch: int) -> list[Tensor]:
        """Windows (at most batch, frames, dim) one after the other, as they were danced."""
        windows = []
        for clip in self.clips:
            count = max(1, len(clip) // self._span(1))
            places = torch.linspace(0, 1, count) if count > 1 else torch.zeros(1)
            windows += [self._cut(clip, float(place), 1.0) for place in places]
        return list(torch.stack(windows).split(batch))

    def _span(self, tempo: float) -> int:
        """Frames of a clip, after its first, that a window at some tempo can reach."""
        return math.ceil(self.frames * self.stride * tempo)

    def _cut(self, clip: Tensor, place: float, tempo: float) -> Tensor:
        """The window (frames, dim) at a place from 0, the clip's first, to 1, its last."""
        step = self.stride * tempo
        at = place * (len(clip) - 1 - self.frames * step) + step * torch.arange(self.frames + 1)
        before = at.long().clamp(max=len(clip) - 2)
        rows = torch.lerp(clip[before], clip[before + 1], (at - before)[:, None])
        window = rows[1:].clone()
        window[:, [0, 2]] = rows[:, [0, 2]].diff(dim=0)
        return window


def _with_path(clip: Tensor) -> Tensor:
    """Features whose root displacements are summed to a path, which can be read at any time."""
    clip = clip.clone()
    clip[:, [0, 2]] = clip[:, [0, 2]].double().cumsum(0).to(clip)
    return clip


@dataclass(frozen=True)
class DancePreset(Preset):
    """Settings of a training of acLSTM or one of its rivals."""

    method: Method = "lstm-3lr"
    """The network. Of seq2seq the last quarter of a window is decoded."""
    fps: float = 30.0
    """Rate of the windows. 60 in the paper's text, 30 in its code."""
    feeding: Feeding = "auto"
    """Which inputs are recorded ones: all, u of u + v, or ever fewer by chance."""
    real: int = 5
    """u, recorded frames in a row."""
    fed: int = 5
    """v, fed-back frames in a row."""
    schedule: int = 1
    """Updates over which recorded inputs become fewer (scheduled), or noise more (erd)."""
    tempo: float = 0.1
    """Windows are played up to so much faster or slower."""
    turn: bool = True
    """Windows are turned by a random yaw."""
    trim: bool = False
    """Leave out the rest at both ends of a clip."""
    metres: bool = False
    """Feed features as they are, in metres, as the paper does, and not normalised."""
    staircase: bool = False
    """Each layer sees the one below it a frame late, as in the paper's code."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, choices in [("feeding", get_args(Feeding)), ("method", get_args(Method))]:
            if getattr(self, name) not in choices:
                raise TrainingError(
                    f"{name} is {getattr(self, name)!r}; use one of {', '.join(choices)}."
                )
        if not (0 < self.fps < math.inf and 0 <= self.tempo < 1 and self.schedule >= 1):
            raise TrainingError(
                f"fps must be positive, tempo from 0 to less than 1, schedule 1 or more: {self}."
            )
        auto_condition(1, self.real, self.fed)

    @property
    def weights(self) -> str:
        """The file that a training is for: the last weights. The next frame of another dance is
        foretold best long before the network knows how to dance."""
        return LAST

    def windows(self, data: Prepared, split: str) -> DanceWindows:
        """The windows of a split; of its clips as they are if they are for validation."""
        encoding = data.encoding
        if not isinstance(encoding, RootRelative) or encoding.height != "absolute":
            raise TrainingError(
                "These networks learn RootRelative features with absolute heights; the data are of "
                f"another kind ({type(encoding).__name__}). `motionlab prepare` one of their sets."
            )
        stride = encoding.fps / self.fps
        if stride < 1:
            raise TrainingError(
                f"The data have {encoding.fps:g} frames a second, the windows are to have "
                f"{self.fps:g}: motion is never upsampled here."
            )
        clips = data.clips(split)
        if self.trim:
            clips = [without_rest(clip, encoding.fps) for clip in clips]
        learning = split == "train"
        return DanceWindows(
            clips, self.frames, stride, self.tempo * learning, self.turn and learning
        )

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """What the loss of an update takes beside its windows (batch, frames, dim)."""
        progress = min(1.0, update / self.schedule)
        if self.method == "erd":  # noise on every second frame or so, ever more of it
            hit = torch.rand(shape[:2], generator=generator) < 0.5
            noise = noise_schedule(progress) * torch.randn(shape, generator=generator)
            return {"noise": noise * hit[..., None]}
        if self.feeding == "scheduled":
            real = torch.rand(shape[:2], generator=generator) < teacher_share(progress)
            real[:, 0] = True
            return {"real": real}
        return self.judged(shape)

    def judged(self, shape: torch.Size) -> dict:
        """The same in validation: the paper's pattern of recorded and fed-back frames, no noise."""
        if self.feeding != "auto":
            return {}
        return {"real": auto_condition(shape[1], self.real, self.fed).expand(shape[:2])}

    def model(self, data: Prepared) -> nn.Module:
        """An untrained network for some data."""
        encoding = encodings.from_config({**data.encoding.config(), "fps": self.fps})
        if self.method == "erd":
            return Erd(encoding, self.normalizer(data), self.width)
        if self.method == "seq2seq":
            return Seq2Seq(encoding, self.normalizer(data), self.width, seen=3 * self.frames // 4)
        return AcLstm(encoding, self.normalizer(data), self.width, staircase=self.staircase)

    def normalizer(self, data: Prepared) -> Normalizer:
        """That of the training windows, all ways round: x and z are alike then."""
        if self.metres:
            return Normalizer(data.encoding.dim)
        windows = replace(self, trim=False).windows(data, "train")
        rows = torch.cat(windows.tiles(1_000)).flatten(0, 1)
        if not self.turn:
            return Normalizer.fit([rows])
        quarters = math.pi / 2 * torch.arange(4)
        return Normalizer.fit(list(turned(rows.expand(4, -1, -1), quarters)))


def teacher_share(progress: float, k: float = 100.0) -> float:
    """Share of recorded inputs in scheduled sampling after some part of the training, 0 to 1.

    The inverse sigmoid of Bengio et al. (2015), from k / (k + 1) down to 1 / (k + 1).
    """
    return k / (k + k ** (2 * progress))


def without_rest(clip: Tensor, fps: float, least: float = 0.3) -> Tensor:
    """A clip (frames, dim) from where the body begins to move to where it stops.

    least : m/s, mean speed of the points over half a second, relative to the root, from which on
        a body counts as moving.
    """
    pose = clip[:, 3:].unflatten(-1, (-1, 3))
    speeds = pose.diff(dim=0).norm(dim=-1).mean(-1) * fps
    window = max(1, round(fps / 2))
    if len(speeds) < window:
        return clip
    moving = (speeds.unfold(0, window, 1).mean(-1) >= least).nonzero()[:, 0]
    if not len(moving):
        return clip
    return clip[int(moving[0]) : int(moving[-1]) + window + 1]


# ship: what is shipped. table: the equal budget of all rows of a comparison: updates, windows, and
# about as many parameters. paper: the paper's own.
_TABLE = DancePreset(
    updates=1_500, decay=0, batch=16, frames=100, validate_every=250, width=128, noise=0.0,
    learning_rate=1e-3, snapshots=500, schedule=1_500,
)  # fmt: skip
_PRESETS = {
    "smoke": DancePreset(
        updates=40, decay=0, batch=8, frames=20, validate_every=10, width=32, noise=0.0, warmup=5,
        schedule=40,
    ),
    "table": _TABLE,
    "ship": replace(_TABLE, updates=3_000, decay=1_000, width=192, snapshots=1_000),
    "paper": replace(
        _TABLE, updates=500_000, batch=32, validate_every=1_000, width=1024, learning_rate=1e-4,
        warmup=0, snapshots=10_000, fps=60.0, metres=True, schedule=500_000,
    ),
}  # fmt: skip


def _changed(width: float = 1, **changes) -> dict[str, DancePreset]:
    """The same presets for another method, some times as wide."""
    return {
        name: replace(preset, width=round(width * preset.width), **changes)
        for name, preset in _PRESETS.items()
    }


METHODS = {
    "aclstm": _PRESETS,
    "lstm-3lr": _changed(feeding="teacher"),
    "scheduled": _changed(feeding="scheduled"),
    "erd": _changed(1.25, method="erd", feeding="teacher"),
    "seq2seq": _changed(2.5, method="seq2seq", feeding="teacher"),
}
PRESETS = {f"{method}-{style}": its for style in DANCES for method, its in METHODS.items()}
