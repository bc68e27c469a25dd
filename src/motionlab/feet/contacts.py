"""Foot contacts: which part of which foot rests on the floor.

Four channels, in this order: left heel, left toe, right heel, right toe. The heel is the Foot
(ankle) joint, the toe the Toes joint. Two rules label them from positions alone:

* ``"speed"``: RNN-GAN, section 4.3. A toe slower than 0.45 m/s is in contact. The paper labels a
  foot by its toe; the heel is labelled here by its own speed in the same way.
* ``"speed-height"``: STRNN, section 4.2.3. Slow, and low as well. The paper gives no numbers. Ours:
  the same speed, and 4 cm, below which 99 % of the resting feet of real walks and runs lie.

``experiments/data/contact_rules.py`` measures both against exact labels and on real clips.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..errors import MotionError
from ..motion import Motion
from ..skeleton import Skeleton

__all__ = [
    "CHANNELS",
    "RULES",
    "agreement",
    "foot_points",
    "foot_speeds",
    "label",
    "label_positions",
    "rest_heights",
    "stands_on_floor",
    "velocities",
]

CHANNELS = ("left heel", "left toe", "right heel", "right toe")
RULES = ("speed", "speed-height")
_LEVEL = 0.025  # of a shank, by how much one foot may lie higher than the other on one floor


def label(
    motion: Motion,
    rule: str = "speed",
    *,
    speed: float = 0.45,
    height: float = 0.04,
    floor: float | None = None,
    step: float = 1 / 30,
) -> Tensor:
    """Contacts of a motion, bool (frames, 4). The arguments are those of `label_positions`."""
    if not isinstance(motion, Motion):
        raise MotionError(f"contacts.label takes a Motion, not {type(motion).__name__}.")
    return label_positions(
        motion.positions(),
        motion.skeleton,
        motion.fps,
        rule,
        speed=speed,
        height=height,
        floor=floor,
        step=step,
    )


def label_positions(
    positions: Tensor,
    skeleton: Skeleton,
    fps: float,
    rule: str = "speed",
    *,
    speed: float = 0.45,
    height: float = 0.04,
    floor: float | None = None,
    step: float = 1 / 30,
) -> Tensor:
    """Contacts of points in motion.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres; points may be the joints alone.
    skeleton : says which points are heels and toes.
    fps : frames per second.
    rule : "speed" or "speed-height".
    speed : metres a second; a part of a foot that moves faster is not in contact.
    height : metres that a joint may lie above where it lies when the foot stands flat ("speed-
        height" only).
    floor : height of the floor in metres ("speed-height" only). The joints of a foot that stands
        flat on it lie as high above it as in the skeleton's rest pose above the floor y = 0, as
        those of `Skeleton.canonical` do. None: a joint's median height while it is slow is where it
        lies on the floor. That needs no floor, fits any skeleton, and forgives a capture whose
        floor is not quite level, as long as each foot is slow on the floor more than in the air.
    step : seconds; a joint's speed is its way from `step` before the frame to `step` after it, by
        the time between. A time and not a frame, so that a clip has the same contacts at 30 fps,
        the rate of the papers, and at 120.

    Returns
    -------
    bool (..., frames, 4): left heel, left toe, right heel, right toe.

    Raises
    ------
    MotionError : wrong shape, no frame, NaN, a rate or threshold that is not positive, an unknown
        rule, or a floor for a skeleton whose rest pose does not stand on one.
    SkeletonError : the skeleton has no feet.
    """
    positions = _check(positions, skeleton, fps, rule, speed, height, step, floor)
    feet = positions[..., foot_points(skeleton), :]
    found = foot_speeds(feet, fps, step) < speed
    if rule == "speed":
        return found
    heights = feet[..., 1]
    if floor is None:
        slow = torch.where(found, heights, torch.nan)
        resting = slow.nanmedian(dim=-2, keepdim=True).values  # NaN, so no contact, if never slow
    elif stands_on_floor(skeleton):
        resting = rest_heights(skeleton).to(feet) + floor
    else:
        raise MotionError(
            f"contacts: the rest pose of {skeleton!r} does not stand on the floor y = 0, so how "
            "high its feet lie on a floor is not known; leave `floor` out, or motion.retarget() "
            "first."
        )
    return found & (heights < resting + height)


def foot_points(skeleton: Skeleton) -> list[int]:
    """Points of a skeleton that the four channels speak of.

    Where a skeleton has no toe joint, the toe is the foot's farthest end site, and where that is
    missing too, the foot itself.
    """
    found = []
    for side in ("left", "right"):
        foot = skeleton.role(f"{side}_foot")
        ends = [i for i, parent in enumerate(skeleton.end_parents) if parent == foot]
        tip = max(ends, key=lambda end: skeleton.end_offsets[end].norm(), default=None)
        toe = foot if tip is None else skeleton.joints + tip
        found += [foot, skeleton.roles.get(f"{side}_toes", toe)]
    return found


def rest_heights(skeleton: Skeleton) -> Tensor:
    """Heights (4,) in metres of heels and toes above the floor y = 0 in the rest pose."""
    return skeleton.rest_points[foot_points(skeleton), 1] + skeleton.offsets[0, 1]


def stands_on_floor(skeleton: Skeleton) -> bool:
    """Whether the rest pose stands on the floor y = 0, feet flat, so that `rest_heights` are theirs.

    Many files have a rest pose that floats, hangs from its root at the origin, lies, or has one foot
    higher than the other: heights would be wrong by up to a metre.
    """
    heights, rest = rest_heights(skeleton), skeleton.rest_points
    feet = foot_points(skeleton)
    shank = skeleton.offsets[feet[0]].norm()
    for foot, toe in (feet[:2], feet[2:]):
        hangs = rest[skeleton.point_parents[foot], 1] - rest[foot, 1] > 0.8 * shank
        tiptoe = rest[foot, 1] - rest[toe, 1] > 0.9 * (rest[foot] - rest[toe]).norm()
        if tiptoe or not hangs:
            return False
    level = (heights[:2] - heights[2:]).abs().max() < _LEVEL * shank
    return bool(level and -0.05 * shank < heights.min() and heights.max() < 0.6 * shank)


def foot_speeds(feet: Tensor, fps: float, step: float = 1 / 30) -> Tensor:
    """Speeds (..., frames, points) of points (..., frames, points, 3), by `velocities`."""
    return velocities(feet, fps, step).norm(dim=-1)


def velocities(positions: Tensor, fps: float, step: float) -> Tensor:
    """Velocities of points, their unit per second, as (..., frames, points, dim) like positions.

    Central differences: between the frames `step` seconds (rounded to whole frames, at least one)
    before and after, so that a velocity belongs to its frame; the first and the last frames take
    the half that is there. Of a single frame, zero.
    """
    stride, frames = max(1, round(step * fps)), positions.shape[-3]
    index = torch.arange(frames, device=positions.device)
    before, after = (index - stride).clamp(min=0), (index + stride).clamp(max=frames - 1)
    seconds = ((after - before).clamp(min=1) / fps).to(positions)[:, None, None]
    return (positions[..., after, :, :] - positions[..., before, :, :]) / seconds


def agreement(found: Tensor, truth: Tensor) -> dict[str, dict[str, float]]:
    """How well found contacts agree with true ones.

    Parameters
    ----------
    found, truth : bool (..., frames, 4), one as the other.

    Returns
    -------
    dict of "left heel", ..., "right toe" and "all" (the four pooled), each a dict of "precision"
    (what share of the found contacts is true), "recall" (what share of the true ones was found)
    and "f1" (their harmonic mean), from 0 to 1; NaN where nothing was found, or nothing is true.

    Raises
    ------
    MotionError : not two bool arrays of one such shape.
    """
    try:
        found, truth = torch.as_tensor(found), torch.as_tensor(truth)
    except (TypeError, ValueError, RuntimeError) as error:
        raise MotionError(f"found and truth must be arrays of bool: {error}.") from error
    if found.shape != truth.shape or found.ndim < 2 or found.shape[-1] != len(CHANNELS):
        raise MotionError(
            f"found has shape {tuple(found.shape)} and truth {tuple(truth.shape)}; both must be "
            "(..., frames, 4), of the same frames."
        )
    if found.dtype != torch.bool or truth.dtype != torch.bool:
        raise MotionError(
            f"found is of {found.dtype} and truth of {truth.dtype}; both must be bool, as in "
            "contacts > 0.5."
        )
    flat = (-1, len(CHANNELS))
    counts = torch.stack(  # true positives, found, true
        [
            (found & truth).reshape(flat).sum(0),
            found.reshape(flat).sum(0),
            truth.reshape(flat).sum(0),
        ]
    ).double()
    counts = torch.cat([counts, counts.sum(-1, keepdim=True)], -1)
    both, found_in_all, true_in_all = counts
    rows = torch.stack(
        [both / found_in_all, both / true_in_all, 2 * both / (found_in_all + true_in_all)], -1
    )
    names = ("precision", "recall", "f1")
    return {
        channel: dict(zip(names, row, strict=True))
        for channel, row in zip((*CHANNELS, "all"), rows.tolist(), strict=True)
    }


def _number(value: object) -> float:
    """The value as a number; NaN if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _check(
    positions: Tensor,
    skeleton: Skeleton,
    fps: float,
    rule: str,
    speed: float,
    height: float,
    step: float,
    floor: float | None,
) -> Tensor:
    if not isinstance(skeleton, Skeleton):
        raise MotionError(f"contacts: skeleton is {skeleton!r}, not a Skeleton.")
    if rule not in RULES:
        raise MotionError(f"There is no contact rule {rule!r}; use one of {', '.join(RULES)}.")
    given = {"fps": fps, "speed": speed, "height": height, "step": step}
    for name, value in given.items():
        if not 0 < _number(value) < math.inf:
            raise MotionError(f"contacts: {name} is {value!r}; it must be a positive number.")
    if floor is not None and not math.isfinite(_number(floor)):
        raise MotionError(f"contacts: floor is {floor!r}; it must be a number of metres, or None.")
    try:
        positions = torch.as_tensor(positions)
    except (TypeError, ValueError, RuntimeError) as error:
        raise MotionError(f"contacts: positions must be an array of numbers: {error}.") from error
    if positions.ndim < 3 or positions.shape[-1] != 3 or positions.shape[-3] == 0:
        raise MotionError(
            f"contacts: positions has shape {tuple(positions.shape)}; it must be (..., frames, "
            "points, 3) with at least one frame."
        )
    points = positions.shape[-2]
    if points not in (skeleton.joints, skeleton.points) or max(foot_points(skeleton)) >= points:
        raise MotionError(
            f"contacts: positions has {points} points, {skeleton!r} {skeleton.points}; pass the "
            "skeleton that they belong to, and the end sites too if it has no toe joints."
        )
    bad = ~torch.isfinite(positions.flatten(-2).sum(-1))
    if bad.any():
        frame = bad.nonzero()[0].tolist()
        raise MotionError(
            f"contacts: positions is NaN or infinite in frame {frame[-1]}; cut such frames out "
            "first."
        )
    return positions if positions.is_floating_point() else positions.float()
