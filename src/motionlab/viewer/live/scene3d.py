"""A body to walk around: one frame of a motion in 3D, the axes of a joint, and its trail.

Live, pyvista draws through trame and ipywidgets drive it. A built page has no kernel: there the
same pyvista scene is shown by vtk.js, and the page's own controls place its parts. Both work alike:
every limb is a rigid mesh that is added once, and a pose is one matrix for each part.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import ipywidgets
import numpy as np
from matplotlib.colors import to_rgb

from ...errors import ViewerError

try:
    import pyvista
except ModuleNotFoundError as error:
    raise ViewerError("a scene needs pyvista: `pip install 'pyvista[jupyter]'`.") from error

from ...motion import Motion
from ..pictures import stills
from ..pictures.paint_vtk import open_plotter
from ..pictures.picture import (
    GRID,
    Camera,
    Figure,
    capsules,
    unit,
)
from ..pictures.take import Take
from . import scene_page
from .scene_page import (
    ACCENT,
    DOTS,
    DOTS_PER_SECOND,
    FOOT_SHADE,
    HIP_SHADE,
)

MOST_TRAIL = DOTS / DOTS_PER_SECOND  # seconds
AXES = {"x": "#d55e00", "y": "#009e73", "z": "#0072b2"}  # Okabe and Ito: told apart by everybody
AXIS_LENGTH, DOT_RADIUS = 0.34, 0.018  # metres
FLOOR = 2.5  # metres from the middle to the rim
HIDDEN = np.diag([1e-6, 1e-6, 1e-6, 1.0])
COARSE = {"sides": 16, "cap": 4, "shaft": 0}  # a page carries the mesh


def scene(
    motion: Motion,
    frame: int = 0,
    joint: str | int | None = None,
    *,
    trail: float = 0.5,
    size: tuple[int, int] = (640, 420),
    color: str | None = None,
) -> Scene:
    """Show one frame of a motion in 3D, to be turned, with the axes of a joint and its trail.

    Parameters
    ----------
    motion : what moves.
    frame : the frame at first; negative counts from the end.
    joint : name, role ("left_foot") or index of the joint whose limbs are coloured, whose local
        axes are drawn (x orange, y green, z blue) and which leaves a trail; None for none.
    trail : length of the trail in seconds, at most 2; a dot every fifteenth of a second.
    size : width and height in pixels.
    color : a hex code, a name matplotlib knows, or a method's name ("mocap", "GAN1", ...).

    Returns
    -------
    What a notebook displays: live, a trame view with sliders; with the environment variable
    ``MOTIONLAB_VIEWER=page`` (a book build), plain HTML with the same controls.
    """
    return Scene(motion, frame, joint, trail, size, color)


class Scene:
    """Made by :func:`scene`. ``plotter`` is pyvista's, for whoever wants to add to it."""

    def __init__(self, motion, frame, joint, trail, size, color):
        if not isinstance(motion, Motion):
            raise ViewerError("scene draws the axes of joints: it needs a Motion, not positions.")
        if not 0 <= float(trail) <= MOST_TRAIL:
            raise ViewerError(f"trail: {trail} s is not between 0 and {MOST_TRAIL:g} s.")
        self.motion, self.size = motion, stills.check_size(size)
        self.take = Take.of(motion, color=color)
        (frame,) = self.take.check_frames([frame])
        self.orientations = motion.orientations().double().numpy()
        self.lengths = bone_axes(self.take.positions[0], self.take.bones)[1]
        self._build()
        self._aim(frame)
        self.pose(frame, find_joint(motion.skeleton, joint), float(trail))

    def pose(self, frame: int, joint: int | None, trail: float) -> None:
        """Place every part, for indices of a frame and a joint and a trail in seconds.

        The camera stays: the hips are always above the origin, and the floor moves below them.
        """
        self.frame, self.joint, self.trail = frame, joint, trail
        below = self.take.on_floor(self.take.hips[frame])
        points, bones = self.take.positions[frame] - below, self.take.bones
        self.floor.user_matrix = place(-(below % GRID) * (1, 0, 1), np.eye(3))
        for actor, shade in zip(self.shades, shadows(self.take, points), strict=True):
            actor.user_matrix = shade
        axes, lengths = bone_axes(points, bones)
        for number, actor in enumerate(self.limbs):
            # A limb between points that are not of one bone (the torso) is stretched a little.
            stretch = [1, lengths[number] / self.lengths[number], 1]
            actor.user_matrix = place(points[int(bones[number, 0])], axes[number] * stretch)
            chosen = joint is not None and bones[number, 0] == joint
            actor.prop.color = ACCENT if chosen else self.take.color
        for actor in self.arrows:
            actor.user_matrix = HIDDEN
            if joint is not None:
                actor.user_matrix = place(points[joint], self.orientations[frame, joint])
        for number, actor in enumerate(self.dots, 1):
            past = round(frame - number / DOTS_PER_SECOND * self.take.fps)
            shown = joint is not None and past >= 0 and number <= trail * DOTS_PER_SECOND + 1e-6
            actor.user_matrix = HIDDEN
            if shown:
                actor.user_matrix = place(self.take.positions[past, joint] - below, np.eye(3))

    def live(self) -> ipywidgets.VBox:
        """The trame view and its controls, for a running kernel."""
        with _without_download():
            view = self.plotter.trame.show(mode="client", add_menu=False, **_reachable())
        names = self.motion.skeleton.names
        frame = ipywidgets.IntSlider(self.frame, 0, len(self.motion) - 1, description="frame")
        joint = ipywidgets.Dropdown(
            options=[("none", None), *((name, i) for i, name in enumerate(names))],
            value=self.joint,
            description="joint",
        )
        trail = ipywidgets.FloatSlider(
            self.trail, min=0, max=MOST_TRAIL, step=1 / DOTS_PER_SECOND, description="trail, s"
        )

        def update(_change) -> None:
            self.pose(frame.value, joint.value, trail.value)
            view.viewer.update()

        for control in (frame, joint, trail):
            control.observe(update, "value")
        return ipywidgets.VBox([view, ipywidgets.HBox([frame, joint, trail])])

    def html(self, standalone: bool = False) -> str:
        """The scene as HTML without a kernel; ``standalone`` has vtk.js in it (1 MB)."""
        return scene_page.figure_html(self, standalone)

    def save(self, path: str | Path) -> Path:
        """Write the scene as one HTML file that needs nothing else."""
        return scene_page.save(self, Path(path))

    def _repr_mimebundle_(self, include=None, exclude=None):
        if os.environ.get("MOTIONLAB_VIEWER") == "page":
            return {"text/html": self.html()}
        return self.live()._repr_mimebundle_()

    # -- building ---------------------------------------------------------------------------------

    def _build(self) -> None:
        """Add every part once. ``scene.html`` counts on this order."""
        self.plotter = open_plotter(self.size)
        self.plotter.set_background("white")
        self.floor = self._add_soft(_grid_mesh())
        self.shades = [self._add_soft(_blob_mesh()) for _ in range(1 + len(self.take.body.feet))]
        bones = self.take.bones
        self.limbs = [
            self._add(_limb(length, *bone[2:]), self.take.color)
            for length, bone in zip(self.lengths, bones, strict=True)
        ]
        self.arrows = [
            self._add(pyvista.Arrow(direction=axis, scale=AXIS_LENGTH, **_ARROW), to_rgb(color))
            for axis, color in zip(np.eye(3), AXES.values(), strict=True)
        ]
        dot = pyvista.Sphere(radius=DOT_RADIUS, theta_resolution=10, phi_resolution=8)
        self.dots = [self._add(dot, to_rgb(ACCENT)) for _ in range(DOTS)]

    def _add(self, mesh: pyvista.PolyData, color, **look) -> pyvista.Actor:
        light = {"ambient": 0.5, "diffuse": 0.65, "specular": 0.1}
        quiet = {"render": False, "reset_camera": False, "show_scalar_bar": False}
        actor = self.plotter.add_mesh(mesh, color=color, **(light | quiet | look))
        actor.prop.interpolation = "Phong"
        return actor

    def _add_soft(self, mesh: pyvista.PolyData) -> pyvista.Actor:
        """Add a mesh whose points carry their own rgba."""
        look = {"scalars": "rgba", "rgba": True, "lighting": False, "line_width": 1}
        actor = self._add(mesh, None, **look)
        actor.ForceTranslucentOn()
        return actor

    def _aim(self, frame: int) -> None:
        take = self.take
        facing = stills.direction("three-quarter", take.facing[frame])
        shown = take.hull(take.figure(frame)) - take.on_floor(take.hips[frame])
        view = Camera(np.zeros(3), facing, take.height)
        view = view.fitted(shown, self.size[0] / self.size[1], margin=1.25)
        camera = self.plotter.camera
        camera.focal_point, camera.up = view.target, view.axes[1]
        camera.position = view.target + view.distance * view.direction
        camera.view_angle = np.degrees(2 * np.arctan(view.height / 2 / view.distance))
        self.plotter.renderer.camera_set = True


