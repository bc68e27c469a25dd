"""A map of poses: point at a place, and see the body there; drag, and see it move.

    viewer.pose_map(poses, skeleton, dots=places, labels=kinds)

The poses lie on a grid and are found beforehand; between them the figure is drawn halfway. So it is the
same in a notebook and in a built page: a few lines of HTML, no kernel.
"""

from __future__ import annotations

import html
import json
import uuid
from collections.abc import Sequence

import torch
from torch import Tensor

from ...errors import ViewerError
from ...skeleton import Skeleton
from ..pictures import palette
from .figure import PageFigure

MOST = 2_000  # poses, and dots

_PAGE = """
<figure class="motionlab-pose-map" id="{key}">
<style>
#{key} .both {{ display: flex; flex-wrap: wrap; gap: 1em; }}
#{key} canvas {{ flex: 1 1 240px; min-width: 0; max-width: 420px; height: 300px; border-radius: 4px;
  background: rgba(128, 128, 128, .08); touch-action: none; }}
#{key} canvas.map {{ cursor: crosshair; }}
#{key} .key {{ display: inline-block; width: .8em; height: .8em; border-radius: 50%; margin: 0 .3em 0 1em; }}
</style>
<div class="both"><canvas class="map" tabindex="0" role="application"
aria-label="A map of poses: click or drag, or use the arrow keys"></canvas>
<canvas class="body" role="img" aria-label="The pose at the place that was chosen"></canvas></div>
<p>{legend}</p>
{caption}
<script>
(() => {{
  const figure = document.getElementById("{key}");
  const {{ rows, columns, poses, parents, dots, colors }} = {content};
  const [map, body] = figure.querySelectorAll("canvas");
  const at = dots.length ? {{ x: dots[0][0], y: dots[0][1] }} : {{ x: 0.5, y: 0.5 }};
  const paint = (canvas) => {{
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth || 300, canvas.clientHeight || 300];
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    return [pen, width, height];
  }};
  const pose = () => {{
    const [x, y] = [at.x * (columns - 1), at.y * (rows - 1)];
    const [i, j] = [Math.min(columns - 2, Math.floor(x)), Math.min(rows - 2, Math.floor(y))];
    const [u, v] = [x - i, y - j];
    const of = (a, b) => poses[b * columns + a];
    return of(i, j).map((_, k) => (1 - v) * ((1 - u) * of(i, j)[k] + u * of(i + 1, j)[k])
      + v * ((1 - u) * of(i, j + 1)[k] + u * of(i + 1, j + 1)[k]));
  }};
  const draw = () => {{
    const ink = getComputedStyle(figure).color;
    let [pen, width, height] = paint(map);
    dots.forEach(([x, y, kind]) => {{
      pen.fillStyle = colors[kind];
      pen.globalAlpha = 0.6;
      pen.beginPath();
      pen.arc(x * width, (1 - y) * height, 2.5, 0, 7);
      pen.fill();
    }});
    pen.globalAlpha = 1;
    pen.strokeStyle = ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(at.x * width, (1 - at.y) * height, 7, 0, 7);
    pen.stroke();
    const points = pose();
    figure.dataset.pose = points.map(Math.round).join();
    [pen, width, height] = paint(body);
    const scale = height / 2000;  // of millimetres
    const place = (k) => {{  // seen from a little aside
      const [x, y, z] = points.slice(3 * k, 3 * k + 3);
      return [width / 2 + scale * (0.5 * x + 0.87 * z), height - 20 - scale * y
        - scale * 0.15 * (0.87 * x - 0.5 * z)];
    }};
    pen.strokeStyle = "{color}";
    pen.lineWidth = 5;
    pen.lineCap = "round";
    parents.forEach((parent, k) => {{
      if (parent < 0) return;
      pen.beginPath();
      pen.moveTo(...place(parent));
      pen.lineTo(...place(k));
      pen.stroke();
    }});
    pen.strokeStyle = ink;
    pen.globalAlpha = 0.3;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(0, height - 20);
    pen.lineTo(width, height - 20);
    pen.stroke();
  }};
  const within = (value) => Math.min(1, Math.max(0, value));
  const follow = (event) => {{
    const box = map.getBoundingClientRect();
    at.x = within((event.clientX - box.left) / box.width);
    at.y = within(1 - (event.clientY - box.top) / box.height);
    draw();
  }};
  map.addEventListener("pointerdown", (event) => {{
    map.setPointerCapture(event.pointerId);
    follow(event);
  }});
  map.addEventListener("pointermove", (event) => event.buttons && follow(event));
  map.addEventListener("keydown", (event) => {{
    const step = {{ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }}[event.key];
    if (!step) return;
    event.preventDefault();
    at.x = within(at.x + step[0] / 40);
    at.y = within(at.y + step[1] / 40);
    draw();
  }});
  new ResizeObserver(draw).observe(map);
  draw();
}})();
</script>
</figure>
"""


