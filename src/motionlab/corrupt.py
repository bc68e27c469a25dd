"""What cameras get wrong, made on purpose: so that the truth is known, and cleaning can be judged.

    noisy = corrupt.tremble(motion, 0.02, 0.08, generator=torch.Generator().manual_seed(0))
    seen, missing = corrupt.gap(motion, 0.5)

All chance is a `torch.Generator`'s. What was not seen is a mask, bool (frames,) or (frames, joints), as
`motionlab.filters` and `solvers.denoise` take it; there the motion holds what was last seen, as
capture software does.
"""

from __future__ import annotations

import math
from dataclasses import replace

import roma
import torch
from torch import Generator, Tensor

from .errors import MotionError
from .motion import Motion

__all__ = ["dropped", "gap", "lost_foot", "outliers", "sway", "tremble"]

WRONG_ROOT, WRONG_ANGLE = 0.2, 0.6  # m, rad: of an outlier, far beyond what trembles


def tremble(
    motion: Motion,
    root: float = 0.02,
    angle: float = 0.08,
    *,
    memory: float = 0.0,
    generator: Generator | None = None,
) -> Motion:
    """Gaussian noise on the root's place and on every rotation.

    Parameters
    ----------
    root : metres, standard deviation of each coordinate.
    angle : radians, of each coordinate of a small rotation that turns the joint further.
    memory : seconds after which noise has forgotten all but 1/e of what it was, as when a camera
        drifts; just as large at any one moment. 0: white.

    Raises
    ------
    MotionError : a size that is no number from 0.
    """
    _check("tremble", root=root, angle=angle, memory=memory)
    moves = root * _noise((len(motion), 3), motion.fps, memory, generator)
    turns = angle * _noise((len(motion), motion.skeleton.joints, 3), motion.fps, memory, generator)
    return _moved(motion, moves, turns)


def outliers(
    motion: Motion,
    share: float = 0.05,
    root: float = WRONG_ROOT,
    angle: float = WRONG_ANGLE,
    *,
    generator: Generator | None = None,
) -> tuple[Motion, Tensor]:
    """Single frames, a share of all and one at least, in which everything is wrong; and which they are.

    The mask, bool (frames,), is for who judges: whoever cleans is not told.

    Raises MotionError for a share that is not from 0 to 1, or a size that is no number from 0.
    """
    _check("outliers", root=root, angle=angle)
    wrong = _some(motion, share, generator)
    far = _moved(
        motion,
        root * torch.randn(len(motion), 3, generator=generator),
        angle * torch.randn(len(motion), motion.skeleton.joints, 3, generator=generator),
    )
    return _chosen(wrong[:, None], far, motion), wrong


def dropped(
    motion: Motion, share: float = 0.1, *, generator: Generator | None = None
) -> tuple[Motion, Tensor]:
    """Single frames, a share of all and one at least, that were not recorded; and which, bool (frames,)."""
    missing = _some(motion, share, generator)
    return _held(motion, missing[:, None]), missing


def gap(
    motion: Motion, seconds: float = 0.5, *, generator: Generator | None = None
) -> tuple[Motion, Tensor]:
    """A stretch that was not recorded, somewhere in the middle half; and which, bool (frames,).

    Raises MotionError if it is longer than half of the motion.
    """
    missing = _stretch(motion, seconds, "gap", generator)
    return _held(motion, missing[:, None]), missing


def lost_foot(
    motion: Motion, seconds: float = 1.0, side: str = "left", *, generator: Generator | None = None
) -> tuple[Motion, Tensor]:
    """A foot whose marker is lost for a while: its joints hold still in their parent's frame.

    The mask is bool (frames, joints): the foot and all below it. Raises MotionError as `gap` does,
    SkeletonError if the skeleton has no such foot.
    """
    foot = motion.skeleton.role(f"{side}_foot")
    lost = torch.zeros(motion.skeleton.joints, dtype=torch.bool)
    for joint, parent in enumerate(motion.skeleton.parents):
        lost[joint] = joint == foot or (parent >= 0 and lost[parent])
    missing = _stretch(motion, seconds, "lost_foot", generator)[:, None] & lost
    return _held(motion, missing), missing


