"""Curves and diagrams of motion, in matplotlib. One style for the whole book: `style.mplstyle`.

Every function returns a figure, transparent and legible on light and dark pages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...errors import ViewerError
from ...motion import Motion
from . import palette
from .plot_rollouts import pauses, recurrence, survival
from .plot_style import (
    AROUND_ZERO,
    DOT,
    INK,
    MARKED,
    SHAPES,
    SPEED,
    check_motion,
    check_named,
    check_rate,
    line_looks,
    styled,
)
from .take import check_frame

__all__ = [
    "bars", "curves", "fan", "feature_maps", "feet", "joint_map", "over_time", "pauses",
    "recurrence", "root_paths", "scatter", "shares", "survival",
]  # fmt: skip


@styled
def joint_map(motion: Motion, frame: int = 0) -> Figure:
    """The hierarchy on the body: bones as lines, joints by name, seen from the front.

    The left half of the body is named on the right of the picture, as on someone who faces you.
    """
    check_motion("joint_map", motion)
    skeleton = motion.skeleton
    points = motion.positions()[check_frame(frame, len(motion))].numpy()
    across = _across(motion, points)
    x = (points - points[0])[:, [0, 2]] @ across  # metres to the body's left
    y = points[:, 1] - points[:, 1].min()
    figure, axes = plt.subplots(figsize=(7, 6))
    for point, parent in enumerate(skeleton.point_parents):
        if parent >= 0:
            end = point >= skeleton.joints
            style = dict(color=INK if end else palette.CYCLE[0], lw=1 if end else 2.5)
            axes.plot(x[[parent, point]], y[[parent, point]], solid_capstyle="round", **style)
    joints = slice(0, skeleton.joints)
    axes.scatter(x[joints], y[joints], color=palette.CYCLE[1], s=28, zorder=3)
    _name_joints(axes, skeleton, x, y)
    axes.set(xlabel="to the body's left (m)", ylabel="height (m)", aspect="equal")
    axes.set_xlim(-1.15, 1.15)
    return figure


def _across(motion: Motion, points: np.ndarray) -> np.ndarray:
    """Unit vector on the ground, (2,) x and z, towards the body's left."""
    roles = motion.skeleton.roles
    if {"left_upper_leg", "right_upper_leg"} <= roles.keys():
        line = points[roles["left_upper_leg"]] - points[roles["right_upper_leg"]]
        line = line[[0, 2]]
        if np.linalg.norm(line) > 1e-6:
            return line / np.linalg.norm(line)
    return np.array([1.0, 0.0])


def _name_joints(axes, skeleton, x: np.ndarray, y: np.ndarray) -> None:
    """Names in two columns beside the body, in order of height, none over another."""
    left = x[: skeleton.joints] >= np.median(x[: skeleton.joints]) - 1e-3
    for side, column, align in ((True, 0.62, "left"), (False, -0.62, "right")):
        joints = [j for j in np.argsort(-y[: skeleton.joints]) if left[j] == side]
        heights = np.linspace(y.max(), 0.02, max(len(joints), 2))
        for joint, height in zip(joints, heights, strict=False):
            axes.annotate(
                skeleton.names[joint], (x[joint], y[joint]), (column, height),
                ha=align, va="center", fontsize=9,
                arrowprops=dict(arrowstyle="-", color=INK, lw=0.5, alpha=0.6),
            )  # fmt: skip


@styled
def bars(values: Sequence[float], names: Sequence[str], label: str, log: bool = False) -> Figure:
    """One bar a name, in the given order; `label` names the quantity with its unit.

    log : a logarithmic axis, on which only values above 0 can be shown.
    """
    check_named("bars", names)
    values, names = np.asarray(values, dtype=float), list(names)
    if values.shape != (len(names),):
        raise ViewerError(
            f"bars: {len(names)} names for values of shape {values.shape}; give one name a value."
        )
    if log and not (values > 0).all():
        raise ViewerError("bars: a logarithmic axis shows no value that is 0, negative or NaN.")
    figure, axes = plt.subplots(figsize=(7, 0.6 + 0.2 * len(values)))
    axes.barh(range(len(values)), values, color=palette.CYCLE[0], height=0.7)
    axes.set_yticks(range(len(values)), names, fontsize=9)
    axes.invert_yaxis()
    axes.set_xlabel(label)
    axes.grid(axis="y", visible=False)
    if log:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
    return figure


