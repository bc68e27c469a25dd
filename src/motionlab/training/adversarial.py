"""The game of refiner and discriminator (RNN-GAN, section 4.2.2), and what keeps it from collapse.

Each step lets the discriminator learn once to tell real windows from refined ones, and the refiner
some times to fool it. Chance is a function of the seed and the number of the step, so that a game
that was stopped goes on as if it had not been.
"""

from __future__ import annotations

import json
import math
import os
import statistics
import sys
import time
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import asdict
from itertools import count
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn.utils.parametrizations import spectral_norm
from tqdm import tqdm

from ..errors import DivergedError, TrainingError
from ..models import Discriminator, Refiner
from ..models.refiner import (
    effector_normalizer,
    fooling_loss,
    root_deviation,
    steepness,
    telling_loss,
)
from .checkpoints import read_checkpoint, restore, save_checkpoint, save_weights, write_whole
from .finish import OBSERVED
from .games import GamePreset
from .licence import licence
from .loop import CHECKPOINT
from .prepared import Prepared
from .windows import Windows

HAIR = 0.1  # deviation of the noise by which the discriminator's steepness is felt


class Game(nn.Module):
    """Both players, and the refined windows that the discriminator is not to forget."""

    def __init__(self, refiner: Refiner, discriminator: Discriminator, preset: GamePreset) -> None:
        super().__init__()
        self.refiner, self.discriminator = refiner, discriminator
        self.average = deepcopy(refiner).requires_grad_(False) if preset.average else None
        empty = torch.zeros(preset.history, preset.frames, refiner.encoding.dim)
        self.register_buffer("history", empty)


def new_game(data: Prepared, preset: GamePreset) -> Game:
    """Players with first weights drawn from the preset's seed."""
    clips = data.clips("train")
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(preset.seed)
        effectors = effector_normalizer(data.encoding, clips)
        refiner = Refiner(
            data.encoding, data.normalizer, preset.width, effectors, preset.reach or None,
            preset.slow or None,
        )  # fmt: skip
        critic = Discriminator(
            data.encoding, deepcopy(effectors), preset.discriminator_width, preset.slow or None
        )
        if preset.spectral:
            critic.enter[0], critic.leave = (
                spectral_norm(critic.enter[0]),
                spectral_norm(critic.leave),
            )
    return Game(refiner, critic, preset)


def train_game(
    generator: nn.Module,
    data: Prepared,
    preset: GamePreset,
    folder: str | os.PathLike,
    *,
    name: str,
    start: str | os.PathLike | None = None,
    device: str | None = None,
    progress: bool = False,
) -> list[dict]:
    """Train a refiner against a discriminator, or go on where an earlier call was stopped.

    Parameters
    ----------
    generator : whose motion is to be refined, such as the shipped LSTM-GMM; not changed.
    data : real motion, in the generator's encoding, or with contacts besides.
    folder : receives ``checkpoint.safetensors`` to go on from, ``curve.json``, and the refiner as
        ``at-STEP.safetensors`` at every validation: which is best, an independent judge says.
    name : of the refiner, kept with its weights.
    start : file of the generator's weights, whose licence holds for the refiner, too.
    device : "cpu", "cuda"; by default the best there is.
    progress : show a bar and a line for every validation.

    Returns
    -------
    list of dict : means since the last entry. `telling`, `fooling`: both losses, eq. 10 (halved, so
    that 0.69 is a discriminator that knows nothing) and 9; `root (cm)`: how far roots are moved;
    `turns`: the refiner's in a step; `seconds` of training.

    Raises
    ------
    TrainingError : data of another encoding, the folder holds another game, or can't be written.
    DivergedError : a loss or its gradient is no longer a number.
    """
    data = data.matching(generator.encoding)
    device = torch.device(device or ("cuda" if torch.cuda.is_available() else "cpu"))
    folder, game = Path(folder), new_game(data, preset).to(device)
    optimizer = torch.optim.RMSprop(
        [
            {"params": list(game.refiner.parameters()), "lr": preset.refiner_rate},
            {"params": list(game.discriminator.parameters()), "lr": preset.discriminator_rate},
        ],
        alpha=preset.decay,
    )
    facts = {"name": name, "preset": asdict(preset), "data": data.hash,
             "generator_hash": getattr(generator, "hash", None),  # if it was loaded
             "model": game.refiner.config(), "step": 0, "seconds": 0.0, "curve": [],
             "licence": licence(data, start)}  # fmt: skip
    _resume(folder / CHECKPOINT, game, optimizer, facts)
    source = _Source(generator, data, preset, device)
    seen: dict[str, list[float]] = {"telling": [], "fooling": [], "root (cm)": [], "turns": []}
    since = time.perf_counter()
    shown = None if progress else True
    bar = tqdm(total=preset.steps, initial=facts["step"], desc=name, mininterval=1, disable=shown)
    with bar:
        for step in range(facts["step"], preset.steps):
            for key, value in play(game, optimizer, source, preset, step):
                seen[key].append(value)
            if game.average is not None:
                _follow(game, preset.average, step)
            bar.update()
            facts["step"] = step + 1
            if facts["step"] % preset.validate_every and facts["step"] != preset.steps:
                continue
            facts["seconds"] += time.perf_counter() - since
            means = {key: statistics.fmean(values) for key, values in seen.items()}
            facts["curve"].append({"step": facts["step"], **means, "seconds": facts["seconds"]})
            _keep(folder, game, optimizer, facts)
            seen, since = {key: [] for key in seen}, time.perf_counter()
            if progress:
                bar.write(_line(facts["curve"][-1]))
                sys.stdout.flush()
    return facts["curve"]


