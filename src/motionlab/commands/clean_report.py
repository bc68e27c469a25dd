"""The page that `motionlab clean --report` writes: before and after, and what was changed where."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from pathlib import Path

import roma
import torch
from torch import Tensor

from ..motion import Motion

WORST = 4  # joints whose curves are drawn
# Of a picture, in its own units; it is stretched to the page, its words are not.
WIDE, HIGH = 600, 90
MOST = 1200  # points of a line: a screen has no more
_STYLE = """<style>
.curve { display: grid; grid-template-columns: auto 1fr; gap: 0 0.4rem; font-size: 0.75rem; margin: 0.2rem 0 1rem; }
.curve svg { grid-row: 1 / 3; grid-column: 2; width: 100%; height: 6rem; display: block;
  border-bottom: 1px solid color-mix(in srgb, currentColor 40%, transparent); }
.curve .low { align-self: end; } .curve .high, .curve .low { text-align: right; min-width: 3.2rem; }
.curve .time { grid-column: 2; display: flex; justify-content: space-between; }
.curve polyline, .curve line { fill: none; stroke-width: 1.5; vector-effect: non-scaling-stroke; }
.curve .wild { stroke: #e0483e; stroke-width: 2; }
ul.said { margin: 0.5rem 0; padding-left: 1.2rem; }
.before { stroke: #c26a00; } .after { stroke: #1f77d0; }
.key { display: inline-block; width: 1.2em; border-top: 3px solid; vertical-align: middle; }
table { border-collapse: collapse; margin: 0.5rem 0; }
td, th { padding: 0.1rem 0.8rem 0.1rem 0; text-align: right; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
@media (max-width: 40rem) { table { font-size: 0.75rem; } td, th { padding-right: 0.4rem; } }
.wide { overflow-x: auto; } h2 { font-size: 1.05rem; margin: 1.2rem 0 0.2rem; }
</style>
"""


def write_report(
    before: Motion, after: Motion, said: Sequence[str], path: Path, wild: Sequence[int] = ()
) -> None:
    """Write the page.

    Parameters
    ----------
    before, after : of the same rig and rate.
    said : in words, what was done.
    wild : frames that were not believed. Curves are scaled by all others, and mark these.
    """
    from ..training.checkpoints import write_whole
    from ..viewer import show
    from ..viewer.live.whole_page import whole_page

    figure = show(
        [before, after], labels=["before", "after"], overlay=True, height=460, page=True,
        colors=["#c26a00", "#1f77d0"],
    )  # fmt: skip
    title = f"{before.name or 'A recording'}, cleaned"
    below = _said(said) + _below(before, after, list(wild))
    page = whole_page(figure, title, said[0] if said else "", below=below)
    write_whole(path, lambda stream: stream.write(page.encode()))


def _said(said: Sequence[str]) -> str:
    """In a list what was done, as HTML; its first line stands above the player."""
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in said[1:])
    return f'<ul class="said">{lines}</ul>' if lines else ""


def _below(before: Motion, after: Motion, wild: list[int]) -> str:
    """What stands below the player, as HTML."""
    joints, fps = before.skeleton.joints, before.fps
    far = 100 * (after.positions() - before.positions()).norm(dim=-1)[:, :joints]
    turned = _angles(before, after)
    others = torch.ones(len(before), dtype=torch.bool)
    others[wild] = False
    others |= ~others.any()
    worst = turned[others].square().mean(0).sqrt().argsort(descending=True)[:WORST].tolist()
    names = before.skeleton.names
    parts = [_STYLE, "<h2>How far joints were moved, frame by frame</h2>",
             f"<p>The mean over joints, in centimetres, over seconds.{_of_marks(wild)}</p>",
             _picture([("after", far.mean(1))], fps, "cm", others)]  # fmt: skip
    parts.append(
        '<h2>The joints that were turned most</h2><p><span class="key before"'
        ' style="border-color:#c26a00"></span> before, <span class="key after"'
        ' style="border-color:#1f77d0"></span> after: that part of the rotation vector which was '
        "changed most, in degrees, over seconds.</p>"
    )
    for joint in worst:
        turns = before.rotations[:, joint], after.rotations[:, joint]
        lines = list(zip(("before", "after"), _most_changed(*turns, others), strict=True))
        parts.append(f"<p>{html.escape(names[joint])}</p>")
        parts.append(_picture(lines, fps, "°", others))
    at = others.nonzero()[:, 0]
    its, turned = far[others], turned[others]
    rows = "".join(
        f"<tr><td>{html.escape(names[j])}</td><td>{its[:, j].mean():.1f}</td>"
        f"<td>{its[:, j].max():.1f}</td><td>{float(at[its[:, j].argmax()]) / fps:.2f}</td>"
        f"<td>{turned[:, j].mean():.1f}</td></tr>"
        for j in its.mean(0).argsort(descending=True).tolist()
    )
    without = " Frames that were not believed are left out.</p>" if wild else "</p>"
    parts.append(
        f"<h2>Joint by joint</h2><p>How far each was moved and turned.{without}"
        '<div class="wide"><table><tr><th>joint</th><th>moved, mean (cm)</th>'
        "<th>most (cm)</th><th>at (s)</th><th>turned, mean (°)</th></tr>" + rows + "</table></div>"
    )
    return "\n".join(parts)


def _of_marks(wild: list[int]) -> str:
    """In words, what the marks of curves are."""
    if not wild:
        return ""
    frames = "a frame that was" if len(wild) == 1 else f"{len(wild)} frames that were"
    return f" A red line marks {frames} not believed, where a curve may leave the picture."


def _angles(before: Motion, after: Motion) -> Tensor:
    """Degrees (frames, joints) by which each joint was turned, relative to its parent."""
    turns = roma.rotmat_to_rotvec(before.rotations.mT @ after.rotations)
    return turns.norm(dim=-1).rad2deg()


def _most_changed(before: Tensor, after: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
    """One part (frames,) of both rotation vectors about the mean after, in degrees.

    That which was changed most in `others`, bool (frames,).
    """
    mean = roma.special_procrustes(after.mean(0))
    vectors = [roma.rotmat_to_rotvec(mean.mT @ turns).rad2deg() for turns in (before, after)]
    part = int((vectors[0] - vectors[1])[others].square().mean(0).argmax())
    return vectors[0][:, part], vectors[1][:, part]


def _picture(lines: list[tuple[str, Tensor]], fps: float, unit: str, others: Tensor) -> str:
    """Lines (frames,) by their classes over time, as SVG, scaled by `others`, bool (frames,), and the
    rest marked."""
    values = torch.cat([line[others] for _, line in lines])
    low, high = float(values.min()), float(values.max())
    low, high = (low, high) if high - low > 1e-3 else (low - 1, high + 1)
    frames = len(lines[0][1])
    across = lambda t: WIDE * t / max(1, frames - 1)
    up = lambda value: 2 + (HIGH - 4) * (high - min(max(value, low), high)) / (high - low)
    step = max(1, math.ceil(frames / MOST))
    drawn = "".join(
        f'<line class="wild" x1="{across(t):.1f}" x2="{across(t):.1f}" y1="0" y2="10">'
        f"<title>frame {t}, not believed</title></line>"
        for t in (~others).nonzero()[:, 0].tolist()
    ) + "".join(
        f'<polyline class="{name}" points="'
        + " ".join(f"{across(t):.1f},{up(float(line[t])):.1f}" for t in range(0, frames, step))
        + '"/>'
        for name, line in lines
    )
    return (
        f'<div class="curve"><span class="high">{high:.0f} {unit}</span>'
        f'<span class="low">{low:.0f} {unit}</span>'
        f'<svg viewBox="0 0 {WIDE} {HIGH}" preserveAspectRatio="none" role="img" '
        f'aria-label="from {low:.0f} to {high:.0f} {unit}, over time">{drawn}</svg>'
        f'<span class="time"><span>0 s</span><span>{(frames - 1) / fps:.1f} s</span></span></div>'
    )