@styled
def curves(
    lines: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    x: str,
    y: str,
    log: bool | str = False,
) -> Figure:
    """Named lines ``{name: (xs, ys)}`` over labelled axes, with a mark at every value of
    a line that has at most MARKED.

    log : True for two logarithmic axes, "x" for one.

    Lines of one colour, such as those of one method, are told apart by their dashes.
    """
    check_named("curves", lines)
    figure, axes = plt.subplots()
    for look, (name, (xs, ys)) in zip(line_looks(list(lines)), lines.items(), strict=True):
        axes.plot(xs, ys, marker="o" if len(xs) <= MARKED else None, label=name, **look)
    if log == "x":
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
    elif log:
        axes.set(xscale="log", yscale="log")
        ticks = sorted({float(value) for xs, _ in lines.values() for value in xs})
        axes.set_xticks(ticks, [f"{tick:g}" if tick >= 100 else f"{tick:.3g}" for tick in ticks])
        axes.minorticks_off()
        axes.yaxis.set_major_formatter("{x:g}")
    axes.set(xlabel=x, ylabel=y)
    axes.legend()
    return figure


@styled
def scatter(
    groups: Mapping[str, tuple[Sequence[float], Sequence[float], Sequence[float]]], x: str, y: str
) -> Figure:
    """Named clouds of marks ``{name: (xs, ys, sizes)}``, each cloud of its own colour and shape.

    Areas grow with the sizes, from a dot for 0 to 9 mm across for the largest.
    """
    check_named("scatter", groups)
    for name, (xs, ys, sizes) in groups.items():
        if not len(xs) == len(ys) == len(sizes) > 0:
            raise ViewerError(
                f"scatter: {name!r} has {len(xs)} xs, {len(ys)} ys and {len(sizes)} sizes; give one "
                "of each for every mark."
            )
    figure, axes = plt.subplots(figsize=(7, 4.2))
    largest = max(float(np.max(sizes)) for *_, sizes in groups.values()) or 1.0
    for index, (name, (xs, ys, sizes)) in enumerate(groups.items()):
        areas = DOT + 600 * np.asarray(sizes, dtype=float) / largest
        color, shape = palette.color(name, index), SHAPES[index % len(SHAPES)]
        look = dict(facecolor=to_rgba(color, 0.45), edgecolor=color, lw=1.3, marker=shape)
        axes.scatter(xs, ys, s=areas, label=name, **look)
    axes.set(xlabel=x, ylabel=y)
    legend = figure.legend(
        loc="outside upper center", ncols=3
    )  # beside no mark that looks like its own
    for handle in legend.legend_handles:
        handle.set_sizes([60])  # not that of the first mark
    return figure


@styled
def over_time(
    lines: Mapping[str, Sequence[float]], fps: float, y: str, log: bool = False
) -> Figure:
    """Named lines of one value a frame, over seconds; frames that are NaN leave a gap.

    log : a logarithmic axis of values, on which those of 0 and less leave gaps, too.
    """
    check_named("over_time", lines)
    check_rate("over_time", fps)
    figure, axes = plt.subplots(figsize=(7.5, 3.2))
    for look, (name, values) in zip(line_looks(list(lines)), lines.items(), strict=True):
        values = np.asarray(values, dtype=float)
        axes.plot(np.arange(len(values)) / fps, values, label=name, **look)
    axes.set(xlabel="time (s)", ylabel=y)
    if log:
        axes.set_yscale("log", nonpositive="mask")
        axes.yaxis.set_major_formatter("{x:g}")
    if len(lines) > 1:
        axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(lines))
    return figure


