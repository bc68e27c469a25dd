"""Pictures of what becomes of long rollouts: how many last, and what returns in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
import torch
from matplotlib.figure import Figure
from torch import Tensor

from ..errors import ViewerError
from ..metrics import heading_frame
from ..skeleton import Skeleton
from . import palette
from .plot_style import check_named, styled


@styled
def survival(lines: Mapping[str, Sequence[float]], horizon: float) -> Figure:
    """Share of rollouts that still go on, over seconds on a logarithmic axis.

    Parameters
    ----------
    lines : {name: seconds until failure, one a rollout}, infinite for one that never failed.
    horizon : seconds for which all of them were watched.
    """
    check_named("survival", lines)
    figure, axes = plt.subplots(figsize=(7.5, 3.6))
    first = horizon / 1000
    for index, (name, seconds) in enumerate(lines.items()):
        seconds = np.sort(np.asarray(seconds, dtype=float))
        if not len(seconds) or not (seconds >= 0).all():  # NaN is not
            raise ViewerError(f"survival: {name!r} needs seconds of 0 or more; it has {seconds}.")
        failed = seconds[seconds <= horizon].clip(min=first)
        going = 1 - np.arange(len(failed) + 1) / len(seconds)
        axes.step(
            [first, *failed, horizon], [*going, going[-1]], where="post", label=name,
            color=palette.color(name, index), lw=2,
        )  # fmt: skip
    axes.set(xscale="log", xlim=(first, horizon), ylim=(-0.03, 1.03))
    axes.set(xlabel="time (s)", ylabel="share still going")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.legend()
    return figure


@styled
def recurrence(positions: Tensor, skeleton: Skeleton, fps: float) -> Figure:
    """How far apart the poses of a motion are at any two moments: stripes are returns.

    positions : (frames, points, 3) metres. Poses are compared in the body's heading frame, at no
        more than 600 moments; a distance is the mean over points.
    """
    every = max(1, -(-len(positions) // 600))
    pose = heading_frame(positions[::every], skeleton)[0]
    apart = torch.stack([(pose - one).norm(dim=-1).mean(-1) for one in pose])
    end = len(positions) / fps
    figure, axes = plt.subplots(figsize=(6, 5))
    image = axes.imshow(
        100 * apart.numpy(), origin="lower", extent=(0, end, 0, end), cmap="viridis", aspect="equal"
    )
    axes.set(xlabel="time (s)", ylabel="time (s)")
    axes.grid(visible=False)
    figure.colorbar(image, label="mean distance of a point (cm)", shrink=0.8)
    return figure
