"""How a body moves over a gait cycle: Fourier coefficients fitted to real walks and runs.

The coefficients in gaits.json come from experiments/data/fit_gaits.py. They are fitted to clips of
one actor ("Male1"), ACCAD Motion Lab, The Ohio State University, licensed CC BY 3.0.

A cycle has phase 0 at the left foot's strike and 1 at its next. Lengths are in leg lengths, speeds
are Froude speeds v / sqrt(g leg): bodies of different size move alike at equal Froude speed.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files

import numpy as np

GRAVITY = 9.81
HARMONICS = 5
CLAMPED = 9
GAITS = ("walk", "run")
# Froude speeds up to which the straight lines through the clips' speeds are followed.
RANGE = {"walk": (0.20, 0.80), "run": (0.75, 1.75)}


def fourier_basis(phase: np.ndarray) -> np.ndarray:
    """1, cos, sin, cos 2, sin 2, ... of a phase in cycles: (...,) -> (..., 1 + 2 HARMONICS)."""
    angle = 2 * np.pi * np.asarray(phase)[..., None] * np.arange(1, HARMONICS + 1)
    waves = np.stack([np.cos(angle), np.sin(angle)], -1).reshape(*angle.shape[:-1], -1)
    return np.concatenate([np.ones((*waves.shape[:-1], 1)), waves], -1)


def clamped_basis(part: np.ndarray) -> np.ndarray:
    """Waves that start and end with value and slope zero: (...,) in 0..1 -> (..., CLAMPED).

    sin(pi x) sin(k pi x) is half of cos((k - 1) pi x) - cos((k + 1) pi x): a cosine series.
    """
    x = np.pi * np.asarray(part)[..., None]
    return np.sin(x) * np.sin(np.arange(1, CLAMPED + 1) * x)


def clamped_slope(part: np.ndarray) -> np.ndarray:
    """Derivative of `clamped_basis`."""
    x = np.pi * np.asarray(part)[..., None]
    k = np.arange(1, CLAMPED + 1)
    return np.pi * (np.cos(x) * np.sin(k * x) + k * np.sin(x) * np.cos(k * x))


@cache
def table() -> dict:
    """The content of gaits.json, with arrays for lists."""
    document = json.loads(files(__package__).joinpath("gaits.json").read_text(encoding="utf-8"))
    for gait in GAITS:
        for curve in document[gait]["curves"].values():
            curve["mean"], curve["slope"] = np.array(curve["mean"]), np.array(curve["slope"])
    return document


def coefficients(kind: str, name: str, froude: np.ndarray, running: np.ndarray) -> np.ndarray:
    """Coefficients at a speed between walk (running = 0) and run (1): (n,) -> (n, terms, ...).

    kind : "curves" or "numbers", the part of gaits.json that holds `name`.
    """
    parts = []
    for gait in GAITS:
        entry = table()[gait][kind][name]
        speed = np.clip(froude, *RANGE[gait]) - table()[gait]["froude"][1]
        parts.append(np.asarray(entry["mean"]) + np.multiply.outer(speed, entry["slope"]))
    share = running.reshape(running.shape + (1,) * (parts[0].ndim - running.ndim))
    return (1 - share) * parts[0] + share * parts[1]


def number(name: str, froude: np.ndarray, running: np.ndarray) -> np.ndarray:
    """One of the cycle's numbers, such as toe_off, the share of the cycle the foot is down."""
    return coefficients("numbers", name, froude, running)


def curve(
    name: str, phase: np.ndarray, froude: np.ndarray, running: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the cycle and deviation from it, each (n, 3), at phases (n,) of a cycle."""
    terms = coefficients("curves", name, froude, running)
    waves = fourier_basis(phase)
    return terms[:, 0], np.einsum("nk,nkc->nc", waves[:, 1:], terms[:, 1:])


def stride_rate(froude: np.ndarray, running: np.ndarray) -> np.ndarray:
    """Strides per sqrt(leg / g) at a speed."""
    rates = [
        table()[gait]["rate"]["scale"]
        * np.maximum(froude, 1e-6) ** table()[gait]["rate"]["exponent"]
        for gait in GAITS
    ]
    return (1 - running) * rates[0] + running * rates[1]