@styled
def shares(
    parts: Mapping[str, Sequence[float]],
    fps: float,
    y: str,
    below: Mapping[str, Sequence[bool]] | None = None,
) -> Figure:
    """Shares of a whole over seconds, one on top of the other.

    below : {name: a truth value a frame}, drawn as bars under the shares, such as contacts.
    """
    check_named("shares", parts)
    check_rate("shares", fps)
    below = below or {}
    figure, axes = plt.subplots(figsize=(7.5, 3 + 0.3 * len(below)))
    time = np.arange(len(next(iter(parts.values())))) / fps
    colors = [palette.color(name, index) for index, name in enumerate(parts)]
    axes.stackplot(time, *parts.values(), labels=list(parts), colors=colors, lw=0)
    rows = [-0.1 - 0.12 * index for index in range(len(below))]
    for row, on in zip(rows, below.values(), strict=True):
        _spans(axes, time, np.asarray(on, dtype=bool), row, INK, height=0.08)
    axes.set_yticks([0, 0.5, 1, *rows], ["0", "0.5", "1", *below])
    axes.set(xlabel="time (s)", ylabel=y, ylim=(min([0, *rows]) - 0.06 * bool(below), 1))
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(parts), fontsize=8)
    return figure


@styled
def feature_maps(maps: Mapping[str, Sequence], fps: float, groups: Mapping[str, Mapping]) -> Figure:
    """What a network sees: features as rows of colour over time, one picture a name.

    Parameters
    ----------
    maps : {name: normalised features (frames, dim)}; red is above the mean, blue below.
    fps : frames per second.
    groups : {name: {what: slice}}, the rows that belong together, as an encoding's `slices`.
    """
    check_named("feature_maps", maps)
    check_rate("feature_maps", fps)
    for name, features in maps.items():
        if np.ndim(features) != 2 or name not in groups:
            raise ViewerError(
                f"feature_maps: {name!r} needs features (frames, dim), and its slices in groups."
            )
    heights = [np.shape(features)[1] for features in maps.values()]
    figure, rows = plt.subplots(
        len(maps), 1, figsize=(7.5, 0.8 + 0.035 * sum(heights)), sharex=True,
        height_ratios=heights, squeeze=False, layout="constrained",
    )  # fmt: skip
    for axes, (name, features) in zip(rows[:, 0], maps.items(), strict=True):
        features = np.asarray(features)
        extent = (0, len(features) / fps, features.shape[1], 0)
        look = dict(cmap=AROUND_ZERO, vmin=-2.5, vmax=2.5, interpolation="nearest")
        image = axes.imshow(features.T, aspect="auto", extent=extent, **look)
        middles = []
        for part in groups[name].values():
            middles.append((part.start + part.stop) / 2)
            axes.axhline(part.start, color=INK, lw=0.8)
        axes.set_yticks(middles, groups[name], fontsize=8)
        axes.set_title(f"{name}: {features.shape[1]} numbers a frame", fontsize=10, loc="left")
        axes.grid(visible=False)
    rows[-1, 0].set_xlabel("time (s)")
    figure.colorbar(image, ax=rows, label="standard deviations from the mean", shrink=0.6)
    return figure


@styled
def fan(paths: Mapping[str, Sequence], truth: Sequence | None = None) -> Figure:
    """Many paths over the ground from one start, seen from above.

    Parameters
    ----------
    paths : {name: (n, frames, 2) metres, x and z}; one picture each, all at one scale.
    truth : (frames, 2) metres, drawn over each, dashed.
    """
    check_named("fan", paths)
    for name, many in paths.items():
        if np.ndim(many) != 3 or np.shape(many)[2] != 2:
            raise ViewerError(
                f"fan: {name!r} has shape {np.shape(many)}; it must be (paths, frames, 2): x and z."
            )
    figure, panels = plt.subplots(
        1, len(paths), figsize=(7.5, 4), sharex=True, sharey=True, squeeze=False
    )
    for index, (axes, (name, many)) in enumerate(zip(panels[0], paths.items(), strict=True)):
        color = palette.color(name, index)
        look = dict(lw=0.8, alpha=0.5) if len(many) > 1 else dict(lw=1.2, zorder=3)  # over `truth`
        for path in np.asarray(many):
            axes.plot(*path.T, color=color, **look)
        if truth is not None:
            axes.plot(*np.asarray(truth).T, color=INK, lw=2, ls="--")
        axes.set_title(name, fontsize=10)
        axes.set(xlabel="x (m)", aspect="equal")
        axes.xaxis.set_major_locator(MaxNLocator(4))  # their numbers are wide, and panels narrow
    panels[0, 0].set_ylabel("z (m)")
    return figure


