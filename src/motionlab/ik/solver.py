"""Rotations of a whole body from the positions of its points."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..errors import IkError
from ..skeleton import Skeleton
from .directions import first_pose
from .limits import Table, read_limits
from .refine import refine
from .turns import place

_HOLD = 1e-4  # square metres per square radian: a turn of one radian costs as much as 1 cm off
_BARELY = 1e-6  # of the largest weight; such a target decides half of where its bone points first


@torch.no_grad()
def solve(
    skeleton: Skeleton,
    targets: Tensor,
    *,
    weights: Tensor | None = None,
    start: Tensor | None = None,
    prior: Tensor | None = None,
    limits: str | Table | None = None,
    smooth: float = 1.0,
    iterations: int = 20,
) -> tuple[Tensor, Tensor]:
    """Root positions and joint rotations that bring a skeleton's points to their targets.

    First every bone is pointed at its target in closed form, then damped least squares
    (Levenberg-Marquardt) spreads what is left over: nothing if the targets are points of this very
    skeleton. Rotations that the targets do not show, such as the turn of a forearm about itself,
    are as near to `prior` as they can be, and steady over time.

    Parameters
    ----------
    skeleton : the body.
    targets : (..., frames, points, 3) metres, or (..., frames, joints, 3) without the end sites.
    weights : broadcasts with (..., frames, points), at least 0; how much each target counts. Where
        it is 0 the target is ignored, and may be NaN.
    start : (..., frames, joints, 3, 3), local rotations to start from instead of the closed form: a
        warm start. What the targets leave open stays as it is there.
    prior : (joints, 3, 3), local rotations of the neutral pose; the rest pose if None.
    limits : "human": knees and elbows are hinges, all joints have a range. Besides keeping them,
        this tells the twist of thighs and upper arms from the bend below. The hinges' axes are told
        from the neutral pose, which must stand upright. A table like `motionlab.ik.HUMAN` sets
        other ranges. None: no limits.
    smooth : how strongly the twist above a nearly straight hinge follows that of the frames around
        (the weight of its second difference, per frame); 0 solves every frame by itself.
    iterations : steps of least squares at most.

    Returns
    -------
    root_positions : (..., frames, 3) metres.
    rotations : (..., frames, joints, 3, 3), local. Both like `targets` in type and device; the
        work is done on the processor in double precision, without gradients.

    Raises
    ------
    IkError : shapes that do not fit, NaN, no frames, settings that are no such numbers, limits
        that this neutral pose does not show.
    """
    _check_settings(skeleton, smooth, iterations)
    goals, weight = _check_targets(skeleton, targets, weights)
    lead, frames = targets.shape[:-3], targets.shape[-3]
    shape = (*lead, frames, skeleton.joints, 3, 3)
    neutral = _check_rotations("prior", prior, shape[-3:], torch.eye(3))
    rules = read_limits(limits, skeleton, neutral)
    if start is None:
        trust = weight / (weight + _BARELY)
        root, rotations = first_pose(skeleton, goals, trust, neutral, rules.hinges, smooth)
    else:
        rotations = _check_rotations("start", start, shape).reshape(goals.shape[0], *shape[-4:])
        still, _ = place(skeleton, goals.new_zeros(*goals.shape[:2], 3), rotations)
        total = weight.sum(-1, keepdim=True).clamp(min=1e-12)
        root = (weight[..., None] * (goals - still)).sum(-2) / total
    root, rotations = refine(
        skeleton,
        *(x.flatten(0, 1) for x in (goals, weight, root, rotations)),
        hold=_HOLD,
        clamp=rules.clamp,
        iterations=iterations,
    )
    return root.reshape(*lead, frames, 3).to(targets), rotations.reshape(shape).to(targets)


def _check_settings(skeleton: Skeleton, smooth: float, iterations: int) -> None:
    if not isinstance(skeleton, Skeleton):
        raise IkError(f"solve takes a Skeleton first, not {type(skeleton).__name__}.")
    if not isinstance(smooth, int | float) or not 0 <= smooth < math.inf:
        raise IkError(f"smooth is {smooth!r}; it must be a number from 0 on.")
    if not isinstance(iterations, int) or iterations < 0:
        raise IkError(f"iterations is {iterations!r}; it must be a whole number from 0 on.")


def _check_targets(
    skeleton: Skeleton, targets: Tensor, weights: Tensor | None
) -> tuple[Tensor, Tensor]:
    """Targets (batch, frames, points, 3) and weights (batch, frames, points) up to 1, in double."""
    sizes = (skeleton.points, skeleton.joints)
    if not isinstance(targets, Tensor) or not targets.is_floating_point():
        raise IkError(f"Targets must be a tensor of floats, not {type(targets).__name__}.")
    if targets.ndim < 3 or targets.shape[-1] != 3 or targets.shape[-2] not in sizes:
        raise IkError(
            f"Targets have shape {tuple(targets.shape)}; this skeleton needs (..., frames, "
            f"{sizes[0]}, 3), or (..., frames, {sizes[1]}, 3) without end sites."
        )
    if not targets.numel():
        raise IkError(f"Targets have shape {tuple(targets.shape)}: there is no frame to solve.")
    goals = targets.detach().to("cpu", torch.float64)
    try:
        weight = torch.as_tensor(1.0 if weights is None else weights).to(goals)
        weight = weight.expand(goals.shape[:-1])
    except (RuntimeError, TypeError, ValueError) as error:
        raise IkError(
            f"Weights of shape {_shape(weights)} do not broadcast with "
            f"{tuple(goals.shape[:-1])}: give one per point, or one per frame and point."
        ) from error
    if not (weight >= 0).all() or weight.isinf().any():
        raise IkError("A weight is negative, infinite or NaN; weights are numbers from 0 on.")
    bad = (weight > 0) & ~goals.isfinite().all(-1)
    if bad.any():
        *_, frame, point = bad.nonzero()[0].tolist()
        raise IkError(
            f"The target of {skeleton.point_names[point]!r} at frame {frame} is NaN or infinite; "
            "give it the weight 0 to leave it out."
        )
    goals = torch.where(weight[..., None] > 0, goals, 0)
    # End sites without targets weigh nothing.
    missing = skeleton.points - goals.shape[-2]
    goals = torch.nn.functional.pad(goals, (0, 0, 0, missing))
    weight = torch.nn.functional.pad(weight, (0, missing)) / weight.max().clamp(min=1e-12)
    return goals.reshape(-1, *goals.shape[-3:]), weight.reshape(-1, *weight.shape[-2:])


def _check_rotations(
    what: str, rotations: Tensor | None, shape: tuple[int, ...], default: Tensor | None = None
) -> Tensor:
    """Rotation matrices of this shape, in double."""
    if rotations is None:
        rotations = default
    try:
        matrices = torch.as_tensor(rotations).detach().to("cpu", torch.float64).expand(shape)
    except (RuntimeError, TypeError, ValueError) as error:
        raise IkError(
            f"`{what}` must be rotation matrices of shape {shape}, not {_shape(rotations)}."
        ) from error
    skewed = (matrices @ matrices.mT - torch.eye(3, dtype=torch.float64)).abs().amax((-2, -1))
    if not (skewed < 1e-3).all() or (torch.linalg.det(matrices) < 0).any():
        raise IkError(
            f"`{what}` holds matrices that are no rotations: R R' is not the identity, or the "
            "determinant is -1."
        )
    return matrices


def _shape(value: object) -> object:
    return tuple(value.shape) if isinstance(value, Tensor) else value
