"""Does motion that is made window by window jump where one ends and the next begins?"""

from __future__ import annotations

from numbers import Integral
from typing import NamedTuple

import torch
from torch import Tensor

from ..errors import MetricError
from .checks import check_positions


class Seams(NamedTuple):
    """Across seams over elsewhere (...), without unit; 1 if seams can't be told from other frames."""

    steps: Tensor
    accelerations: Tensor


def seam_jumps(positions: Tensor, window: int) -> Seams:
    """How much larger steps and second differences are across the seams of windows than elsewhere.

    The "periodic jumps" of STRNN (section 4.1.1) and of Martinez et al. (2017). The step across a seam
    goes from the last frame of a window to the first of the next one; two second differences hold it.
    Sizes are norms of points, averaged over points and frames.

    Parameters
    ----------
    positions : (..., frames, points, 3), the first frame that of a window; 2 windows or more.
    window : frames of a window, 4 or more: in shorter ones nothing is elsewhere.

    Raises
    ------
    MetricError : wrong shape, a shorter window or fewer frames, NaN.
    """
    if not isinstance(window, Integral) or window < 4:
        raise MetricError(f"seam_jumps: window is {window!r}; it must be 4 frames or more.")
    positions = check_positions(positions, minimum_frames=2 * window)
    sizes = [positions.diff(n=order, dim=-3).norm(dim=-1).mean(-1) for order in (1, 2)]
    return Seams(*(_ratio(size, window, order + 1) for order, size in enumerate(sizes)))


def _ratio(sizes: Tensor, window: int, order: int) -> Tensor:
    """Mean of sizes (..., frames - order) whose frames lie in two windows, over that of all others."""
    first = torch.arange(sizes.shape[-1], device=sizes.device)
    across = first // window != (first + order) // window
    return sizes[..., across].mean(-1) / sizes[..., ~across].mean(-1)
