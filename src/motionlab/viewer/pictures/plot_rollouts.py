"""Pictures of what becomes of long rollouts: how many last, what returns in them, when they pause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
import torch
from matplotlib.figure import Figure
from torch import Tensor

from ...errors import ViewerError
from ...metrics import heading_frame
from ...skeleton import Skeleton
from . import palette
from .plot_style import check_named, line_looks, styled


@styled
def survival(lines: Mapping[str, Sequence[float]], horizon: float) -> Figure:
    """Share of rollouts that still go on, over seconds on a logarithmic axis.

    Parameters
    ----------
    lines : {name: seconds until failure, one a rollout}, infinite for one that never failed.
    horizon : seconds for which all of them were watched.

    Names that differ after a comma only have one colour, and other dashes.
    """
    check_named("survival", lines)
    looks = line_looks([name.partition(",")[0] for name in lines])
    figure, axes = plt.subplots(figsize=(7.5, 3.6))
    first = horizon / 20_000
    for look, (name, seconds) in zip(looks, lines.items(), strict=True):
        seconds = np.sort(np.asarray(seconds, dtype=float))
        if not len(seconds) or not (seconds >= 0).all():  # NaN is not
            raise ViewerError(f"survival: {name!r} needs seconds of 0 or more; it has {seconds}.")
        failed = seconds[seconds <= horizon].clip(min=first)
        going = 1 - np.arange(len(failed) + 1) / len(seconds)
        axes.step(
            [first, *failed, horizon], [*going, going[-1]], where="post", label=name, lw=2, **look
        )
    axes.set(xscale="log", xlim=(first, horizon), ylim=(-0.03, 1.03))
    axes.set(xlabel="time (s)", ylabel="share still going")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.legend()
    return figure


@styled
def recurrence(positions: Tensor, skeleton: Skeleton, fps: float) -> Figure:
    """How far apart the poses of a motion are at any two moments: stripes are returns.

    positions : (frames, points, 3) metres. Poses are compared in the body's heading frame, at no
        more than 300 moments; a distance is the mean over points.
    """
    every = max(1, -(-len(positions) // 300))
    pose = heading_frame(positions[::every], skeleton)[0]
    apart = torch.stack([(pose - one).norm(dim=-1).mean(-1) for one in pose])
    end = len(positions) / fps
    figure, axes = plt.subplots(figsize=(6, 5))
    image = axes.imshow(
        100 * apart.numpy(), origin="lower", extent=(0, end, 0, end),
        cmap=plt.get_cmap("viridis", 8), interpolation="nearest",  # a page that weighs a quarter
    )  # fmt: skip
    axes.set(xlabel="time (s)", ylabel="time (s)")
    axes.grid(visible=False)
    figure.colorbar(image, label="mean distance of a point (cm)", shrink=0.8)
    return figure


@styled
def pauses(found: Mapping[str, Sequence[tuple[float, float]]], horizon: float) -> Figure:
    """When rollouts stand still, a row each: bars where they do, pale where they go on.

    Parameters
    ----------
    found : {name: (start, end) of each pause in seconds}, as `motionlab.metrics.stagnations` says.
    horizon : seconds for which all of them were watched.
    """
    check_named("pauses", found)
    figure, axes = plt.subplots(figsize=(7.5, 0.8 + 0.24 * len(found)))
    for row, (name, times) in enumerate(found.items()):
        if not all(0 <= start <= end <= horizon for start, end in times):
            raise ViewerError(
                f"pauses: {name!r} has {list(times)}; a pause starts and ends, in this order, "
                f"within the {horizon:g} seconds of the horizon."
            )
        axes.barh(row, horizon, height=0.6, color=palette.CYCLE[0], alpha=0.25)
        still = [(start, end - start) for start, end in times]
        axes.broken_barh(still, (row - 0.3, 0.6), color=palette.CYCLE[1])
    axes.set(xlim=(0, horizon), xlabel="time (s)", yticks=range(len(found)), yticklabels=found)
    axes.invert_yaxis()
    axes.grid(visible=False)
    return figure
