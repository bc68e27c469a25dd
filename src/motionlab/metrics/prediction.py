"""How far a prediction is from what really came next."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ..errors import MetricError
from .checks import (
    check_features,
    check_floats,
    check_positions,
    check_positive,
    check_rate,
    check_same_shape,
)


def position_error(predicted: Tensor, true: Tensor) -> Tensor:
    """Distance of whole poses in each frame, in metres: the error of acLSTM's tables.

    The Euclidean norm of one long vector of all points (acLSTM, section 4, tables 1 and 2). It
    grows with the number of points and with the size of the body: compare only what was measured
    on one skeleton. `mean_joint_error` does not grow with the number of points.

    Parameters
    ----------
    predicted, true : (..., frames, points, 3) metres.

    Returns
    -------
    (..., frames) metres.

    Raises
    ------
    MetricError : different or wrong shapes, NaN.
    """
    predicted, true = _pair(predicted, true)
    return (predicted - true).flatten(-2).norm(dim=-1)


def mean_joint_error(predicted: Tensor, true: Tensor) -> Tensor:
    """Mean distance of points in each frame, in centimetres (MPJPE, Ionescu et al. 2014).

    Parameters
    ----------
    predicted, true : (..., frames, points, 3) metres.

    Returns
    -------
    (..., frames) centimetres.

    Raises
    ------
    MetricError : different or wrong shapes, NaN.
    """
    predicted, true = _pair(predicted, true)
    return 100 * (predicted - true).norm(dim=-1).mean(-1)


def at_milliseconds(
    errors: Tensor,
    fps: float,
    milliseconds: Sequence[float] = (80, 160, 240, 320, 400, 480, 560, 640),
) -> Tensor:
    """Errors at given times after the seed (by default those of acLSTM, table 1).

    The seed's last frame is at 0 ms, where a prediction has no error yet; row i of `errors` is at
    (i + 1) * 1000 / fps ms. Between frames the error is interpolated linearly.

    Parameters
    ----------
    errors : (..., frames), one value for each predicted frame, in any unit.
    fps : frames per second.
    milliseconds : times after the seed's last frame, none after the last row's.

    Returns
    -------
    (..., times), in the unit of the errors.

    Raises
    ------
    MetricError : a time before the seed's end or after the last frame, NaN, a bad rate.
    """
    errors, fps = check_floats(errors, "errors"), check_rate(fps)
    if errors.ndim < 1 or errors.shape[-1] < 1:
        raise MetricError(
            f"errors has shape {tuple(errors.shape)}; it must be (..., frames), at least one frame."
        )
    times = check_floats(milliseconds, "milliseconds", torch.float64).reshape(-1)
    when, frames = times * fps / 1000, errors.shape[-1]
    if len(when) and (when.min() < 0 or when.max() > frames + 1e-6):
        raise MetricError(
            f"milliseconds goes from {float(times.min()):g} to {float(times.max()):g}, but the "
            f"errors reach from 0 to {1000 * frames / fps:g} ms; predict longer or ask for less."
        )
    errors = torch.nn.functional.pad(errors, (1, 0))
    before = when.floor().long().clamp(max=frames - 1)
    part = (when - before).to(errors)
    return torch.lerp(errors[..., before], errors[..., before + 1], part)


def npss(
    predicted: Tensor, true: Tensor, fps: float, highest: float = 15.0, pooled: bool = True
) -> Tensor:
    """Normalised power spectrum similarity: do the same things happen equally often?

    Gopalakrishnan et al., *A Neural Temporal Model for Human Motion Prediction*, CVPR 2019. The
    power spectrum of each feature over time, made a distribution, is compared with the true one by
    the earth mover's distance; features and sequences count in proportion to their true power.
    Being early or late costs nothing, being too slow or too fast does. Lower is better.

    The paper's unit is the number of frequencies between, which grows with the duration: divide it
    by the duration for Hz. Spectra are one-sided and end at `highest`: the other half is a mirror
    image, and with it the distance from a mean to a wave would grow with the frame rate.

    Parameters
    ----------
    predicted, true : (..., frames, dim), any features (the paper: Euler angles).
    fps : frames per second.
    highest : Hz; power above it is left out, so that recordings at 30 and at 60 fps are alike.
    pooled : one number for all sequences together, as in the paper; False: one for each, (...).

    Returns
    -------
    Distance in Hz, a scalar or (...). NaN where the true features are all zero.

    Raises
    ------
    MetricError : different or wrong shapes, fewer than two frames, NaN, a bad rate.
    """
    predicted = check_features(predicted, 2, "predicted")
    true = check_features(true, 2, "true")
    check_same_shape(predicted, true, ("predicted", "true"))
    resolution = check_rate(fps) / true.shape[-2]  # Hz from one frequency to the next
    kept = int(check_positive(highest, "highest") / resolution + 1e-6) + 1
    spectra = [_power(values)[..., :kept, :] for values in (predicted, true)]
    power = spectra[1].sum(-2)
    moved = _distribution(spectra[0]).cumsum(-2) - _distribution(spectra[1]).cumsum(-2)
    distance = resolution * moved.abs().sum(-2)  # earth mover's distance of shares on a line
    axes = tuple(range(power.ndim)) if pooled else (-1,)
    return (distance * power).sum(axes) / power.sum(axes)


def _power(values: Tensor) -> Tensor:
    """Power at each frequency, (..., frequencies, dim)."""
    return torch.fft.rfft(values.double(), dim=-2).abs().square()


def _distribution(power: Tensor) -> Tensor:
    """Power as shares that sum to one; all at frequency zero where a feature is zero throughout."""
    total = power.sum(-2, keepdim=True)
    still = torch.zeros_like(power)
    still[..., 0, :] = 1
    return torch.where(total > 0, power / total.clamp(min=1e-300), still)


def _pair(predicted: Tensor, true: Tensor) -> tuple[Tensor, Tensor]:
    predicted = check_positions(predicted, name="predicted")
    true = check_positions(true, name="true")
    check_same_shape(predicted, true, ("predicted", "true"))
    return predicted, true
