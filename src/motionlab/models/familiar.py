"""Is what a network is to go on from like anything that it has learned?

A network goes on from whatever it is given. From frames of another rate, in another unit or of
another body it makes motion, too, and nobody is told why it is odd. So two numbers are measured for
the second before a start, and those of held-out motion say which of them are strange:

* `likelihood`, nats a frame: how well the network foretells each frame from those before it. Motion
  that is too fast, or jumps, is foretold badly.
* `distance`, how far the frames lie from the mean frame: the mean square of their channels in
  normalised units, 1 in training. Another unit, another axis up, left and right exchanged: such
  poses stay calm, and so are foretold well, but nobody has stood like this.

Neither sees all. With the bounds of the shipped `lstm-gmm-contacts`, each passed by one held-out
second in a hundred, 1.6 % of the seconds of test clips are doubted without need. Doubted are all
that are in a unit 100 times too large or too small or have left and right exchanged, all that are 4
times too fast and five in six of those that are twice too fast; but only a third of those that run
backwards, 1.5 % of those that are 4 times too slow, and none that stand still in the pose of the
skeleton's file. Weights that foretell held-out motion badly have wide bounds, and doubt less. So the
rule is sound for what is doubted, which is worth a look; what is not doubted may still be wrong.
`experiments/rnn_gan/strange_starts.py` measures it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

SECONDS = 1.0  # told of the last ones before a start
ENOUGH = 0.5  # seconds; of fewer frames the numbers say little
QUANTILE = 0.01  # of held-out seconds that lie beyond each bound
LEAST = 30  # held-out seconds from which bounds are read
SHARE = 0.05  # of the starts of a batch that may lie beyond them: in many, some do by chance


class Familiar(NamedTuple):
    """Bounds: `likelihood` is the least that is not strange, nats a frame; `distance` the largest."""

    likelihood: float
    distance: float


@torch.no_grad()
def measure(model: nn.Module, features: Tensor) -> tuple[Tensor, Tensor]:
    """Likelihood and distance (batch,) of the last second of features (batch, frames, dim).

    model : with ``log_prob``, such as `LstmGmm`. Raises ModelError for fewer than two frames.
    """
    last = features[:, -round(SECONDS * model.fps) :]
    distance = model.normalizer(last.to(model.normalizer.mean)).square().mean((1, 2))
    return model.log_prob(last).mean(1), distance


@torch.no_grad()
def bounds(model: nn.Module, clips: Sequence[Tensor]) -> Familiar | None:
    """Bounds that one in a hundred of the seconds of held-out clips (frames, dim) lies beyond.

    None if there are fewer than 30 seconds: they would say little.
    """
    second = round(SECONDS * model.fps)
    seconds = [part for clip in clips for part in clip.split(second) if len(part) == second]
    if len(seconds) < LEAST:
        return None
    measured = [measure(model, some) for some in torch.stack(seconds).split(256)]
    likelihood, distance = (torch.cat(parts).double() for parts in zip(*measured, strict=True))
    return Familiar(
        round(float(likelihood.quantile(QUANTILE)), 2),
        round(float(distance.quantile(1 - QUANTILE)), 2),
    )


def warn_of_strange(model: nn.Module, features: Tensor, familiar: Familiar, level: int = 3) -> None:
    """Say if more than a twentieth of the starts (batch, frames, dim) lie beyond the bounds.

    Nothing is said of frames that are under a search, which ask for a gradient, nor of less than
    half a second. What is said is always the same, so that Python says it once for a line of code.
    level : of the stack, whose line it is.
    """
    if features.requires_grad or features.shape[1] < ENOUGH * model.fps:
        return
    likelihood, distance = measure(model, features)
    many = lambda strange: float(strange.double().mean()) > SHARE
    doubts = []
    if many(distance > familiar.distance):
        doubts.append(
            "lie farther from the mean frame than 99 % of held-out motion (are lengths in metres, is "
            "y up, is left left, is it the encoding's body? `motion.retarget` brings another one)"
        )
    if many(likelihood < familiar.likelihood):
        doubts.append(
            "move as less than 1 % of held-out motion does (are there "
            f"{model.fps:g} a second? `motion.resample({model.fps:g})` brings another rate; do they "
            "jump, or run backwards?)"
        )
    if doubts:
        frames = f"these frames {' and '.join(doubts)}"
        warnings.warn(f"observe: what follows may be odd: {frames}.", stacklevel=level)
