"""Which refiner is best? A critic of its own, feet, trembling, and how far the root is moved.

The discriminator of a game is no judge of it: the refiner was made to please it. Here another one
learns, afterwards, to tell real from refined motion, and is asked about motion that it has not seen.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor, nn

from .. import metrics
from ..encodings import Encoding, from_config
from ..errors import TrainingError
from ..feet import contacts
from ..models import Discriminator
from ..models.refiner import effector_normalizer, telling_loss
from .checkpoints import load_weights, save_weights, write_whole
from .finish import OBSERVED
from .prepared import Prepared
from .presets import BEST

STRAYED = 0.05  # metres that half of the roots may have been moved after ten seconds, if at all
PIECE = 1.0  # seconds that the critic sees at a time
UPDATES, BATCH, WIDTH, RATE, SLOW = 300, 32, 64, 2e-3, 0.1  # of the critic
JUDGED = "judged.json"


class Told(NamedTuple):
    """How often a critic was right about each clip that it had not seen."""

    real: Tensor  # (clips,), share of a clip's windows that it took for real
    made: Tensor  # (clips,), share of a clip's windows that it did not take for real

    @property
    def accuracy(self) -> float:
        """Mean of both; one half if it can't tell them apart."""
        return (self.real.mean() + self.made.mean()).item() / 2


def critic(
    encoding: Encoding,
    training: tuple[Sequence[Tensor], Sequence[Tensor]],
    asked: tuple[Sequence[Tensor], Sequence[Tensor]],
    seed: int = 0,
) -> Told:
    """Teach a critic real and made clips, and ask it about others.

    It is a `Discriminator`, slow velocities enlarged, that looks at a second at a time; every clip
    counts alike, however long it is. Contact channels it does not see: it is to judge motion, and a
    label of 0.98 instead of 1 would give everything away.

    Parameters
    ----------
    encoding : of the clips; of its features the critic sees end effectors.
    training : real and made clips (frames, dim) that it learns from, a second or longer.
    asked : real and made clips that it is asked about.

    Raises
    ------
    TrainingError : no clip is as long as a second.
    """
    frames = round(PIECE * encoding.fps)
    if "contacts" in encoding.slices:
        encoding = from_config(encoding.config() | {"contacts": False})
    training, asked = (
        [[clip[:, : encoding.dim] for clip in clips] for clips in both]
        for both in (training, asked)
    )
    with torch.random.fork_rng(devices=[]), torch.enable_grad():
        torch.manual_seed(seed)
        judge = Discriminator(encoding, effector_normalizer(encoding, training[0]), WIDTH, SLOW)
        with torch.no_grad():
            pools = [[judge.seen(clip) for clip in _long(clips, frames)] for clips in training]
        optimizer = torch.optim.Adam(judge.parameters(), RATE)
        chance = torch.Generator().manual_seed(seed)
        for _ in range(UPDATES):
            loss = telling_loss(*(judge.judge(_drawn(pool, frames, chance)) for pool in pools))
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    with torch.no_grad():
        found = [
            torch.stack([(_logits(judge, clip, frames) > 0).float().mean() for clip in clips])
            for clips in (_long(some, frames) for some in asked)
        ]
    return Told(found[0], 1 - found[1])


def _long(clips: Sequence[Tensor], frames: int) -> list[Tensor]:
    kept = [clip for clip in clips if len(clip) >= frames]
    if not kept:
        raise TrainingError(f"A critic looks at {frames} frames; all clips are shorter.")
    return kept


def _drawn(pool: list[Tensor], frames: int, chance: torch.Generator) -> Tensor:
    """A batch of windows, each of any clip."""
    found = []
    for number in torch.randint(len(pool), (BATCH,), generator=chance).tolist():
        at = int(torch.randint(len(pool[number]) - frames + 1, (1,), generator=chance))
        found.append(pool[number][at : at + frames])
    return torch.stack(found)


