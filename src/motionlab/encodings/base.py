"""What every encoding can do, and what all of them check."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import torch
from torch import Tensor

from ..errors import EncodingError
from ..feet import contacts
from ..ik import solve
from ..motion import Motion
from ..skeleton import Skeleton
from .path import Start

_ALIKE = 0.9  # cosine between bones at rest that are drawn alike


class Encoding(Protocol):
    """Motion to features and back: the contract between data and models.

    A model, a solver or a metric that keeps to it never asks which encoding it has. Features are in
    raw units (metres, radians, 0 or 1); `Normalizer` makes them comparable.

    Row t holds the pose of frame t and the step from frame t-1 to t. Row 0 repeats the step of row 1
    (a motion of one frame has made no step). No step is lost: frame 0 stands where `start` says.
    ``encoding.positions(encoding.encode(motion), encoding.start_of(motion))`` are the points of the
    motion, to rounding.

    Decoding takes any leading dimensions, any device and any floating-point type, and is
    differentiable in features and start.
    """

    skeleton: Skeleton
    fps: float
    dim: int  # numbers in a row
    feature_names: tuple[str, ...]
    slices: dict[str, slice]  # "root", "pose" and, where there are any, "contacts"
    points: int  # points that `positions` gives: joints first
    point_names: tuple[str, ...]
    effector_names: tuple[str, ...]  # what `end_effectors` gives

    def encode(self, motion: Motion) -> Tensor:
        """Features (frames, dim) in float32.

        Contacts are those of the motion; where it has none, `motionlab.contacts.label` finds them.

        Raises
        ------
        EncodingError : another skeleton, another frame rate, or no frames.
        """
        ...

    def positions(self, features: Tensor, start: Start | None = None) -> Tensor:
        """Points (..., frames, points, 3) in metres of features (..., frames, dim).

        start : x and z in metres and yaw in radians of frame 0: numbers or tensors (...), one each,
            or one tensor (..., 3). The default is the origin, facing +z.

        Raises
        ------
        EncodingError : wrong shape, no frames, NaN or infinite values.
        """
        ...

    def to_motion(
        self, features: Tensor, start: Start | None = None, name: str = "", source: str = ""
    ) -> Motion:
        """The motion that features (frames, dim) stand for; raises EncodingError."""
        ...

    def end_effectors(self, features: Tensor) -> Tensor:
        """Where hands, toes and head are, and how they move: (..., frames, effectors, 6).

        Position in metres and velocity in metres a second, both in the heading frame: the ground
        below the root, z where the root faces. The velocity is that over the ground in the step to
        this frame; row 0 repeats row 1. `effector_names` tells the order.
        """
        ...

    def contacts(self, features: Tensor) -> Tensor | None:
        """Contact channels (..., frames, 2 or 4) as they are; None if the encoding has none."""
        ...

    def start_of(self, motion: Motion) -> Tensor:
        """The `start` (x, z, yaw) in float64 that puts decoded features where the motion was."""
        ...

    def config(self) -> dict:
        """What `motionlab.encodings.from_config` needs to build it again; fit for JSON."""
        ...


def check_motion(encoding: Encoding, motion: Motion) -> None:
    """Raise EncodingError if an encoding can't take this motion."""
    kind = type(encoding).__name__
    if not isinstance(motion, Motion):
        raise EncodingError(f"{kind}.encode takes a Motion, not {type(motion).__name__}.")
    if not encoding.skeleton.matches(motion.skeleton):
        raise EncodingError(
            f"{motion!r} has another skeleton than this {kind}: "
            f"{encoding.skeleton.difference(motion.skeleton)}; bring it there with "
            "motion.retarget(encoding.skeleton), or make the encoding from motion.skeleton."
        )
    if abs(motion.fps - encoding.fps) > 1e-4 * encoding.fps:
        raise EncodingError(
            f"{motion!r} has another frame rate than this {kind}; encode "
            f"motion.resample({encoding.fps:g})."
        )
    if len(motion) == 0:
        raise EncodingError(f"{motion!r} has no frames to encode.")


