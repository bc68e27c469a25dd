"""Motions of methods and gaits, for small studies."""

from __future__ import annotations

from motionlab.datasets import gaits
from motionlab.studies.build import Source

METHODS = ("GAN2", "RNN", "mocap")


def sources(methods=METHODS, kinds=("walk", "run"), clips: int = 2, seconds: float = 1.2):
    return [
        Source(
            gaits.make(seconds=seconds, speed=speed, seed=10 * m + c), method, kind, f"{method}/{c}"
        )
        for m, method in enumerate(methods)
        for kind, speed in zip(kinds, (1.2, 3.0), strict=False)
        for c in range(clips)
    ]
