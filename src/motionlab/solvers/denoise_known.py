"""Does the network know motion of this kind?

A prior that was taught walks pulls a wave of the hand towards a walk. It tells so itself: the likeliest
motion is then still an unlikely one, as what was seen does not let it go. What it was before, a filter's
answer, tells less: that of a run is as unlikely as that of a dance, as the filter blurs it. The bound is
a line over the logarithm of the noise, fitted on validation clips of the shipped lstm-gmm-contacts, one on
its own body and one on the rigs of recordings, by ``python -m experiments.rnn_gan.denoising_known``
(``results/denoising_known.json``). Another network needs its own.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..models import LstmGmm
from .denoise_seen import LEAST_ANGLE, NoiseLevels, features_of

# least nats a frame = AT_ONE + SLOPE · ln(angle in radians)
AT_ONE, SLOPE = 57.22, 4.5
# and of recordings on other rigs, whose motion is a little strange to the network on its own body
RIGS_AT_ONE, RIGS_SLOPE = 30.78, 10.0


@torch.no_grad()
def judge(model: LstmGmm, rows: Tensor, toes: Tensor, noise: NoiseLevels) -> tuple[float, float]:
    """How likely a clean motion (frames, channels) is, nats a frame, and how likely it must be.

    toes : (frames, 2), whether they rest there.
    """
    features = features_of(model.encoding, rows, toes)
    return float(model.log_prob(features[None]).mean()), least(noise)


def least(noise: NoiseLevels, other_rig: bool = False) -> float:
    """Nats a frame that motion of a kind that the network knows has when it is clean."""
    at_one, slope = (RIGS_AT_ONE, RIGS_SLOPE) if other_rig else (AT_ONE, SLOPE)
    return at_one + slope * math.log(max(noise.angle_rad, LEAST_ANGLE))
