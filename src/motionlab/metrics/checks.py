"""What every metric asks of its input, so that a mistake is named and not measured."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..errors import MetricError
from ..skeleton import Skeleton


def check_positions(
    positions: Tensor,
    points: int | None = None,
    minimum_frames: int = 1,
    name: str = "positions",
    finite: bool = True,
) -> Tensor:
    """Points of a body over time as a tensor (..., frames, points, 3).

    Parameters
    ----------
    positions : tensor or array (..., frames, points, 3), metres.
    points : how many points there must be; None takes any number.
    minimum_frames : how many frames the metric needs.
    name : what the argument is called in the message.
    finite : refuse NaN and infinite values.

    Raises
    ------
    MetricError : not such an array, empty, too few frames, NaN or infinite.
    """
    positions = check_floats(positions, name, finite=finite)
    expected = f"(..., frames, {points or 'points'}, 3)"
    if positions.ndim < 3 or positions.shape[-1] != 3 or points not in (None, positions.shape[-2]):
        raise MetricError(
            f"{name} has shape {tuple(positions.shape)}; it must be {expected} metres, as "
            "motion.positions() gives them."
        )
    check_frames(positions.shape[-3], minimum_frames, name)
    _check_not_empty(positions, name)
    return positions


def check_skeleton(
    positions: Tensor,
    skeleton: Skeleton,
    minimum_frames: int = 1,
    name: str = "positions",
    finite: bool = True,
) -> Tensor:
    """Points of a skeleton, all or its joints alone, as `check_positions` gives them."""
    positions = check_positions(positions, None, minimum_frames, name, finite)
    if not isinstance(skeleton, Skeleton):
        raise MetricError(f"skeleton is {skeleton!r}; pass the motion's own, motion.skeleton.")
    if positions.shape[-2] not in (skeleton.joints, skeleton.points):
        raise MetricError(
            f"{name} has {positions.shape[-2]} points, {skeleton!r} has {skeleton.points} of "
            f"which {skeleton.joints} are joints; pass the skeleton that the points belong to."
        )
    return positions


def check_features(
    features: Tensor, minimum_frames: int = 1, name: str = "features", dim: int | None = None
) -> Tensor:
    """Rows of any features over time as a tensor (..., frames, dim); raises MetricError."""
    features = check_floats(features, name)
    if features.ndim < 2 or dim not in (None, features.shape[-1]):
        raise MetricError(
            f"{name} has shape {tuple(features.shape)}; it must be (..., frames, {dim or 'dim'})."
        )
    check_frames(features.shape[-2], minimum_frames, name)
    _check_not_empty(features, name)
    return features


def check_same_shape(first: Tensor, second: Tensor, names: tuple[str, str]) -> None:
    """Two arrays that are compared number by number; raises MetricError."""
    if first.shape != second.shape:
        raise MetricError(
            f"{names[0]} has shape {tuple(first.shape)} and {names[1]} {tuple(second.shape)}; "
            "cut or resample them to the same frames and points first."
        )


def check_contacts(contacts: Tensor, positions: Tensor | None = None) -> Tensor:
    """Contacts as bool (..., frames, 4), or (..., frames, 2) for the toes alone.

    positions : (..., frames, points, 3) that they belong to, if any.

    Raises
    ------
    MetricError : another shape or type.
    """
    if contacts is None:
        raise MetricError("There are no contacts; label them first with contacts.label(motion).")
    try:
        contacts = torch.as_tensor(contacts)
    except (TypeError, ValueError, RuntimeError) as error:
        raise MetricError(f"contacts must be an array (..., frames, 4): {error}.") from error
    if contacts.dtype != torch.bool:
        raise MetricError(
            f"contacts is of {contacts.dtype}; it must be bool: threshold it first, as in "
            "contacts > 0.5."
        )
    fits = positions is None or contacts.shape[:-1] == torch.as_tensor(positions).shape[:-2]
    empty = contacts.numel() == 0
    if contacts.ndim < 2 or contacts.shape[-1] not in (2, 4) or empty or not fits:
        of = "" if positions is None else f" for positions {tuple(positions.shape)}"
        raise MetricError(
            f"contacts has shape {tuple(contacts.shape)}{of}; it must be (..., frames, 4): left "
            "heel, left toe, right heel, right toe in every frame; or 2, the toes alone."
        )
    return contacts


def check_rate(fps: float) -> float:
    """Frames per second as a float; raises MetricError."""
    return check_positive(fps, "fps")


def check_positive(value: float, name: str) -> float:
    """A finite number above zero; raises MetricError."""
    try:
        number = math.nan if isinstance(value, str) else float(value)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        number = math.nan
    if not (math.isfinite(number) and number > 0):
        raise MetricError(f"{name} is {value!r}; it must be a positive number.")
    return number


def check_frames(frames: int, minimum: int, name: str) -> None:
    """Enough frames for the metric; raises MetricError."""
    if frames < minimum:
        raise MetricError(
            f"{name} has {frames} frame{'' if frames == 1 else 's'}; this needs at least "
            f"{minimum}. Give a longer piece of motion."
        )


def check_floats(
    values: Tensor, name: str, dtype: torch.dtype | None = None, finite: bool = True
) -> Tensor:
    """Numbers, finite ones unless said otherwise, as a floating-point tensor; raises MetricError."""
    try:
        tensor = torch.as_tensor(values, dtype=dtype)
    except (TypeError, ValueError, RuntimeError) as error:
        raise MetricError(f"{name} must be an array of numbers: {error}.") from error
    if tensor.is_complex() or tensor.dtype == torch.bool:
        raise MetricError(f"{name} is of {tensor.dtype}; it must hold real numbers.")
    if not tensor.is_floating_point():
        tensor = tensor.float()
    bad = ~torch.isfinite(tensor)
    if finite and bad.any():
        raise MetricError(
            f"{name}{[int(i) for i in bad.nonzero()[0]]} is NaN or infinite ({int(bad.sum())} "
            "such values in all); cut those frames out first."
        )
    return tensor


def _check_not_empty(values: Tensor, name: str) -> None:
    if values.numel() == 0:
        raise MetricError(f"{name} has shape {tuple(values.shape)}: there is nothing in it.")