def check_features(encoding: Encoding, features: Tensor, frames_only: bool = False) -> Tensor:
    """Features as a tensor (..., frames, dim), or (frames, dim); EncodingError if they are not."""
    kind, dim = type(encoding).__name__, encoding.dim
    try:
        features = torch.as_tensor(features)
    except (TypeError, ValueError, RuntimeError) as error:
        raise EncodingError(f"Features must be an array of numbers: {error}.") from error
    shape = tuple(features.shape)
    if len(shape) < 2 or shape[-1] != dim or (frames_only and len(shape) > 2):
        wanted = f"({'' if frames_only else '..., '}frames, {dim})"
        raise EncodingError(f"Features have shape {shape}; this {kind} needs {wanted}.")
    if shape[-2] == 0:
        raise EncodingError(f"Features have shape {shape}: there are no frames to decode.")
    if not features.is_floating_point():
        raise EncodingError(f"Features are {features.dtype}; they must be floating-point numbers.")
    # a sum is finite only if everything in it is, and costs one pass
    bad = ~features.detach().sum(-1).isfinite()
    if bad.any():
        raise EncodingError(
            f"Features have a NaN or infinite value in frame {int(bad.nonzero()[0, -1])} "
            f"({int(bad.sum())} such rows in all)."
        )
    return features


def check_skeleton(kind: type, skeleton: Skeleton) -> Skeleton:
    """The skeleton; EncodingError if it is none."""
    if not isinstance(skeleton, Skeleton):
        raise EncodingError(
            f"{kind.__name__} is made from a Skeleton, such as motion.skeleton, not "
            f"{type(skeleton).__name__}."
        )
    return skeleton


def check_rate(fps: float) -> float:
    """The frame rate as a number; EncodingError if it is not a positive one."""
    rate = number(fps)
    if not 0 < rate < math.inf:
        raise EncodingError(f"{fps!r} frames per second; it must be a positive number.")
    return rate


def number(value: object) -> float:
    """The value as a number; NaN if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def contact_channels(motion: Motion, columns: Sequence[int]) -> Tensor:
    """Some of the four contact channels (frames, columns) of a motion, 0.0 or 1.0."""
    found = contacts.label(motion) if motion.contacts is None else motion.contacts
    return found[:, list(columns)].float()


def motion_through(
    encoding: Encoding, points: Tensor, contacts: Tensor | None, name: str, source: str
) -> Motion:
    """The motion of an encoding's skeleton whose points come nearest to those given, by IK.

    On the canonical skeleton knees and elbows are hinges, which tells how thighs and upper arms
    turn about themselves; what other skeletons' joints may do is not known.
    """
    skeleton = encoding.skeleton
    limits = "human" if drawn_as_canonical(skeleton) else None
    root_positions, rotations = solve(skeleton, points.cpu(), limits=limits)
    return Motion(skeleton, root_positions, rotations, encoding.fps, name, source, contacts)


def drawn_as_canonical(skeleton: Skeleton) -> bool:
    """Whether a skeleton has the joints of the canonical one, and they lie alike at rest.

    Then a rotation means the same on both, however long the bones are.
    """
    canonical = Skeleton.canonical()
    if (skeleton.names, skeleton.parents) != (canonical.names, canonical.parents):
        return False
    pairs = skeleton.offsets[1:], canonical.offsets[1:]
    return bool(torch.nn.functional.cosine_similarity(*pairs).min() > _ALIKE)


def skeleton_config(skeleton: Skeleton) -> dict:
    """A skeleton as plain lists, fit for JSON; ``Skeleton(**lists)`` builds it again."""
    return {
        "names": list(skeleton.names),
        "parents": list(skeleton.parents),
        "offsets": skeleton.offsets.tolist(),
        "end_parents": list(skeleton.end_parents),
        "end_offsets": skeleton.end_offsets.tolist(),
        "rotation_orders": list(skeleton.rotation_orders),
    }
