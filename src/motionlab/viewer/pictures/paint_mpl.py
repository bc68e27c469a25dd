"""Draw a :class:`~motionlab.viewer.pictures.picture.Picture` with matplotlib, where VTK cannot.

The same meshes and the same light; no depth buffer, so triangles are painted from far to near.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Sheet
from scipy.ndimage import map_coordinates

from .picture import Picture, capsules, floor_image, light

# Drawn this many times larger, then averaged: matplotlib's own smoothing leaves gaps between
# triangles.
SMOOTHING = 2


@contextmanager
def painter(size: tuple[int, int]) -> Iterator[Callable[[Picture], np.ndarray]]:
    """Yield a function that paints pictures of one size: rgba uint8, (height, width, 4)."""
    yield _paint


def _paint(picture: Picture) -> np.ndarray:
    width, height = picture.size
    sheet = Sheet(figsize=(width / 100, height / 100), dpi=100 * SMOOTHING)
    sheet.patch.set_alpha(0)
    canvas = FigureCanvasAgg(sheet)
    axes = sheet.add_axes((0, 0, 1, 1))
    axes.axis("off")
    up = picture.camera.height / 2
    right = up * width / height
    axes.imshow(_seen_floor(picture), extent=(-right, right, -up, up), aspect="auto")
    _paint_bodies(axes, picture)
    axes.set(xlim=(-right, right), ylim=(-up, up))
    canvas.draw()
    return _shrink(np.asarray(canvas.buffer_rgba()).astype(np.float32))


def _shrink(pixels: np.ndarray) -> np.ndarray:
    """Average SMOOTHING x SMOOTHING pixels, colours weighted by their opacity."""
    pixels[..., :3] *= pixels[..., 3:]
    steps = range(SMOOTHING)
    mean = sum(pixels[i::SMOOTHING, j::SMOOTHING] for i in steps for j in steps) / SMOOTHING**2
    mean[..., :3] /= np.maximum(mean[..., 3:], 1e-3)
    return mean.round().astype(np.uint8)


def _seen_floor(picture: Picture) -> np.ndarray:
    """What each pixel sees of the floor, rgba (height, width, 4), found by following its ray."""
    camera, floor = picture.camera, picture.floor
    width, height = picture.size
    x = ((np.arange(width) + 0.5) / width - 0.5) * camera.height * width / height
    y = (0.5 - (np.arange(height) + 0.5) / height) * camera.height
    plane = np.stack(np.broadcast_arrays(x, y[:, None], 0.0), axis=-1)
    through = camera.target + plane @ camera.axes
    ray = -camera.direction
    if camera.perspective:
        ray = through - (camera.target + camera.distance * camera.direction)
    ray = np.broadcast_to(ray, through.shape)
    depth = (floor.center[1] - through[..., 1]) / np.minimum(ray[..., 1], -1e-6)
    hit = through + depth[..., None] * ray - floor.center
    image = floor_image(picture)
    places = [
        ((hit @ axis) / half / 2 + 0.5) * cells - 0.5
        for axis, half, cells in zip(
            (floor.across, floor.along), floor.half[::-1], image.shape[:2], strict=True
        )
    ]
    return np.stack([map_coordinates(c, places, order=1) for c in np.moveaxis(image, -1, 0)], -1)


def _paint_bodies(axes, picture: Picture) -> None:
    corners, colors = [], []
    for figure in picture.figures:
        vertices, normals, triangles = capsules(figure)
        shades = light(figure, vertices, normals, picture.camera, picture.floor.center[1])
        corners.append(picture.camera.project(vertices)[triangles])
        colors.append(shades[triangles].mean(axis=1))
    corners, colors = np.concatenate(corners), np.concatenate(colors)
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    ahead = edges[:, 0, 0] * edges[:, 1, 1] > edges[:, 0, 1] * edges[:, 1, 0]
    corners, colors = corners[ahead], colors[ahead]
    order = np.argsort(corners[..., 2].mean(axis=1))
    colors = colors[order]
    # Edges in the colour of the face close the seams between triangles.
    look = {"facecolors": colors, "edgecolors": colors, "linewidths": 0.3, "antialiaseds": False}
    axes.add_collection(PolyCollection(corners[order, :, :2], **look))
