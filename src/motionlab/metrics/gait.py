"""How a body travels: speed, turn rate, and the steps that carry it."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from ..feet.contacts import foot_points, velocities
from ..feet.strides import stances, strikes
from ..skeleton import Skeleton
from .checks import check_contacts, check_positions, check_positive, check_rate, check_skeleton


def speed(positions: Tensor, fps: float, window: float = 1.0) -> Tensor:
    """Speed of the root over the ground in each frame, in m/s.

    The straight way covered in a window around the frame, by the time it took, so that the sway of
    the steps does not count: choose the window about as long as one gait cycle. On a bend the chord
    is shorter than the arc, by 1 % for half a radian within the window.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres, at least two frames; point 0 is the root.
    fps : frames per second.
    window : seconds; near the ends of the motion only the half that is there.

    Returns
    -------
    (..., frames) metres per second. For a whole clip take the mean over frames.

    Raises
    ------
    MetricError : wrong shape, fewer than two frames, NaN, a bad rate or window.
    """
    root = check_positions(positions, None, 2)[..., :1, [0, 2]]
    half = check_positive(window, "window") / 2
    return velocities(root, check_rate(fps), half).norm(dim=-1)[..., 0]


def turn_rate(positions: Tensor, skeleton: Skeleton, fps: float, window: float = 1.0) -> Tensor:
    """How fast the body turns about the vertical in each frame, in rad/s; positive to its left.

    Parameters
    ----------
    positions, fps, window : as for `speed`.
    skeleton : says where hips and shoulders are, see `facing`.

    Returns
    -------
    (..., frames) radians per second.

    Raises
    ------
    MetricError : as `speed`.
    SkeletonError : the skeleton lacks hips or shoulders.
    """
    yaw = facing(check_positions(positions, None, 2), skeleton)
    turn = yaw.diff(dim=-1)
    turn = torch.atan2(turn.sin(), turn.cos())  # the short way round
    yaw = torch.cat([yaw[..., :1], yaw[..., :1] + turn.cumsum(-1)], -1)
    half = check_positive(window, "window") / 2
    return velocities(yaw[..., None, None], check_rate(fps), half)[..., 0, 0]


def facing(positions: Tensor, skeleton: Skeleton) -> Tensor:
    """Where the body faces, (..., frames) radians about y: 0 is +z, and +pi/2 is +x.

    At right angles to the line across hips and shoulders (Holden et al. 2015), so that it needs no
    rotations and fits any skeleton. The joints alone suffice.

    Raises
    ------
    MetricError : wrong shape, NaN.
    SkeletonError : the skeleton lacks hips or shoulders.
    """
    positions = check_skeleton(positions, skeleton)
    across = sum(
        positions[..., skeleton.role(f"left_{part}"), :]
        - positions[..., skeleton.role(f"right_{part}"), :]
        for part in ("upper_leg", "upper_arm")
    )
    return torch.atan2(-across[..., 2], across[..., 0])  # across x up is forward


def cadence(contacts: Tensor, fps: float, shortest: float = 0.07) -> Tensor:
    """Steps per minute, both feet together.

    From the first to the last strike that is seen. A strike is the frame in which a foot, by heel
    or toe, comes into contact.

    Parameters
    ----------
    contacts : bool (..., frames, 4): left heel, left toe, right heel, right toe; or (..., frames,
        2): the toes.
    fps : frames per second.
    shortest : seconds; gaps in a contact, and contacts, that are shorter are taken for flicker.

    Returns
    -------
    (...) steps per minute; NaN where there are fewer than two strikes, as in standing.

    Raises
    ------
    MetricError : wrong shape, not bool, a bad rate.
    """
    contacts, fps = check_contacts(contacts), check_rate(fps)
    check_positive(shortest, "shortest")
    result = []
    for clip in contacts.reshape(-1, *contacts.shape[-2:]).numpy(force=True):
        down = [frame for frame, _ in strikes(clip, fps, shortest)]
        steps, frames = len(down) - 1, np.ptp(down) if down else 0
        result.append(60 * fps * steps / frames if frames else np.nan)
    return torch.tensor(result, device=contacts.device).reshape(contacts.shape[:-2])


def step_length(
    positions: Tensor, contacts: Tensor, skeleton: Skeleton, fps: float, shortest: float = 0.07
) -> Tensor:
    """Mean length of a step, in metres: half the way from a footfall to the same foot's next.

    Half a stride, so that the width of the stance does not count (Whittle, *Gait Analysis*). Where
    a foot stands is the mean of heel and toe over its contact; only contacts that begin and end
    within the motion count.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres.
    contacts, fps, shortest : as for `cadence`.
    skeleton : says which points the feet are.

    Returns
    -------
    (...) metres; NaN where no foot comes down twice.

    Raises
    ------
    MetricError : wrong shapes, NaN, contacts that are not bool, a bad rate.
    SkeletonError : the skeleton has no feet.
    """
    positions, fps = check_skeleton(positions, skeleton), check_rate(fps)
    contacts = check_contacts(contacts, positions)
    check_positive(shortest, "shortest")
    ground = positions[..., foot_points(skeleton), :][..., [0, 2]].double()
    feet = ground.unflatten(-2, (2, 2)).mean(-2)  # heel and toe of each foot
    result = []
    for clip, labels in zip(
        feet.reshape(-1, *feet.shape[-3:]).numpy(force=True),
        contacts.reshape(-1, *contacts.shape[-2:]).numpy(force=True),
        strict=True,
    ):
        steps = []
        for foot, spans in enumerate(stances(labels, fps, shortest)):
            whole = [(a, b) for a, b in spans if a > 0 and b < len(clip)]
            places = np.array([clip[a:b, foot].mean(0) for a, b in whole]).reshape(-1, 2)
            steps.extend(np.linalg.norm(np.diff(places, axis=0), axis=1) / 2)
        result.append(np.mean(steps) if steps else np.nan)
    return torch.tensor(result, device=positions.device).to(positions).reshape(feet.shape[:-3])
