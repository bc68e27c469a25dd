"""Fréchet distance: do hands, feet and head of generated motion move as those of real motion do?

Positions and velocities of the end effectors in the heading frame, in windows of a second, are
brought to 32 principal components of the real ones. The distance is that of two Gaussians there
(Dowson and Landau 1982), squared as usual; Heusel et al. 2017 made it common for pictures. Unlike
the manifold distance it also rises when samples lack the variety of the data.

It depends on how many windows there are: few are far from anything. So a value means something
only beside that of real against real motion of like number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from ..errors import MetricError
from ..skeleton import Skeleton
from .checks import check_frames, check_positions, check_positive, check_rate, check_skeleton
from .heading_frame import heading_frame

EFFECTORS = (
    ("left_hand",),
    ("right_hand",),
    ("left_toes", "left_foot"),
    ("right_toes", "right_foot"),
    ("head",),
)


class Moments(NamedTuple):
    """What the distance needs of a set of windows: their number, sum and sum of squares."""

    count: int
    total: Tensor  # (components,)
    square: Tensor  # (components, components)


def frechet_distance(
    samples: Sequence[Tensor],
    real: Sequence[Tensor],
    skeleton: Skeleton,
    fps: float,
    window: float = 1.0,
    components: int = 32,
) -> float:
    """Squared Fréchet distance of generated from real motion, without unit; 0 is alike.

    A multiple of the variance of one channel: see `Frechet`, which also gives intervals.

    Parameters
    ----------
    samples, real : clips of positions, each (frames, points, 3), or one tensor of them.
    skeleton : their body.
    fps : frames per second of all of them.
    window : seconds of a window.
    components : principal components that are kept.

    Raises
    ------
    MetricError : clips that are shorter than a window, or no more windows than components.
    """
    reference = Frechet.fit(real, skeleton, fps, window, components)
    return reference.distance([reference.moments(clip, fps) for clip in _listed(samples)])


@dataclass(frozen=True, eq=False)
class Frechet:
    """Real motion to which any number of samples is compared; made by `Frechet.fit`.

        reference = Frechet.fit(real, skeleton, fps=30)
        moments = [reference.moments(clip, fps=30) for clip in samples]
        reference.distance(moments)
        jackknife(moments, reference.distance)          # interval over clips

    Positions count in multiples of the real positions' deviation, velocities of the velocities'
    (root mean square over all channels), so that neither metres nor seconds matter.
    """

    skeleton: Skeleton
    window: float
    rate: float
    scales: Tensor  # (2,): of positions and velocities
    mean: Tensor  # (window frames * channels,)
    basis: Tensor  # (window frames * channels, components)
    real: Moments

    @classmethod
    def fit(
        cls,
        real: Sequence[Tensor],
        skeleton: Skeleton,
        fps: float,
        window: float = 1.0,
        components: int = 32,
        rate: float = 30.0,
    ) -> Frechet:
        """Principal components and moments of real clips (frames, points, 3).

        rate : frames per second to which clips of any rate are brought before they are cut into
            windows, one every third of a window.
        """
        window, rate = check_positive(window, "window"), check_positive(rate, "rate")
        clips = [_windows(clip, skeleton, fps, window, rate) for clip in _listed(real)]
        windows = torch.cat(clips)
        if len(windows) <= components or components < 1:
            raise MetricError(
                f"Frechet.fit: {len(windows)} windows of real motion for {components} principal "
                "components; give more or longer clips, or ask for fewer components."
            )
        scales = (windows - windows.mean(0)).square().mean((0, 1, 3)).sqrt().clamp(min=1e-12)
        flat = (windows / scales[:, None]).flatten(1)
        mean = flat.mean(0)
        _, vectors = torch.linalg.eigh((flat - mean).mT @ (flat - mean))
        basis = vectors[:, -components:].flip(1)
        moments = _moments((flat - mean) @ basis)
        return cls(skeleton, window, rate, scales, mean, basis, moments)

    def moments(self, positions: Tensor, fps: float) -> Moments:
        """What the distance needs of one clip (frames, points, 3)."""
        windows = _windows(positions, self.skeleton, fps, self.window, self.rate)
        return _moments(((windows / self.scales[:, None]).flatten(1) - self.mean) @ self.basis)

    def distance(self, clips: Sequence[Moments]) -> float:
        """Squared Fréchet distance of a set of clips from the real ones.

        Raises MetricError if they have no more windows than there are components.
        """
        ours = _sum(clips)
        components = self.basis.shape[1]
        if ours.count <= components:
            raise MetricError(
                f"Frechet.distance: {ours.count} windows for {components} principal components; "
                "give more or longer clips, or ask for fewer components."
            )
        return gaussian_distance(*_gaussian(ours), *_gaussian(self.real))


def gaussian_distance(
    mean: Tensor, covariance: Tensor, mean_2: Tensor, covariance_2: Tensor
) -> float:
    """Squared Fréchet distance of two Gaussians: ``|m1 - m2|² + tr(C1 + C2 - 2 (C1 C2)^½)``."""
    values, vectors = torch.linalg.eigh(covariance)
    root = (vectors * values.clamp(min=0).sqrt()) @ vectors.mT
    # C1 C2 and C1^½ C2 C1^½ have the same eigenvalues, and the second is symmetric
    shared = torch.linalg.eigvalsh(root @ covariance_2 @ root).clamp(min=0).sqrt().sum()
    apart = (mean - mean_2).square().sum()
    return max(0.0, float(apart + covariance.trace() + covariance_2.trace() - 2 * shared))


def effector_motion(positions: Tensor, skeleton: Skeleton, fps: float) -> Tensor:
    """End effectors in the heading frame: (..., frames, 2, effectors * 3), positions and velocities.

    Hands, toes (feet where there are none) and head; in the unit of positions, and the same a
    second. Velocities are those over the ground, turned into the heading frame: a foot in contact
    has none.

    Raises
    ------
    MetricError : wrong shape, fewer than two frames, NaN, another skeleton's points, a bad rate.
    SkeletonError : the skeleton lacks hands, feet or head, hips or shoulders.
    """
    positions, fps = check_skeleton(positions, skeleton, 2), check_rate(fps)
    points = [_effector(skeleton, roles) for roles in EFFECTORS]
    local, rotation = heading_frame(positions, skeleton)
    velocity = torch.gradient(positions[..., points, :], spacing=1 / fps, dim=-3)[0] @ rotation
    return torch.stack([local[..., points, :].flatten(-2), velocity.flatten(-2)], dim=-2)


def _effector(skeleton: Skeleton, roles: tuple[str, ...]) -> int:
    for role in roles:
        if role in skeleton.roles:
            return skeleton.roles[role]
    return skeleton.role(roles[0])  # which says what is there


def _listed(clips: Sequence[Tensor]) -> list[Tensor]:
    clips = list(clips)
    if not clips:
        raise MetricError("The Fréchet distance needs clips; the list is empty.")
    return clips


def _windows(
    positions: Tensor, skeleton: Skeleton, fps: float, window: float, rate: float
) -> Tensor:
    """Windows (windows, frames, 2, channels) of one clip, brought to a rate."""
    fps, positions = check_rate(fps), check_positions(positions, minimum_frames=2)
    if positions.ndim != 3:
        raise MetricError(
            f"positions has shape {tuple(positions.shape)}; a clip is (frames, points, 3)."
        )
    resampled = _resampled(positions.detach().double(), rate / fps)
    length = max(2, round(window * rate))
    check_frames(len(resampled), length, f"a clip of {len(positions) / fps:.2f} s at {rate:g} fps")
    motion = effector_motion(resampled, skeleton, rate)
    return motion.unfold(0, length, max(1, length // 3)).movedim(-1, 1)


def _resampled(values: Tensor, ratio: float) -> Tensor:
    """Values (frames, ...) at another rate, by linear interpolation; the first stays the first."""
    count = int((len(values) - 1) * ratio + 1e-6) + 1
    when = torch.arange(count, dtype=values.dtype, device=values.device) / ratio
    before = when.floor().long().clamp(max=len(values) - 2)
    part = (when - before).clamp(0, 1).reshape(-1, *[1] * (values.ndim - 1))
    return torch.lerp(values[before], values[before + 1], part)


def _moments(values: Tensor) -> Moments:
    return Moments(len(values), values.sum(0), values.mT @ values)


def _sum(clips: Sequence[Moments]) -> Moments:
    counts, totals, squares = zip(*_listed(clips), strict=True)
    return Moments(sum(counts), torch.stack(totals).sum(0), torch.stack(squares).sum(0))


def _gaussian(moments: Moments) -> tuple[Tensor, Tensor]:
    """Mean and unbiased covariance."""
    mean = moments.total / moments.count
    outer = moments.square - moments.count * mean[:, None] * mean
    return mean, outer / (moments.count - 1)