def play(
    game: Game, optimizer: torch.optim.Optimizer, source: _Source, preset: GamePreset, step: int
) -> Iterator[tuple[str, float]]:
    """One step of the game, in the paper's order; yields its losses as they come."""
    chance = torch.Generator().manual_seed(preset.seed * 1_000_003 + step)
    opening = step == 0 and preset.warmup > 0
    if step == 0 and preset.history:
        with torch.no_grad():
            game.history.copy_(game.refiner(source.generated(preset.history, step, chance)))
    for _ in range(preset.warmup if opening else 1):
        telling = _tell(game, optimizer, source, preset, step, chance)
        yield "telling", telling
    turns = preset.turns
    if preset.balance and telling < preset.strong:
        turns = 2 * turns
    elif preset.balance and telling > preset.weak:
        turns = max(1, turns // 2)
    turns = preset.warmup if opening else turns
    yield "turns", turns
    for _ in range(turns):
        fooling, moved = _fool(game, optimizer, source, preset, step, chance)
        yield "fooling", fooling
        yield "root (cm)", moved


def _tell(game, optimizer, source, preset, step, chance) -> float:
    """The discriminator learns once (eq. 10); the history gets what it saw for the first time."""
    half = preset.batch // 2 if preset.history else preset.batch
    with torch.no_grad():
        refined = new = game.refiner(source.generated(half, step, chance))
    if preset.history:
        places = torch.randperm(preset.history, generator=chance)[:half]
        refined = torch.cat([new, game.history[places]])
    real = source.real(preset.batch, chance)
    seen = [_seen(game.discriminator, windows, preset, chance) for windows in (real, refined)]
    judged = [game.discriminator.judge(some) for some in seen]
    loss = telling_loss(*judged) / 2
    steep = 0.0
    if preset.steepness_weight:
        for some, logits in zip(seen, judged, strict=True):
            noise = HAIR * torch.randn(some.shape, generator=chance).to(some)
            steep = steep + steepness(game.discriminator, some, logits, noise)
    total = loss + preset.steepness_weight * steep
    _descend(total, game.discriminator, optimizer, preset, step)
    if preset.history:
        game.history[torch.randperm(preset.history, generator=chance)[:half]] = new
    return loss.item()


def _fool(game, optimizer, source, preset, step, chance) -> tuple[float, float]:
    """The refiner learns once (eq. 13): the loss of eq. 9, and centimetres that roots are moved."""
    features = source.generated(preset.batch, step, chance)
    refined = game.refiner(features)
    seen = _seen(game.discriminator, refined, preset, chance)
    fooling = fooling_loss(game.discriminator.judge(seen))
    away = root_deviation(game.refiner.encoding, features, refined)
    normalizer = game.refiner.normalizer
    changed = (normalizer(refined) - normalizer(features)).square().mean()
    total = fooling + preset.root_weight * away + preset.change_weight * changed
    _descend(total, game.refiner, optimizer, preset, step)
    return fooling.item(), 100 * away.item() ** 0.5


@torch.no_grad()
def _follow(game: Game, share: float, step: int) -> None:
    """The average takes a step towards the refiner; larger ones at first, for it began at nothing."""
    share = min(share, (step + 1) / (step + 10))
    for mean, now in zip(game.average.parameters(), game.refiner.parameters(), strict=True):
        mean.lerp_(now, 1 - share)


def _seen(critic: Discriminator, windows: Tensor, preset: GamePreset, chance) -> Tensor:
    """What it is to judge (windows, frames, numbers), in pieces if it is to look no further."""
    seen = critic.seen(windows)
    if preset.instance_noise:
        seen = seen + preset.instance_noise * torch.randn(seen.shape, generator=chance).to(seen)
    return seen.unflatten(1, (-1, preset.piece)).flatten(0, 1) if preset.piece else seen


def _descend(loss: Tensor, player: nn.Module, optimizer, preset: GamePreset, step: int) -> None:
    """One step of one player; the optimiser leaves alone what has no gradient."""
    optimizer.zero_grad(set_to_none=True)
    parameters = list(player.parameters())
    loss.backward(inputs=parameters)
    norm = nn.utils.clip_grad_norm_(parameters, preset.clip or math.inf)
    if not norm.isfinite():
        raise DivergedError(
            f"Step {step}: the {type(player).__name__.lower()}'s loss is {loss.item():g} and its "
            "gradient is not a number. Play with lower rates, or a clip, in a new folder."
        )
    optimizer.step()


class _Source:
    """Where windows come from: real ones, and the generator's, sampled ahead and made anew."""

    def __init__(self, generator, data: Prepared, preset: GamePreset, device) -> None:
        self.generator, self.preset, self.device = generator, preset, device
        self._real = Windows(data.clips("train"), preset.frames)
        self._begun = Windows(data.clips("train"), round(OBSERVED * data.encoding.fps))
        self._made: Windows | None = None
        self._round = -1

    def real(self, size: int, chance: torch.Generator) -> Tensor:
        return self._real.draw(size, chance).to(self.device)

    def generated(self, size: int, step: int, chance: torch.Generator) -> Tensor:
        if step // self.preset.refresh != self._round:
            self._round = step // self.preset.refresh
            motions = sample_motions(self.generator, self._begun, self.preset, self._round)
            self._made = Windows(motions, self.preset.frames)
        return self._made.draw(size, chance).to(self.device)


@torch.no_grad()
def sample_motions(generator, begun: Windows, preset: GamePreset, number: int) -> list[Tensor]:
    """Motions (frames, dim) that go on from real ones, as the generator is used; number: of the draw.

    A motion that has left all bounds is NaN, and is drawn again.
    """
    frames, found = round(preset.seconds * generator.fps), []
    for attempt in count():
        chance = torch.Generator().manual_seed(preset.seed * 1_000_003 + 997 * number + attempt)
        start = generator.observe(begun.draw(preset.samples, chance), doubt=False)
        sampling = preset.sampling(generator.sampling)
        made = generator.generate(frames, start, generator=chance, **sampling)
        found += [motion for motion in made if motion.isfinite().all()]
        if len(found) >= preset.samples:
            return found[: preset.samples]
        if attempt == 9:
            raise TrainingError("Nearly all motions of this generator explode; nothing to refine.")


def _resume(path: Path, game: Game, optimizer, facts: dict) -> None:
    """Go on from a checkpoint if there is one."""
    if not path.exists():
        return
    tensors, found = read_checkpoint(path)
    same = ("name", "data", "generator_hash", "model")
    # settings that an older game did not know are at their defaults in it
    before = asdict(GamePreset(1, 1)) | found.get("preset", {})
    now = facts["preset"]
    other = [key for key in same if found.get(key, facts[key]) != facts[key]]
    other += [key for key in now if key != "steps" and before[key] != now[key]]
    if other:
        raise TrainingError(
            f"{path}: belongs to a game with other {', '.join(other)}; repeat its settings to go on "
            "with it, or name another folder."
        )
    restore(tensors, game, optimizer)
    facts |= {key: found[key] for key in ("step", "seconds", "curve")}


def _keep(folder: Path, game: Game, optimizer, facts: dict) -> None:
    refiner = game.refiner if game.average is None else game.average
    save_weights(folder / f"at-{facts['step']}.safetensors", refiner, facts)
    text = json.dumps(facts["curve"], indent=1).encode()
    try:
        write_whole(folder / "curve.json", lambda stream: stream.write(text))
    except OSError as error:
        raise TrainingError(f"{folder}: can't be written to ({error.strerror}).") from error
    save_checkpoint(folder / CHECKPOINT, game, optimizer, facts)  # last: it says that all is done


def _line(point: dict) -> str:
    return (
        f"step {point['step']:6}  {point['seconds'] / 60:6.1f} min  telling {point['telling']:.3f}  "
        f"fooling {point['fooling']:.3f}  root {point['root (cm)']:.1f} cm  turns {point['turns']:.1f}"
    )