@styled
def root_paths(motions: Sequence[Motion], labels: Sequence[str] | None = None) -> Figure:
    """The way of the root over the ground, seen from above; colour is speed, a dot each second.

    Every path starts at (0, 0), so that shapes can be compared.
    """
    if not isinstance(motions, list | tuple) or not motions:
        raise ViewerError(
            f"root_paths: {motions!r} is not a list of motions; give one, as root_paths([motion])."
        )
    for motion in motions:
        check_motion("root_paths", motion, frames=2)
    if labels is None:
        labels = [motion.name for motion in motions]
    labels = [labels] if isinstance(labels, str) else list(labels)
    if len(labels) != len(motions):
        raise ViewerError(
            f"root_paths: {len(labels)} labels for {len(motions)} motions; give one for each."
        )
    figure, axes = plt.subplots(figsize=(7, 5))
    speeds = [_ground_speed(motion) for motion in motions]
    top = max(float(np.percentile(speed, 98)) for speed in speeds)
    for motion, speed, label in zip(motions, speeds, labels, strict=True):
        path = (motion.root_positions - motion.root_positions[0]).numpy()[:, [0, 2]]
        segments = np.stack([path[:-1], path[1:]], axis=1)
        lines = LineCollection(segments, array=speed, cmap=SPEED, lw=3, capstyle="round")
        lines.set_clim(0, top)
        axes.add_collection(lines)
        second = path[:: max(round(motion.fps), 1)]
        axes.scatter(*second.T, s=14, color="white", edgecolor=INK, zorder=3)
        far = path[np.linalg.norm(path, axis=-1).argmax()]  # where others rarely are
        axes.annotate(label, far, (6, 6), textcoords="offset points", fontsize=10)
    figure.colorbar(lines, ax=axes, label="speed of the root (m/s)", shrink=0.8)
    axes.set(xlabel="x (m)", ylabel="z (m)")
    axes.set_aspect("equal", adjustable="datalim")  # a straight path still gets a whole picture
    axes.margins(0.15)
    axes.autoscale_view()
    return figure


def _ground_speed(motion: Motion) -> np.ndarray:
    """(frames - 1,) m/s over the ground."""
    return motion.root_positions[:, [0, 2]].diff(dim=0).norm(dim=-1).numpy() * motion.fps


@styled
def feet(motion: Motion, threshold: float = 0.45) -> Figure:
    """Height and speed of both toes over time, and when they are slower than `threshold` m/s.

    Where the motion carries contact labels, these are drawn under the guess.
    """
    check_motion("feet", motion, frames=2)
    figure, (height, speed, contact) = plt.subplots(
        3, 1, figsize=(7.5, 5.5), sharex=True, height_ratios=(2, 2, 1)
    )
    time = np.arange(len(motion)) / motion.fps
    positions = motion.positions()
    for row, (side, color) in enumerate(zip(("left", "right"), palette.CYCLE, strict=False)):
        role = f"{side}_toes" if f"{side}_toes" in motion.skeleton.roles else f"{side}_foot"
        toe = positions[:, motion.skeleton.role(role)].numpy()
        pace = np.linalg.norm(np.gradient(toe, axis=0), axis=-1) * motion.fps
        height.plot(time, toe[:, 1] * 100, color=color, label=f"{side} toe")
        speed.plot(time, pace, color=color)
        _spans(contact, time, pace < threshold, row, color)
        if motion.contacts is not None:
            exact = motion.contacts[:, 2 * row + 1].numpy()
            _spans(contact, time, exact, row + 0.42, color, height=0.18)
    speed.axhline(threshold, color=INK, ls="--", lw=1)
    height.set(ylabel="height (cm)")
    speed.set(ylabel="speed (m/s)")
    contact.set(xlabel="time (s)", yticks=[0, 1], yticklabels=["left", "right"], ylim=(1.6, -0.5))
    contact.set_ylabel("in contact")
    contact.grid(axis="y", visible=False)
    height.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
    return figure


def _spans(axes, time: np.ndarray, on: np.ndarray, row: float, color, height: float = 0.5) -> None:
    """Bars from the first to the last frame of every run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, on, False].astype(int)))
    step = time[1] - time[0] if len(time) > 1 else 0
    runs = [(time[a], (b - a) * step) for a, b in edges.reshape(-1, 2)]
    axes.broken_barh(runs, (row - height / 2, height), color=color)
