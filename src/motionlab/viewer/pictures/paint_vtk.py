"""Draw a :class:`~motionlab.viewer.pictures.picture.Picture` with pyvista, off-screen."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pyvista
from vtkmodules.vtkCommonCore import vtkObject

from .picture import Picture, capsules, floor_image, light

SMOOTHING = 2  # rendered this many times larger, then averaged: no jagged edges


@contextmanager
def painter(size: tuple[int, int]) -> Iterator[Callable[[Picture], np.ndarray]]:
    """Yield a function that paints pictures of one size, in pixels.

    It gives rgba uint8 (height, width, 4) on transparent ground. One window serves them all:
    to open one takes longer than to draw a body.
    """
    plotter = open_plotter(tuple(SMOOTHING * side for side in size), lighting="none")
    plotter.set_background("black")
    plotter.disable_anti_aliasing()  # done better, and once, by _shrink
    try:
        plotter.show(auto_close=False)
        plotter.image_transparent_background = True
        yield lambda picture: _paint(plotter, picture)
    finally:
        plotter.close()


def open_plotter(size: tuple[int, int], **options) -> pyvista.Plotter:
    """A pyvista plotter that needs no display, and does not complain that there is none."""
    loud = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        # notebook=False: in a notebook, show() would start a trame server and display the window.
        return pyvista.Plotter(off_screen=True, notebook=False, window_size=list(size), **options)
    finally:
        vtkObject.SetGlobalWarningDisplay(loud)


def _paint(plotter: pyvista.Plotter, picture: Picture) -> np.ndarray:
    plotter.clear_actors()
    _add_floor(plotter, picture)
    for figure in picture.figures:
        vertices, normals, triangles = capsules(figure)
        colors = light(figure, vertices, normals, picture.camera, picture.floor.center[1])
        plotter.add_mesh(
            pyvista.PolyData.from_regular_faces(vertices, triangles),
            scalars=(255 * colors).round().astype(np.uint8),
            rgb=True,
            lighting=False,
            show_scalar_bar=False,
            render=False,
        )
    _aim(plotter, picture)
    plotter.render()
    return _shrink(plotter.image)


def _add_floor(plotter: pyvista.Plotter, picture: Picture) -> None:
    floor = picture.floor
    u, v = np.array([-1, 1, 1, -1.0]), np.array([-1, -1, 1, 1.0])
    corners = floor.at(u * floor.half[0], v * floor.half[1])
    plane = pyvista.PolyData.from_regular_faces(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    plane.active_texture_coordinates = np.stack([u, v], axis=-1) / 2 + 0.5
    # pyvista counts the rows of a texture from the top, texture coordinates from the bottom.
    image = (255 * floor_image(picture)[::-1]).round().astype(np.uint8)
    texture = pyvista.Texture(np.ascontiguousarray(image))
    texture.interpolate = True
    texture.mipmap = True
    plotter.add_mesh(plane, texture=texture, lighting=False, render=False)


def _aim(plotter: pyvista.Plotter, picture: Picture) -> None:
    view = picture.camera
    camera = plotter.camera
    camera.focal_point = view.target
    camera.position = view.target + view.distance * view.direction
    camera.up = view.axes[1]
    camera.parallel_projection = not view.perspective
    camera.parallel_scale = view.height / 2
    camera.view_angle = np.degrees(2 * np.arctan(view.height / 2 / view.distance))
    plotter.renderer.ResetCameraClippingRange()
    plotter.renderer.camera_set = True


def _shrink(pixels: np.ndarray) -> np.ndarray:
    """Average SMOOTHING x SMOOTHING pixels; undo that colours were mixed with the black behind."""
    mean = (
        sum(
            pixels[row::SMOOTHING, col::SMOOTHING].astype(np.float32)
            for row in range(SMOOTHING)
            for col in range(SMOOTHING)
        )
        / SMOOTHING**2
    )
    mean[..., :3] *= 255 / np.maximum(mean[..., 3:], 0.25)
    return np.clip(mean.round(), 0, 255).astype(np.uint8)
