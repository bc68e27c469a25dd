"""Do machine judges put GAN2, GAN1 and RNN in the order in which people did? See W9 in claims.yaml."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionlab import metrics

from ..claims.comparison import METHODS
from ..rnn_gan.refined_samples import gap, totals
from .measures import JERK, SKATE
from .real import Gait

CRITIC, FRECHET, MANIFOLD = "critic", "Fréchet distance", "manifold distance"


def order(found: dict[str, dict], recorded: dict[str, list[float]], gait: Gait) -> dict:
    """Of each judge and pair, how much farther from real the second is: value, low, high.

    found : of each method, what was measured start by start; the same starts throughout.
    recorded : SKATE and JERK of the clips that were begun in.
    """
    judges: dict[str, dict] = {}
    for i, first in enumerate(METHODS):
        for second in METHODS[i + 1 :]:
            near, far = found[first], found[second]
            apart = {
                CRITIC: _mean(far[CRITIC], near[CRITIC]),
                MANIFOLD: _mean(far[MANIFOLD], near[MANIFOLD]),
                FRECHET: _frechet(far["moments"], near["moments"], gait),
            }
            for key in (SKATE, JERK):
                columns = (totals([{key: v} for v in its[key]], key)
                           for its in (far, near, recorded))  # fmt: skip
                apart[key] = metrics.bootstrap(list(zip(*columns, strict=True)), gap)
            for judge, its in apart.items():
                judges.setdefault(judge, {})[f"{first} before {second}"] = its._asdict()
    return judges


def _mean(far: Sequence[float], near: Sequence[float]) -> metrics.Interval:
    return metrics.bootstrap(np.subtract(far, near))


def _frechet(far: Sequence, near: Sequence, gait: Gait) -> metrics.Interval:
    """By leaving out each start of both."""

    def apart(pairs):
        ours, theirs = zip(*pairs, strict=True)
        return gait.frechet.distance(ours) - gait.frechet.distance(theirs)

    return metrics.jackknife(list(zip(far, near, strict=True)), apart)