def sway(
    motion: Motion,
    size: float = 0.03,
    period: float = 1.0,
    *,
    generator: Generator | None = None,
) -> Motion:
    """The whole body slides to and fro over the ground, so that no foot stands; smooth as a dance.

    size : metres, the amplitude of each of both ground coordinates; period : seconds, on the mean of
    two unlike oscillations. Raises MotionError for what is no positive number.
    """
    if not (0 < size < math.inf and 0 < period < math.inf):
        raise MotionError(f"sway: {size!r} m in {period!r} s; both must be positive numbers.")
    time = torch.arange(len(motion)) / motion.fps
    phase = 2 * math.pi * torch.rand(2, 2, generator=generator)
    each = [(2 * math.pi / (k * period) * time[:, None] + phase[i]).sin()
            for i, k in enumerate((0.8, 1.3))]  # fmt: skip
    moves = torch.zeros(len(motion), 3)
    moves[:, [0, 2]] = size * (each[0] + each[1]) / 2**0.5
    return replace(motion, root_positions=motion.root_positions + moves)


# -- parts ----------------------------------------------------------------------------------------


def _noise(
    shape: tuple[int, ...], fps: float, memory: float, generator: Generator | None
) -> Tensor:
    """Of deviation 1, over the first dimension with a memory of some seconds."""
    white = torch.randn(shape, generator=generator)
    kept = math.exp(-1 / (fps * memory)) if memory else 0.0
    if not kept:
        return white
    found = [white[0]]
    for new in white[1:]:
        found.append(kept * found[-1] + math.sqrt(1 - kept**2) * new)
    return torch.stack(found)


def _moved(motion: Motion, moves: Tensor, turns: Tensor) -> Motion:
    rotations = motion.rotations @ roma.rotvec_to_rotmat(turns)
    return replace(motion, root_positions=motion.root_positions + moves, rotations=rotations)


def _chosen(mask: Tensor, new: Motion, old: Motion) -> Motion:
    """New where the mask (frames, joints or 1) is true; the root's place goes with the root."""
    return replace(
        old,
        root_positions=torch.where(mask[:, :1], new.root_positions, old.root_positions),
        rotations=torch.where(mask[..., None, None], new.rotations, old.rotations),
    )


def _held(motion: Motion, missing: Tensor) -> Motion:
    """Where the mask (frames, joints or 1) is true, what was there before it began."""
    frames = torch.arange(len(motion))[:, None]
    last = torch.where(missing, 0, frames).cummax(0).values
    joints = last.expand(-1, motion.skeleton.joints)
    return replace(
        motion,
        root_positions=motion.root_positions[last[:, 0]],
        rotations=motion.rotations[joints, torch.arange(motion.skeleton.joints)],
    )


def _some(motion: Motion, share: float, generator: Generator | None) -> Tensor:
    """Frames, bool (frames,), a share of all; neither the first nor the last."""
    if not 0 < share <= 1 or len(motion) < 3:
        raise MotionError(
            f"A share of {share!r} of {len(motion)} frames; it must be above 0 and at most 1, of 3 frames "
            "or more."
        )
    count = min(max(1, round(share * len(motion))), len(motion) - 2)
    chosen = torch.zeros(len(motion), dtype=torch.bool)
    chosen[1 + torch.randperm(len(motion) - 2, generator=generator)[:count]] = True
    return chosen


def _stretch(motion: Motion, seconds: float, name: str, generator: Generator | None) -> Tensor:
    """Frames on end, bool (frames,), that begin in the middle half or before."""
    frames, long = len(motion), round(seconds * motion.fps)
    if not 1 <= long <= frames // 2:
        raise MotionError(
            f"{name}: {seconds:g} s of a motion of {motion.seconds:.2f} s; it must be a frame or more, and "
            "no more than half."
        )
    low, high = frames // 4, max(frames // 4, 3 * frames // 4 - long)
    begin = low + int(torch.randint(high - low + 1, (), generator=generator))
    chosen = torch.zeros(frames, dtype=torch.bool)
    chosen[begin : begin + long] = True
    return chosen


def _check(name: str, **sizes: float) -> None:
    for what, size in sizes.items():
        if not 0 <= size < math.inf:
            raise MotionError(f"{name}: {what} is {size!r}; it must be a number from 0.")
