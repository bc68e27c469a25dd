"""Do the feet hold the ground? Sliding in contact, sinking into the floor, floating above it.

Feet are the four joints that contacts speak of: heels (ankle joints) and toes. Their heights are
taken relative to where they lie when the foot stands flat: as high above the floor as in the
skeleton's rest pose above y = 0, which must stand there as `Skeleton.canonical` does.

Speeds are differences over `step` seconds, rounded to whole frames, at least one. It is a time and
not a frame, since a label's edge is a frame wide: at twice the frame rate more of a foot's setting
down and lifting off would lie between two labelled frames.
"""

from __future__ import annotations

from torch import Tensor

from ..errors import MetricError
from ..feet.contacts import foot_points, rest_heights, stands_on_floor
from ..skeleton import Skeleton
from .checks import check_contacts, check_frames, check_positive, check_rate, check_skeleton

_TOES = [1, 3]


def foot_skate(
    positions: Tensor, contacts: Tensor, skeleton: Skeleton, fps: float, step: float = 1 / 30
) -> Tensor:
    """Mean speed over the ground of feet that should rest, in cm/s.

    Every stretch of `step` seconds throughout which a joint carries the contact label counts once,
    all joints alike; only motion in the ground plane counts. A foot that slides at 10 cm/s scores
    10.

    Parameters
    ----------
    positions : (..., frames, points, 3) metres.
    contacts : bool (..., frames, 4), left heel, left toe, right heel, right toe; or (..., frames,
        2), the two toes alone.
    skeleton : says which points the feet are.
    fps : frames per second.
    step : seconds between the places that are compared.

    Returns
    -------
    (...) centimetres per second; NaN where nothing stays in contact for a step.

    Raises
    ------
    MetricError : wrong shapes, no two frames a step apart, NaN, contacts that are not bool.
    SkeletonError : the skeleton has no feet.
    """
    slide, held = _slides(positions, contacts, skeleton, fps, step)
    return 100 * _mean(slide, held)


def foot_skate_ratio(
    positions: Tensor,
    contacts: Tensor,
    skeleton: Skeleton,
    fps: float,
    speed: float = 0.5,
    step: float = 1 / 30,
) -> Tensor:
    """Share of contact in which a foot slides faster than `speed`, from 0 to 1.

    The form of Karunratanakul et al., *Guided Motion Diffusion*, ICCV 2023: there a foot skates if
    it moves more than 2.5 cm between frames at 20 fps, which is 0.5 m/s, and is lower than 5 cm.
    Here contact is what the labels say, and the share is of time in contact, not of all frames.

    Parameters
    ----------
    positions, contacts, skeleton, fps, step : as for `foot_skate`.
    speed : metres a second over the ground.

    Returns
    -------
    (...), without unit; NaN where nothing stays in contact for a step.

    Raises
    ------
    MetricError, SkeletonError : as `foot_skate`.
    """
    slide, held = _slides(positions, contacts, skeleton, fps, step)
    return _mean((slide > check_positive(speed, "speed")).to(slide), held)


def foot_skate_weighted(
    positions: Tensor,
    skeleton: Skeleton,
    fps: float,
    height: float = 0.025,
    floor: float = 0.0,
    step: float = 1 / 30,
) -> Tensor:
    """Sliding weighted by nearness to the floor, in cm/s; needs no contact labels.

    Zhang et al., *Mode-Adaptive Neural Networks for Quadruped Motion Control*, SIGGRAPH 2018:
    speed over the ground v of a joint at height h counts v (2 - 2^(h / H)) where h < H, fully on
    the floor and not at all from H upwards. Mean over all frames and all four joints, so that a
    foot in the air counts as zero. The paper's H is 2.5 cm. Feet that hold perfectly do not score
    0: heels peel off and toes swing through within H of the floor, which comes to 10 to 20 cm/s in
    a walk. Compare with real motion of the same speed only.

    Parameters
    ----------
    positions, skeleton, fps, step : as for `foot_skate`.
    height : H in metres, above where the joint lies when the foot stands flat.
    floor : height of the floor in metres.

    Returns
    -------
    (...) centimetres per second.

    Raises
    ------
    MetricError, SkeletonError : as `foot_skate`.
    """
    feet, stride = _feet(positions, skeleton), _stride(step, fps)
    speeds = _ground_speeds(feet, stride, fps)
    above = _clearance(positions, skeleton, floor)
    above = (above[..., :-stride, :] + above[..., stride:, :]) / 2  # in the middle of the step
    weight = 2 - 2 ** (above / check_positive(height, "height")).clamp(0, 1)
    return 100 * (speeds * weight).mean((-2, -1))


