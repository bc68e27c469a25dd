"""Motion: a skeleton and how it moves, frame by frame."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from .errors import MotionError
from .kinematics import forward_kinematics
from .skeleton import Skeleton

if TYPE_CHECKING:
    from .retargeting.flat_feet import Stance

# A frame time in a file has six digits, so a rate computed from it is off by up to 1e-4.
_RATE_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """A clip of motion. Immutable: every operation returns a new one.

    y is up, z is forward, right-handed; metres and seconds.

    Parameters
    ----------
    skeleton : the body that moves.
    root_positions : (frames, 3) metres, the root joint in the world.
    rotations : (frames, joints, 3, 3), local rotation matrices: a joint's frame to its parent's.
    fps : frames per second.
    name, source : what the clip is called and where it comes from.
    contacts : optional bool (frames, 4): left heel, left toe, right heel, right toe.

    Numpy arrays are accepted; tensors are kept, in float32.

    Raises
    ------
    MotionError : shapes disagree, a number is NaN or infinite, or the rate is not positive.
    """

    skeleton: Skeleton
    root_positions: Tensor
    rotations: Tensor
    fps: float
    name: str = ""
    source: str = ""
    contacts: Tensor | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.skeleton, Skeleton):
            raise MotionError(f"{self._label}: skeleton is {self.skeleton!r}, not a Skeleton.")
        root = self._tensor("root_positions", torch.float32)
        rotations = self._tensor("rotations", torch.float32)
        object.__setattr__(self, "fps", self._rate(self.fps))
        frames = len(root) if root.ndim else 0
        expected = (frames, self.skeleton.joints, 3, 3)
        if root.shape != (frames, 3) or rotations.shape != expected:
            raise MotionError(
                f"{self._label}: root_positions has shape {tuple(root.shape)} and rotations "
                f"{tuple(rotations.shape)}; a skeleton of {self.skeleton.joints} joints needs "
                f"(frames, 3) and (frames, {self.skeleton.joints}, 3, 3)."
            )
        # a sum is finite only if everything in it is, and costs one pass
        bad = ~torch.isfinite(root.sum(-1) + rotations.sum((1, 2, 3)))
        if bad.any():
            raise MotionError(
                f"{self._label}: frame {int(bad.nonzero()[0])} has a NaN or infinite value "
                f"({int(bad.sum())} such frames in all); cut them out or repair them first."
            )
        if self.contacts is not None:
            contacts = self._tensor("contacts", torch.bool)
            if contacts.shape != (len(root), 4):
                raise MotionError(
                    f"{self._label}: contacts has shape {tuple(contacts.shape)}, needs "
                    f"({len(root)}, 4): left heel, left toe, right heel, right toe."
                )

    def _tensor(self, field: str, dtype: torch.dtype) -> Tensor:
        """Keep a field as a tensor."""
        try:
            value = getattr(self, field)
            # an array is copied: its owner may go on writing to it
            keep = torch.as_tensor if isinstance(value, Tensor) else torch.tensor
            tensor = keep(value, dtype=dtype)
        except (TypeError, ValueError, RuntimeError) as error:
            raise MotionError(f"{self._label}: {field} must be an array: {error}.") from error
        object.__setattr__(self, field, tensor)
        return tensor

    def _rate(self, fps: float) -> float:
        try:
            rate = float(fps)
        except (TypeError, ValueError):
            rate = math.nan
        if not (math.isfinite(rate) and rate > 0):
            raise MotionError(
                f"{self._label}: {fps!r} frames per second; it must be a positive number."
            )
        return rate

    @property
    def _label(self) -> str:
        return f"Motion {self.name!r}" if self.name else "Motion"

    def __len__(self) -> int:
        return len(self.root_positions)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self)

    @property
    def seconds(self) -> float:
        """Duration in seconds: frames divided by fps."""
        return len(self) / self.fps

    def __repr__(self) -> str:
        name = f"{self.name!r}, " if self.name else ""
        return (
            f"Motion({name}{self.skeleton.joints} joints, {len(self)} frames, "
            f"{self.seconds:.2f} s, {self.fps:g} fps)"
        )

    # -- where everything is ----------------------------------------------------------------------

    def positions(self) -> Tensor:
        """Position of every point, (frames, points, 3) metres: joints first, then end sites."""
        return self._kinematics()[0]

    def orientations(self) -> Tensor:
        """World orientation of every joint, (frames, joints, 3, 3)."""
        return self._kinematics()[1]

    def _kinematics(self) -> tuple[Tensor, Tensor]:
        s = self.skeleton
        return forward_kinematics(
            s.parents, s.offsets, self.root_positions, self.rotations, s.end_parents, s.end_offsets
        )

    # -- cutting and joining ----------------------------------------------------------------------

    def __getitem__(self, frames: slice) -> Motion:
        """``motion[30:90]``, or every second frame as ``motion[::2]`` (which halves the rate)."""
        if not isinstance(frames, slice):
            raise MotionError(
                f"{self._label}: index with a slice such as motion[30:90], not {frames!r}; one "
                "frame is motion[t : t + 1]."
            )
        try:
            picked = range(len(self))[frames]
        except (TypeError, ValueError) as error:
            raise MotionError(f"{self._label}: can't be cut by {frames}: {error}.") from error
        if picked.step < 1:
            raise MotionError(
                f"{self._label}: a slice's step must be at least 1, not {picked.step}."
            )
        return self._take(picked, self.fps / picked.step)

    def _take(self, frames: range, fps: float) -> Motion:
        index = torch.arange(frames.start, frames.stop, frames.step)
        return replace(
            self,
            root_positions=self.root_positions[index],
            rotations=self.rotations[index],
            fps=fps,
            contacts=None if self.contacts is None else self.contacts[index],
        )

    def __add__(self, other: Motion) -> Motion:
        """One motion after the other, as they are."""
        return concatenate([self, other])

    # -- time -------------------------------------------------------------------------------------

    def resample(self, fps: float) -> Motion:
        """The same motion at another frame rate.

        Rotations are interpolated on the sphere (slerp), root positions linearly; a contact is
        taken from the nearest frame. Where the old rate is a multiple of the new one, frames are
        picked, not interpolated. Frame 0 stays frame 0 and no frame lies after the last.

        Raises
        ------
        MotionError : `fps` is not a positive number.
        """
        fps = self._rate(fps)
        ratio = self.fps / fps
        stride = round(ratio)
        if stride >= 1 and abs(ratio - stride) < _RATE_TOLERANCE * stride:
            return self._take(range(0, len(self), stride), fps)
        count = int(np.floor((len(self) - 1) / ratio + 1e-6)) + 1 if len(self) else 0
        when = (torch.arange(count, dtype=torch.float64) * ratio).clamp(max=max(len(self) - 1, 0))
        before = when.floor().long().clamp(max=max(len(self) - 2, 0))
        after = (before + 1).clamp(max=max(len(self) - 1, 0))
        part = (when - before).float()
        nearest = when.round().long()
        return replace(
            self,
            root_positions=torch.lerp(
                self.root_positions[before], self.root_positions[after], part[:, None]
            ),
            rotations=slerp(self.rotations[before], self.rotations[after], part[:, None]),
            fps=fps,
            contacts=None if self.contacts is None else self.contacts[nearest],
        )

    # -- left and right ---------------------------------------------------------------------------

    def mirror(self) -> Motion:
        """The motion seen in a mirror: left and right swapped, x negated.

        It lives on the mirrored skeleton, which is the same skeleton where left and right bones
        are reflections of each other, as on `Skeleton.canonical`. Joints on one side whose partner
        on the other is not known stay where they are, and a warning names them.
        """
        if alone := self.skeleton.without_partner:
            names = [self.skeleton.names[joint] for joint in alone]
            more = f" and {len(names) - 12} more" if len(names) > 12 else ""
            warnings.warn(
                f"{self._label}: which joint on the other side belongs to {', '.join(names[:12])}"
                f"{more} is not known, so these keep their side in the mirror; say which joint is "
                "which with roles={'left_foot': 'NAME', ...} where the skeleton is made or read.",
                stacklevel=2,
            )
        flip = self.rotations.new_tensor([-1.0, 1.0, 1.0])
        partners = list(self.skeleton.mirror_partners)
        # M R M for the reflection M = diag(-1, 1, 1) is a rotation again.
        rotations = self.rotations[:, partners] * (flip[:, None] * flip)
        mirrored = self.skeleton.mirrored()
        return replace(
            self,
            skeleton=self.skeleton if self.skeleton.matches(mirrored) else mirrored,
            root_positions=self.root_positions * flip,
            rotations=rotations,
            contacts=None if self.contacts is None else self.contacts[:, [2, 3, 0, 1]],
        )

    def retarget(
        self, skeleton: Skeleton | None = None, *, reference: Motion | Stance | None = None
    ) -> Motion:
        """The motion on another skeleton (None: the canonical one), see `motionlab.retargeting`."""
        from .retargeting import retarget

        return retarget(self, skeleton, reference=reference)

    def numpy(self) -> tuple[np.ndarray, np.ndarray]:
        """Copies of root positions (frames, 3) and rotations (frames, joints, 3, 3) in numpy."""
        return tuple(t.numpy(force=True).copy() for t in (self.root_positions, self.rotations))


def concatenate(motions: Iterable[Motion]) -> Motion:
    """Motions one after another, as they are: nothing is moved or blended at the seams.

    Raises
    ------
    MotionError : there is none, or they differ in skeleton or frame rate.
    """
    if isinstance(motions, Motion) or not isinstance(motions, Iterable):
        raise MotionError(
            f"concatenate takes a list of motions, as concatenate([a, b]), not {motions!r}."
        )
    motions = list(motions)
    if not motions:
        raise MotionError("Nothing to concatenate: the list of motions is empty.")
    for motion in motions:
        if not isinstance(motion, Motion):
            raise MotionError(f"Only motions can be concatenated, not {motion!r}.")
    first = motions[0]
    for number, other in enumerate(motions[1:], 1):
        if not first.skeleton.matches(other.skeleton):
            raise MotionError(
                f"Motions 0 and {number}, {first!r} and {other!r}, have different skeletons: "
                f"{first.skeleton.difference(other.skeleton)}; "
                "bring them to one skeleton before joining them."
            )
        if abs(first.fps - other.fps) > _RATE_TOLERANCE * first.fps:
            raise MotionError(
                f"{first!r} and {other!r} have different frame rates; "
                f"join them as a + b.resample({first.fps:g})."
            )
    labelled = all(m.contacts is not None for m in motions)
    return replace(
        first,
        root_positions=torch.cat([m.root_positions for m in motions]),
        rotations=torch.cat([m.rotations for m in motions]),
        contacts=torch.cat([m.contacts for m in motions]) if labelled else None,
    )


def slerp(a: Tensor, b: Tensor, part: Tensor) -> Tensor:
    """Rotation matrices a share `part` of the way from a to b, along the shorter arc.

    a, b : (..., 3, 3); part : broadcasts with (...), from 0 to 1.
    """
    import roma  # loads torch's compiler, which takes as long as the rest of torch

    turn = roma.rotmat_to_rotvec(a.mT @ b)
    return a @ roma.rotvec_to_rotmat(turn * part[..., None])
