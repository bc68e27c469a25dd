"""How the hips of another body follow its feet, which were put on the ground.

A leg that stands should be as stretched as it was: straight legs stay straight, and as a knee near
straight turns 10 degrees for 3 mm of the leg's length, this must be so to the millimetre. The hips
see to it, in every frame.
"""

from __future__ import annotations

from dataclasses import replace

import torch
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from ..feet.planting import Foot, bridged, runs
from ..roles import SIDES
from ..skeleton import Skeleton
from .rest_alignment import limb_length

_REACH, _STRETCHED = 0.998, 0.9999  # shares of its length that a leg may be stretched to
_SINK_TIME = 0.06  # seconds
# The hips go over from foot to foot within so many seconds, and to where both legs are as long as
# they should be in so many steps, short ones where that is far: two legs side by side.
_OVER, _ROUNDS, _SLACK = 0.06, 3, 0.3


def stretched(at: dict[str, Tensor], source: Skeleton, skeleton: Skeleton) -> Tensor:
    """How far in metres (2, frames) the target's legs reach if they are as stretched as they were."""
    spans = []
    for side in SIDES:
        leg = limb_length(skeleton, "leg", [side])
        scale = limb_length(skeleton, "leg") / limb_length(source, "leg")
        span = (at[f"{side}_foot"] - at[f"{side}_upper_leg"]).norm(dim=-1) / scale
        share = span / limb_length(source, "leg", [side])
        spans.append(leg * share.clamp(max=_STRETCHED))
    return torch.stack(spans)


def follow(feet: list[Foot], starts: Tensor, stretch: Tensor, fps: float) -> Tensor:
    """Metres (frames, 3) by which the hips move for legs that stand to be as stretched as wanted.

    Up or down with the feet, then the least way that brings both legs to their lengths. While no
    foot stands, it is eased from one stance to the next, and higher where feet would be below the
    floor.

    starts : (2, frames, 3) metres, where the legs start; stretch : (2, frames) metres.
    """
    on = _stood_on(feet)
    # from 0 to 1 and back over a moment, so that a body goes over from one foot to the other
    stands = torch.from_numpy(gaussian_filter1d(on.float().numpy(), _OVER * fps, mode="nearest"))
    moved = torch.zeros_like(starts[0])
    known = stands.amax(0) > 0.3
    if not known.any():
        moved[:, 1] = torch.stack([foot.depth for foot in feet]).max().clamp(min=0)
        return moved
    weights = stands / stands.sum(0).clamp(min=1e-6)
    moved[:, 1] = sum(w * foot.shift[:, 1] for w, foot in zip(weights, feet, strict=True))
    weights = stands / stands.amax(0).clamp(min=1e-6)
    ankles = torch.stack([foot.ankle for foot in feet])
    for _ in range(_ROUNDS):
        way = starts + moved - ankles
        length = way.norm(dim=-1, keepdim=True).clamp(min=1e-6)
        way = way / length
        # beside its stance a foot asks for what it does there: on its toes, its heel is yet to rise
        missing = (stretch - length[..., 0])[..., None]
        missing = weights * torch.stack(list(map(bridged, missing, on)))[..., 0]
        pulls = torch.einsum("sf,sfi,sfj->fij", weights, way, way) + _SLACK * torch.eye(3)
        moved = moved + torch.linalg.solve(pulls, (missing[..., None] * way).sum(0))
    moved = bridged(moved, known)
    carried = [replace(foot, ankle=foot.ankle - foot.shift + moved) for foot in feet]
    depth = torch.stack([foot.depth for foot in carried]).amax(0)
    moved[:, 1] += _eased(depth, fps) * (1 - 2 * stands.amax(0)).clamp(min=0)
    return moved


def _stood_on(feet: list[Foot]) -> Tensor:
    """Whether (2, frames) each foot is stood on: by its heel, or by its toes where no heel is."""
    heels = torch.stack([foot.contacts[:, 0] for foot in feet])
    stands = heels.clone()
    for foot, on in zip(feet, stands, strict=True):
        for start, end in runs(foot.touches.numpy()):
            if foot.touches[start] and not on[start:end].any():
                on[start:end] = ~heels[:, start:end].any(0)
    return stands


def sink(
    feet: list[Foot], starts: Tensor, stretch: Tensor, skeleton: Skeleton, fps: float
) -> Tensor:
    """Metres (frames,) by which the body must come down for legs to reach ankles that are held.

    No leg is stretched beyond `_REACH`, or beyond how far it was.

    starts : (2, frames, 3) metres, where the legs start; stretch : (2, frames) metres.
    """
    needed = torch.zeros(starts.shape[1])
    for side, foot, start, length in zip(SIDES, feet, starts, stretch, strict=True):
        reach = length.clamp(min=_REACH * limb_length(skeleton, "leg", [side]))
        way = start - foot.ankle
        level = (way[:, [0, 2]] ** 2).sum(-1)
        short = way[:, 1] - (reach**2 - level).clamp(min=0.01).sqrt()
        needed = needed.maximum(short.where(foot.contacts[:, 0], 0.0))
    return _eased(needed, fps)


def _eased(needed: Tensor, fps: float) -> Tensor:
    """What is needed (frames,), and no less, where it is positive; smooth."""
    needed = needed.where(needed > 1e-4, 0.0)
    sigma = _SINK_TIME * fps
    widest = maximum_filter1d(needed.numpy(), 2 * round(2 * sigma) + 1)
    return torch.from_numpy(gaussian_filter1d(widest, sigma, truncate=2))