def _logits(judge: Discriminator, clip: Tensor, frames: int) -> Tensor:
    """One logit a window; the windows overlap by half."""
    windows = judge.seen(clip).unfold(0, frames, frames // 2).transpose(1, 2)
    return judge.judge(windows).mean(-1)


class Judge:
    """Held-out clips, and what a generator makes of their first two seconds; judges refiners.

    Parameters
    ----------
    generator : as it was refined.
    data : in its encoding, or with contacts besides.
    split : whose clips of two seconds and more are used.
    seconds : length of a sample.
    seed : of the samples' chance.
    sampling : what the samples are drawn with; None: as the generator is used.

    Raises
    ------
    TrainingError : data of another encoding than the generator's, or fewer than four such clips.
    """

    def __init__(
        self,
        generator: nn.Module,
        data: Prepared,
        split: str = "val",
        seconds: float = 10.0,
        seed: int = 0,
        sampling: dict[str, float] | None = None,
    ) -> None:
        sampling = generator.sampling if sampling is None else sampling
        data = data.matching(generator.encoding)
        seen = round(OBSERVED * generator.fps)
        clips = [clip for clip in data.clips(split) if len(clip) >= seen]
        if len(clips) < 4:
            raise TrainingError(
                f"{len(clips)} clips of split {split!r} are {OBSERVED:g} s long or longer; judging "
                "needs 4."
            )
        self.encoding = generator.encoding
        begun = torch.stack([clip[:seen] for clip in clips])
        with torch.no_grad():
            made = generator.generate(
                round(seconds * generator.fps), generator.observe(begun, doubt=False),
                generator=torch.Generator().manual_seed(seed), **sampling,
            )  # fmt: skip
        sound = made.isfinite().all(-1).all(-1)
        self.made = made[sound]
        self.clips = [clip for clip, good in zip(clips, sound.tolist(), strict=True) if good]
        points = self._points(self.clips)
        self._frechet = metrics.Frechet.fit(points, self.encoding.skeleton, generator.fps)
        self.real = self._measured(points)
        self.unrefined = self.about(self.made)

    @torch.no_grad()
    def __call__(self, refiner: nn.Module) -> dict[str, float]:
        """What becomes of the samples: see `about`, and `root (m)`, how far the middle one of all
        roots ends from where it would have; `score`, the less the better, infinite beyond 5 cm.
        """
        refined = refiner(self.made)
        paths = [self.encoding.root_path(some)[:, -1] for some in (refined, self.made)]
        root = (paths[0] - paths[1]).norm(dim=-1).median().item()
        found = self.about(refined) | {"root (m)": root}
        return found | {"score": self.score(found) if root < STRAYED else math.inf}

    @torch.no_grad()
    def about(self, made: Tensor) -> dict[str, float]:
        """Foot skate (cm/s), jerk (m/s³), Fréchet distance and the critic's accuracy."""
        points = self._points(made)
        found = self._measured(points)
        found["frechet"] = self._frechet.distance(
            [self._frechet.moments(clip, self.encoding.fps) for clip in points]
        )
        halves = [(self.clips[i::2], list(made[i::2])) for i in (0, 1)]
        found["critic"] = critic(self.encoding, *halves).accuracy
        return found

    def score(self, found: dict[str, float]) -> float:
        """Sum of four distances from real motion, each over that of the unrefined samples."""
        real = self.real | {"frechet": 0.0, "critic": 0.5}
        return sum(
            abs(found[key] - real[key]) / max(abs(self.unrefined[key] - real[key]), 1e-6)
            for key in real
        )

    def _points(self, clips: Sequence[Tensor]) -> list[Tensor]:
        return [self.encoding.positions(clip) for clip in clips]

    def _measured(self, points: list[Tensor]) -> dict[str, float]:
        skeleton, fps = self.encoding.skeleton, self.encoding.fps
        skates = [
            metrics.foot_skate(clip, contacts.label_positions(clip, skeleton, fps), skeleton, fps)
            for clip in points
        ]
        return {
            "foot skate (cm/s)": torch.stack(skates).nanmean().item(),
            "jerk (m/s³)": torch.stack([metrics.jerk(clip, fps) for clip in points]).mean().item(),
        }


def choose(folder: str | os.PathLike, judge: Judge, out: str = BEST) -> dict:
    """Judge every refiner that a game has kept, and copy the one of least score to `out`.

    Returns what was found of it, with its `step`; the same of all is in ``judged.json``.

    Raises
    ------
    TrainingError : the folder has none, or all move half of the roots by 5 cm or more in 10 s.
    """
    folder = Path(folder)
    steps = {int(found[1]): path for path in folder.glob("at-*.safetensors")
             if (found := re.fullmatch(r"at-(\d+)", path.stem))}  # fmt: skip
    if not steps:
        raise TrainingError(f"{folder}: no refiner is here; `train_game` leaves them.")
    rows = []
    for step, path in sorted(steps.items()):
        refiner, _ = load_weights(path)
        rows.append({"step": step} | judge(refiner.eval()))
    told = {"real": judge.real, "unrefined": judge.unrefined, "refined": rows}
    text = json.dumps(_finite(told), indent=1, allow_nan=False, ensure_ascii=False)
    write_whole(folder / JUDGED, lambda stream: stream.write(text.encode()))
    best = min(rows, key=lambda row: row["score"])
    if not math.isfinite(best["score"]):
        raise TrainingError(
            f"{folder}: every refiner moves half of the roots by {100 * STRAYED:g} cm or more in ten "
            "seconds; play with a heavier root_weight, or a reach."
        )
    refiner, about = load_weights(steps[best["step"]])
    save_weights(folder / out, refiner, about | {"judged": best, "beside": judge.unrefined})
    return best


def _finite(value):
    """Fit for JSON, which has no infinity."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
