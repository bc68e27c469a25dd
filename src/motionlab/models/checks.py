"""What every model asks of its input, in the same words."""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Protocol

import torch
from torch import Tensor

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .state import State


class _Model(Protocol):
    encoding: Encoding
    normalizer: Normalizer

    def zero_state(self, batch: int = 1) -> State: ...


def check_normalizer(encoding: Encoding, normalizer: Normalizer) -> None:
    """Raise ModelError if a normaliser is for another number of channels than an encoding's."""
    if len(normalizer.mean) != encoding.dim:
        raise ModelError(
            f"The normalizer is for {len(normalizer.mean)} channels, the encoding has "
            f"{encoding.dim}; fit it on features of this encoding."
        )


def as_features(model: _Model, features: Tensor) -> Tensor:
    """Features, or an array of them, as a tensor; raises ModelError for what is none."""
    try:
        return torch.as_tensor(features)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ModelError(
            f"Features must be an array of numbers, not {type(features).__name__}; of a motion at "
            f"{model.encoding.fps:g} frames a second the model's `encoding.encode` makes some."
        ) from error


def checked_features(model: _Model, features: Tensor) -> Tensor:
    """Features (batch, frames, dim) on the model's device, in its precision; raises ModelError."""
    features = as_features(model, features).to(model.normalizer.mean)
    shape, dim = tuple(features.shape), model.encoding.dim
    if len(shape) != 3 or shape[-1] != dim or 0 in shape:
        raise ModelError(
            f"Features have shape {shape}; this model needs (batch, frames, {dim}) with at least "
            "one frame."
        )
    if not math.isfinite(features.detach().sum()):
        raise ModelError("Features hold a NaN or infinite value; cut such frames out first.")
    return features


def checked_going_on(
    model: _Model, features: Tensor, n: int, least: int, kind: str
) -> tuple[Tensor, bool]:
    """Features (batch, frames, dim) from which `kind`, which reads `least` frames, can go on by n.

    And whether it was one clip (frames, dim). Raises ModelError.
    """
    if not isinstance(n, Integral) or n < 1:
        raise ModelError(f"extrapolate: {n!r} frames; ask for 1 or more.")
    features = as_features(model, features)
    one = features.ndim == 2
    features = checked_features(model, features[None] if one else features)
    if features.shape[1] < least:
        raise ModelError(f"extrapolate: {features.shape[1]} frames; {kind} reads {least}.")
    return features, one


def checked_start(model: _Model, n: int, start: State) -> State:
    """The state, on the model's device and in its precision, from which n frames can be generated.

    Raises ModelError.
    """
    if not isinstance(n, Integral) or n < 1:
        raise ModelError(f"generate: {n!r} frames; ask for 1 or more.")
    return checked_state(model, start, "generate: start")


def checked_state(model: _Model, state: State, what: str = "state") -> State:
    """A state, on the model's device and in its precision.

    It must have the shapes of the model's `zero_state`. Raises ModelError, calling it `what`.
    """
    parts = lambda some: [part.shape[1:] for part in (some.frame, some.hidden, some.cell)]
    if not isinstance(state, State) or parts(state) != parts(model.zero_state()):
        raise ModelError(f"{what} is no state of this model; `observe` gives one.")
    size = len(state.frame), len(model.normalizer.kept)
    for name in ("noise", "seen"):
        part = getattr(state, name)
        if part.shape[-1] == 0:
            state = state._replace(**{name: state.frame[:, :0]})
        elif part.shape != size:
            raise ModelError(
                f"{what} holds `{name}` of shape {tuple(part.shape)}, this model's is {size}. "
                "State(state.frame, state.hidden, state.cell) is one without."
            )
    if not all(map(_finite, state)):
        raise ModelError(f"{what} holds a NaN or infinite value.")
    like = model.normalizer.mean
    return State(*(part.to(like) for part in state))


def _finite(part: Tensor) -> bool:
    """Whether all numbers are finite; their sum tells at once, but may itself leave all bounds."""
    return math.isfinite(part.detach().sum()) or bool(part.isfinite().all())


def check_memory(memory: float) -> None:
    """Raise ModelError if noise can't remember so much."""
    if not isinstance(memory, Real) or not 0 <= memory < 1:
        raise ModelError(
            f"generate: memory is {memory!r}; it must be a number from 0, white noise, to less "
            "than 1, such as 0.9."
        )


def check_noise(noise: float) -> None:
    """Raise ModelError if this is no standard deviation."""
    if not isinstance(noise, Real) or not 0 <= noise < math.inf:
        raise ModelError(f"generate: noise is {noise!r}; it must be a number, 0 or more.")


def check_counts(kind: str, **counts: int) -> None:
    """Raise ModelError for numbers of frames that are no whole numbers from 1."""
    for what, value in counts.items():
        if not isinstance(value, Integral) or value < 1:
            raise ModelError(f"{kind}: {what} is {value!r}; it must be a whole number from 1.")