_ARROW = {"tip_radius": 0.08, "shaft_radius": 0.035, "tip_resolution": 16, "shaft_resolution": 12}


def find_joint(skeleton, joint: str | int | None) -> int | None:
    """Index of a joint given by name, role or index."""
    if joint is None:
        return None
    if joint in skeleton.roles:
        return skeleton.roles[joint]
    if joint in skeleton.names:
        return skeleton.names.index(joint)
    if isinstance(joint, int) and 0 <= joint < len(skeleton.names):
        return joint
    raise ViewerError(f"joint: {joint!r} is not among {', '.join(skeleton.names)}.")


def bone_axes(points: np.ndarray, bones: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrices (bones, 3, 3) whose y runs along the bone, and lengths (bones,) metres."""
    along = points[bones[:, 1].astype(int)] - points[bones[:, 0].astype(int)]
    length = np.maximum(np.linalg.norm(along, axis=-1), 1e-6)
    y = along / length[:, None]
    # A capsule is round: any x across will do. As in scene.html.
    x = unit(np.cross(y, np.where(np.abs(y[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])))
    return np.stack([x, y, np.cross(x, y)], axis=-1), length


def place(at: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """A 4 x 4 matrix from a position (3,) and axes in columns (3, 3)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, at
    return matrix


def shadows(take: Take, points: np.ndarray) -> list[np.ndarray]:
    """Matrices of the soft dark discs under hips and feet; a lifted foot has a small one."""
    discs = [(points[take.roles.get("hips", 0)], HIP_SHADE)]
    for point in take.body.feet:
        discs.append((points[point], FOOT_SHADE * np.exp(-max(points[point][1], 0) / 0.3)))
    # Just above the floor, each at its own height: surfaces in one plane flicker.
    return [
        place(np.array([at[0], 0.003 + 0.001 * number, at[2]]), np.diag([size, 1, size]))
        for number, (at, size) in enumerate(discs)
    ]


def _grid_mesh() -> pyvista.PolyData:
    """Floor lines every half metre around the origin, in pieces, so that they can fade out."""
    at = np.arange(-FLOOR, FLOOR + 0.01, GRID)
    piece = np.linspace(-FLOOR, FLOOR, 4 * len(at) + 1)
    across = [[(x, 0, a), (x, 0, b)] for x in at for a, b in pairwise(piece)]
    along = [[(a, 0, z), (b, 0, z)] for z in at for a, b in pairwise(piece)]
    points = np.array(across + along, dtype=np.float32).reshape(-1, 3)
    mesh = pyvista.line_segments_from_points(points)
    fade = np.clip(1.5 * (1 - np.linalg.norm(points, axis=-1) / FLOOR), 0, 1)
    return _with_rgba(mesh, 128, 0.6 * fade)


def _blob_mesh(rings: int = 8) -> pyvista.PolyData:
    """A black disc of radius 1, dark in the middle and clear at the rim."""
    mesh = pyvista.Disc(inner=0.01, outer=1, normal=(0, 1, 0), r_res=rings, c_res=24)
    mesh = mesh.triangulate()
    away = np.linalg.norm(mesh.points, axis=-1)
    return _with_rgba(mesh, 0, 0.4 * np.clip(1 - away, 0, 1) ** 1.5)


def _with_rgba(mesh: pyvista.PolyData, grey: int, opacity: np.ndarray) -> pyvista.PolyData:
    rgba = np.full((mesh.n_points, 4), grey, dtype=np.uint8)
    rgba[:, 3] = (255 * opacity).round()
    mesh["rgba"] = rgba
    return mesh


def _limb(length: float, radius_a: float, radius_b: float) -> pyvista.PolyData:
    """A capsule from the origin along y."""
    ends = np.array([[0.0, 0.0, 0.0], [0.0, length, 0.0]])
    vertices, normals, triangles = capsules(
        Figure(ends, np.array([[0, 1, radius_a, radius_b]]), np.zeros(3)), **COARSE
    )
    mesh = pyvista.PolyData.from_regular_faces(vertices.astype(np.float32), triangles)
    mesh.point_data.active_normals = normals.astype(np.float32)
    return mesh


@contextmanager
def _without_download() -> Iterator[None]:
    """Hide trame's second renderer, which fetches itself from the network when a server starts.

    The view is drawn by vtk.js, which lies in the trame_vtk package.
    """
    name = "trame.widgets.vtklocal"
    before = sys.modules.get(name)
    sys.modules[name] = None  # "not installed", which trame-pyvista allows for
    try:
        yield
    finally:
        del sys.modules[name]
        if before is not None:
            sys.modules[name] = before


def _reachable() -> dict:
    """On a hub (Binder) the browser reaches trame through the notebook server only."""
    prefix = os.environ.get("JUPYTERHUB_SERVICE_PREFIX")
    if prefix is None:
        return {}
    return {"server_proxy_enabled": True, "server_proxy_prefix": f"{prefix}proxy/"}