def pose_map(
    poses: Tensor,
    skeleton: Skeleton,
    *,
    dots: Tensor | None = None,
    labels: Sequence[str] | None = None,
    color: str = "STRNN",
    caption: str | None = None,
) -> PageFigure:
    """A map on which one points, and the body beside it.

    Parameters
    ----------
    poses : (rows, columns, joints, 3) metres, two or more each way: poses of a grid, the first row at the
        bottom of the map.
    skeleton : whose joints they are.
    dots : (n, 2), places that are marked, from 0 to 1 from left to right and from bottom to top.
    labels : of each dot, its kind; each kind has a colour.
    color : of the body, a method's name or a colour.
    caption : a text below.

    Raises
    ------
    ViewerError : wrong shapes, NaN, dots off the map, more than 2000 poses or dots.
    """
    poses = torch.as_tensor(poses)
    if poses.ndim != 4 or min(poses.shape[:2]) < 2 or poses.shape[2:] != (skeleton.joints, 3):
        raise ViewerError(
            f"pose_map: poses of shape {tuple(poses.shape)}; they must be (rows, columns, "
            f"{skeleton.joints}, 3), two or more each way."
        )
    dots = poses.new_zeros(0, 2) if dots is None else torch.as_tensor(dots)
    labels = [""] * len(dots) if labels is None else list(labels)
    if dots.ndim != 2 or dots.shape[1] != 2 or len(labels) != len(dots):
        raise ViewerError(
            f"pose_map: dots of shape {tuple(dots.shape)} with {len(labels)} labels; they must be (n, "
            "2), with a label each."
        )
    if not bool(poses.isfinite().all()) or not bool(((dots >= 0) & (dots <= 1)).all()):
        raise ViewerError("pose_map: a pose holds a NaN, or a dot lies beyond 0 to 1.")
    count = poses.shape[0] * poses.shape[1]
    if max(count, len(dots)) > MOST:
        raise ViewerError(
            f"pose_map: {count} poses and {len(dots)} dots; a page holds {MOST} of each."
        )
    kinds = list(dict.fromkeys(labels))
    colors = [palette.color(kind, i) for i, kind in enumerate(kinds)]
    content = {
        "rows": poses.shape[0], "columns": poses.shape[1], "parents": list(skeleton.parents),
        "poses": (1000 * poses).round().int().flatten(2).flatten(0, 1).tolist(), "colors": colors,
        "dots": [
            [round(float(x), 4), round(float(y), 4), kinds.index(label)]
            for (x, y), label in zip(dots, labels, strict=True)
        ],
    }  # fmt: skip
    legend = "".join(
        f'<span class="key" style="background: {its}"></span>{html.escape(kind)}'
        for kind, its in zip(kinds, colors, strict=True) if kind
    )  # fmt: skip
    return PageFigure(
        _PAGE.format(
            key=f"pose-map-{uuid.uuid4().hex[:8]}",
            content=json.dumps(content, separators=(",", ":")),
            legend=legend,
            color=palette.check_color(color),
            caption=f"<figcaption>{html.escape(caption)}</figcaption>" if caption else "",
        )
    )
