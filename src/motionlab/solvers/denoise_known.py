"""Does the network know motion of this kind?

A prior that was taught walks pulls a cartwheel towards a walk. It tells so itself: what a filter left of
a noisy clip is less likely under it than what filters leave of motion that it knows. How likely that
is depends on the noise, as the smooth line trembles with what is left of it; so the bound is a line over
the logarithm of the noise, fitted to held-out clips of the data that the network learned
(``experiments/rnn_gan/known_motion.py``).
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..models import LstmGmm
from .denoise_seen import LEAST_ANGLE, NoiseLevels, features_of

# least nats a frame = AT_ONE + SLOPE · ln(angle in radians)
AT_ONE, SLOPE = -40.0, -20.0


@torch.no_grad()
def judge(model: LstmGmm, rows: Tensor, toes: Tensor, noise: NoiseLevels) -> tuple[float, float]:
    """How likely a smooth line (frames, channels) is, nats a frame, and how likely it must be.

    toes : (frames, 2), whether they rest there.
    """
    features = features_of(model.encoding, rows, toes)
    return float(model.log_prob(features[None]).mean()), least(noise)


def least(noise: NoiseLevels) -> float:
    """Nats a frame that what a filter leaves of known motion has, in all but a few clips."""
    return AT_ONE + SLOPE * math.log(max(noise.angle_rad, LEAST_ANGLE))