def penetration(positions: Tensor, skeleton: Skeleton, floor: float = 0.0) -> Tensor:
    """How deep the deepest foot joint is in the floor in each frame, in cm.

    A joint has sunk in where it lies lower than in a foot that stands flat. Take the mean over
    frames for a clip, or the maximum for its worst moment.

    Parameters
    ----------
    positions, skeleton : as for `foot_skate`.
    floor : height of the floor in metres.

    Returns
    -------
    (..., frames) centimetres, 0 where no joint is too low.

    Raises
    ------
    MetricError, SkeletonError : as `foot_skate`.
    """
    return 100 * (-_clearance(positions, skeleton, floor).amin(-1)).clamp(min=0)


def floating(
    positions: Tensor, skeleton: Skeleton, floor: float = 0.0, contacts: Tensor | None = None
) -> Tensor:
    """How high above the floor the body stands in each frame, in cm.

    Without contacts: the height of the lowest foot joint above where it lies in a foot that stands
    flat; 0 in a walk, above 0 in the flight of a run. With contacts: the mean over the joints that
    are labelled, which should be 0 in a run as well.

    Parameters
    ----------
    positions, skeleton, contacts : as for `foot_skate`.
    floor : height of the floor in metres.

    Returns
    -------
    (..., frames) centimetres, at least 0; with contacts NaN in frames without any.

    Raises
    ------
    MetricError, SkeletonError : as `foot_skate`.
    """
    above = 100 * _clearance(positions, skeleton, floor).clamp(min=0)
    if contacts is None:
        return above.amin(-1)
    contacts = check_contacts(contacts, positions)
    above = above[..., _TOES] if contacts.shape[-1] == 2 else above
    return (above * contacts).sum(-1) / contacts.sum(-1)


def _clearance(positions: Tensor, skeleton: Skeleton, floor: float) -> Tensor:
    """Height (..., frames, 4) of heels and toes above where they lie in a foot that stands flat."""
    feet = _feet(positions, skeleton)
    flat = rest_heights(skeleton)
    if not stands_on_floor(skeleton):
        raise MetricError(
            f"The rest pose of {skeleton!r} does not stand on the floor y = 0: there its feet lie "
            f"{100 * flat.min():.0f} to {100 * flat.max():.0f} cm high. Heights of feet can't be "
            "told from it; use motion.retarget() first."
        )
    return feet[..., 1] - (flat.to(feet) + floor)


def _feet(positions: Tensor, skeleton: Skeleton) -> Tensor:
    """Heels and toes (..., frames, 4, 3)."""
    return check_skeleton(positions, skeleton)[..., foot_points(skeleton), :]


def _stride(step: float, fps: float) -> int:
    """Frames in a step, at least one."""
    return max(1, round(check_positive(step, "step") * check_rate(fps)))


def _ground_speeds(feet: Tensor, stride: int, fps: float) -> Tensor:
    """Speed in the ground plane over every stride, (..., frames - stride, joints) m/s."""
    check_frames(feet.shape[-3], stride + 1, "positions")
    ground = feet[..., [0, 2]]
    return (ground[..., stride:, :, :] - ground[..., :-stride, :, :]).norm(dim=-1) * fps / stride


def _slides(
    positions: Tensor, contacts: Tensor, skeleton: Skeleton, fps: float, step: float
) -> tuple[Tensor, Tensor]:
    """Ground speed over every stride, and whether the joint is in contact throughout."""
    feet, stride = _feet(positions, skeleton), _stride(step, fps)
    contacts = check_contacts(contacts, positions)
    feet = feet[..., _TOES, :] if contacts.shape[-1] == 2 else feet
    speeds = _ground_speeds(feet, stride, fps)
    return speeds, contacts.unfold(-2, stride + 1, 1).all(-1)


def _mean(values: Tensor, chosen: Tensor) -> Tensor:
    """Mean of the chosen values over frames and joints; NaN (0 / 0) where none is."""
    return (values * chosen).sum((-2, -1)) / chosen.sum((-2, -1))
