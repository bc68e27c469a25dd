"""What a picture of bodies on a floor holds, before anybody draws it: meshes, light, floor, camera.

Two painters draw the same :class:`Picture`: VTK (``paint_vtk.py``) and, on machines where VTK
cannot render, matplotlib (``paint_mpl.py``). The light is computed here, per vertex, so that both
show the same: a key light, the sky, and the shade that limbs throw on each other and on the floor.

Arrays are numpy float64, metres, y up. Colours are rgb in 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

SIDES = 20  # vertices around a capsule
CAP, SHAFT = 5, 4  # rings of a round end; rings between the ends
KEY = np.array([-0.55, 1.0, 0.60])  # towards the key light: right, up, towards the viewer
INK = np.array([0.5, 0.5, 0.5])  # grid lines: the grey that shows on white and on black paper
UP = np.array([0.0, 1.0, 0.0])
GRID = 0.5  # metres between the lines of the floor
SHADOW_CELL, FLOOR_CELL = 0.025, 0.008  # metres
MOST_CELLS = 512  # along the shorter side of the floor


def unit(vectors: np.ndarray) -> np.ndarray:
    """Scale (..., 3) to length one; zero vectors stay zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


@dataclass(frozen=True)
class Camera:
    """Looks at ``target`` from ``direction``; sees ``height`` metres there from top to bottom."""

    target: np.ndarray
    direction: np.ndarray  # unit, from the target to the eye
    height: float
    perspective: bool = True

    @property
    def distance(self) -> float:
        return 2.6 * self.height  # a lens of 22 degrees: mild perspective, no distorted feet

    @property
    def axes(self) -> np.ndarray:
        """Rows: right, up, towards the viewer; (3, 3)."""
        upwards = np.array([0.0, 1.0, 0.0])
        if abs(self.direction[1]) > 0.99:  # from above: north of the picture is +z
            upwards = np.array([0.0, 0.0, 1.0])
        right = unit(np.cross(upwards, self.direction))
        return np.stack([right, np.cross(self.direction, right), self.direction])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Metres right and up in the picture's plane, and towards the viewer; (..., 3)."""
        seen = (points - self.target) @ self.axes.T
        if self.perspective:
            nearer = self.distance / np.maximum(self.distance - seen[..., 2:], 0.05)
            seen = np.concatenate([seen[..., :2] * nearer, seen[..., 2:]], axis=-1)
        return seen

    def fitted(self, points: np.ndarray, aspect: float, margin: float = 1.08) -> Camera:
        """The same view, moved and zoomed until all points (n, 3) are in a picture width:height."""
        camera = self
        for _ in range(4):  # perspective changes as the camera moves; parallel is done at once
            seen = camera.project(points)[:, :2]
            low, high = seen.min(axis=0), seen.max(axis=0)
            middle = (low + high) / 2
            height = margin * max(high[1] - low[1], (high[0] - low[0]) / aspect)
            target = camera.target + middle @ camera.axes[:2]
            camera = Camera(target, self.direction, height, self.perspective)
        if self.perspective:
            return camera
        # A parallel view looks the same from any distance, but what is behind the eye is not drawn.
        nearest = camera.project(points)[:, 2].max()
        return replace(camera, target=camera.target + nearest * self.direction)


@dataclass(frozen=True)
class Figure:
    """A body at one time: capsules between points, and the marks of its feet on the floor."""

    points: np.ndarray  # (points, 3)
    bones: np.ndarray  # (bones, 4): a, b, radius_a, radius_b
    color: np.ndarray  # (3,)
    marks: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # where a foot is down

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Start (bones, 3), end (bones, 3), radius at start (bones,), at end (bones,)."""
        a, b = self.bones[:, 0].astype(int), self.bones[:, 1].astype(int)
        return self.points[a], self.points[b], self.bones[:, 2], self.bones[:, 3]


@dataclass(frozen=True)
class Floor:
    """A piece of floor that fades out at its rim. ``along`` is the unit direction of its length."""

    center: np.ndarray  # (3,)
    along: np.ndarray  # (3,), horizontal
    half: tuple[float, float]  # metres from the centre to the rim, along and across
    grid: float = GRID  # metres between its lines

    @property
    def across(self) -> np.ndarray:
        return np.cross(self.along, [0.0, 1.0, 0.0])

    def at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points (..., 3) at metres u along and v across the centre."""
        return self.center + u[..., None] * self.along + v[..., None] * self.across


@dataclass(frozen=True)
class Picture:
    figures: list[Figure]
    floor: Floor
    camera: Camera
    size: tuple[int, int]  # pixels


# --- bodies ------------------------------------------------------------------------------------


def capsules(
    figure: Figure, sides: int = SIDES, cap: int = CAP, shaft: int = SHAFT
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh of a figure: vertices (n, 3), unit normals (n, 3), triangles (m, 3).

    Every capsule is the convex hull of its two end spheres. They touch the shaft not at their
    equators but where its slope touches both: at the latitude whose sine is (r_a - r_b) / length.
    """
    start, end, radius_a, radius_b = figure.ends
    length = np.linalg.norm(end - start, axis=-1)
    axis = np.where(length[:, None] > 1e-6, unit(end - start), [0.0, 1.0, 0.0])
    helper = np.where(np.abs(axis[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    side = unit(np.cross(axis, helper))
    third = np.cross(axis, side)

    seam = np.arcsin(np.clip((radius_a - radius_b) / np.maximum(length, 1e-6), -1, 1))[:, None]
    steps = np.linspace(0, 1, cap + 1)
    lower = -np.pi / 2 + steps * (seam + np.pi / 2)
    upper = seam + steps * (np.pi / 2 - seam)
    latitude = np.concatenate([lower, np.repeat(seam, shaft, axis=1), upper], axis=1)
    weight = np.concatenate(  # 0 at the start, 1 at the end of the bone
        [np.zeros(cap + 1), np.linspace(0, 1, shaft + 2)[1:-1], np.ones(cap + 1)]
    )
    around = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.cos(around)[:, None] * side[:, None] + np.sin(around)[:, None] * third[:, None]
    normals = (
        np.cos(latitude)[:, :, None, None] * ring[:, None]
        + np.sin(latitude)[:, :, None, None] * axis[:, None, None]
    )
    center = start[:, None] + weight[:, None] * (end - start)[:, None]
    radius = radius_a[:, None] + weight * (radius_b - radius_a)[:, None]
    vertices = center[:, :, None] + radius[:, :, None, None] * normals
    return (
        vertices.reshape(-1, 3),
        normals.reshape(-1, 3),
        _triangles(len(start), len(weight), sides),
    )


def _triangles(bones: int, rings: int, sides: int) -> np.ndarray:
    ring, side = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a, b = ring * sides + side, ring * sides + (side + 1) % sides
    one = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
    return (one + np.arange(bones)[:, None, None] * rings * sides).reshape(-1, 3)


def key_light(camera: Camera) -> np.ndarray:
    """Unit vector towards the key light: over the viewer's left shoulder, always from above."""
    right = camera.axes[0]
    backwards = np.cross(right, [0.0, 1.0, 0.0])
    return unit(KEY[0] * right + KEY[1] * np.array([0.0, 1.0, 0.0]) + KEY[2] * backwards)


def light(
    figure: Figure, vertices: np.ndarray, normals: np.ndarray, camera: Camera, floor: float
) -> np.ndarray:
    """Colours (n, 3) of the vertices under a key light, a bright sky and a duller floor."""
    key = np.clip(normals @ key_light(camera) * 0.8 + 0.2, 0, 1)
    sky = 0.5 + 0.5 * normals[:, 1]
    near_floor = np.exp(-np.clip(vertices[:, 1] - floor, 0, None) / 0.25)
    sky = sky * (1 - 0.5 * near_floor * (1 - sky))
    open_sky = _openness(figure, vertices, normals)
    rim = (1 - np.clip(normals @ camera.direction, 0, 1)) ** 3
    shade = open_sky * (0.44 + 0.36 * sky) + 0.52 * key * (0.45 + 0.55 * open_sky)
    # The far leg a little darker than the near one: from the side they are hard to tell apart.
    nearer = (vertices - figure.points.mean(axis=0)) @ camera.direction
    shade *= 1 + 0.9 * np.clip(nearer, -0.25, 0.1)
    color = figure.color * shade[:, None] + 0.10 * (rim * sky * open_sky)[:, None]
    return np.clip(color, 0, 1)


def _openness(figure: Figure, vertices: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Share of the sky that no other limb hides from a vertex, (n,); every limb seen as a ball."""
    start, end, radius_a, radius_b = figure.ends
    per_bone = len(vertices) // len(start)
    openness = np.ones(len(vertices))
    for bone, (a, b, r_a, r_b) in enumerate(zip(start, end, radius_a, radius_b, strict=True)):
        along = np.clip((vertices - a) @ (b - a) / max((b - a) @ (b - a), 1e-9), 0, 1)
        to = a + along[:, None] * (b - a) - vertices
        squared = np.maximum((to**2).sum(axis=-1), 1e-6)
        facing = np.clip((normals * to).sum(axis=-1) / np.sqrt(squared), 0, 1)
        hidden = facing * np.minimum((r_a + along * (r_b - r_a)) ** 2 / squared, 1)
        hidden[bone * per_bone : (bone + 1) * per_bone] = 0
        openness *= 1 - 0.6 * hidden
    return openness


# --- floor -------------------------------------------------------------------------------------


def floor_image(picture: Picture) -> np.ndarray:
    """The floor seen from above as rgba in 0..1, (across, along, 4): lines, shadows, foot marks."""
    floor = picture.floor
    # As fine as the picture's pixels, if those are coarse.
    cell = max(FLOOR_CELL, 0.75 * picture.camera.height / picture.size[1])
    u, v = _cells(floor, cell)
    beyond = np.hypot(u / floor.half[0], v / floor.half[1])
    if floor.half[0] > 1.5 * floor.half[1]:  # a strip fades at its four sides, a disc all round
        inner = 1 - floor.half[1] / floor.half[0]
        beyond = np.hypot(
            np.clip(np.abs(u) / floor.half[0] - inner, 0, None) / (1 - inner), v / floor.half[1]
        )
    fade = _smooth(1.0, 0.45, beyond)
    origin = floor.center @ floor.along, floor.center @ floor.across
    lines = np.maximum(
        _line(u + np.float32(origin[0]), floor.grid, cell),
        _line(v + np.float32(origin[1]), floor.grid, cell),
    )
    cover = fade * np.maximum(0.10, 0.42 * lines)
    dark = _enlarge(shadow(picture), u.shape) * fade

    rgba = np.empty((*u.shape, 4), dtype=np.float32)
    alpha = cover + 0.55 * dark * (1 - cover)  # black shadow over grey floor over nothing
    rgba[..., :3] = INK * (cover * (1 - 0.55 * dark) / np.maximum(alpha, 1e-6))[..., None]
    rgba[..., 3] = alpha
    for figure in picture.figures:
        for mark in figure.marks:
            away = mark - floor.center
            _stamp(rgba, np.hypot(u - away @ floor.along, v - away @ floor.across), figure.color)
    return rgba


def shadow(picture: Picture) -> np.ndarray:
    """How much of the key light the bodies keep from the floor, 0..1, on a grid of SHADOW_CELL.

    A lamp has a size: the shadow of what is near the floor is sharp, of what is high, blurred.
    """
    floor = picture.floor
    u, v = _cells(floor, SHADOW_CELL)
    towards = key_light(picture.camera)
    bright = np.ones(u.shape)
    for figure in picture.figures:
        for a, b, r_a, r_b in zip(*figure.ends, strict=True):
            ends = np.stack([a, b]) - floor.center
            tall = np.clip(ends[:, 1], 0, None)
            ends = ends - tall[:, None] * towards / towards[1]
            (ua, ub), (va, vb) = ends @ floor.along, ends @ floor.across
            reach = max(r_a, r_b) + 0.03 + 0.18 * tall.max()
            rows = slice(*np.searchsorted(v[:, 0], [min(va, vb) - reach, max(va, vb) + reach]))
            cols = slice(*np.searchsorted(u[0], [min(ua, ub) - reach, max(ua, ub) + reach]))
            pu, pv, du, dv = u[rows, cols] - ua, v[rows, cols] - va, ub - ua, vb - va
            along = np.clip((pu * du + pv * dv) / max(du * du + dv * dv, 1e-9), 0, 1)
            away = np.hypot(pu - along * du, pv - along * dv)
            blur = 0.03 + 0.18 * (tall[0] + along * (tall[1] - tall[0]))
            radius = r_a + along * (r_b - r_a)
            dark = _smooth(radius + blur, radius - blur, away) * np.minimum(1, radius / blur)
            bright[rows, cols] *= 1 - dark
    return 1 - bright


def _cells(floor: Floor, cell: float) -> tuple[np.ndarray, np.ndarray]:
    cell = max(cell, 2 * min(floor.half) / MOST_CELLS)
    along, across = (max(2, round(2 * half / cell)) for half in floor.half)
    u = (np.arange(along, dtype=np.float32) + 0.5) / along * 2 - 1
    v = (np.arange(across, dtype=np.float32) + 0.5) / across * 2 - 1
    return np.meshgrid(u * np.float32(floor.half[0]), v * np.float32(floor.half[1]))


def _line(metres: np.ndarray, grid: float, cell: float) -> np.ndarray:
    away = np.abs((metres / grid + 0.5) % 1 - 0.5) * grid
    return _smooth(max(0.014, cell), 0.004, away)


def _smooth(outer, inner, value) -> np.ndarray:
    """0 at and beyond ``outer``, 1 at and within ``inner``, smooth between."""
    t = np.clip((outer - value) / (outer - inner), 0, 1)
    return t * t * (3 - 2 * t)


def _enlarge(image: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    rows = np.linspace(0, image.shape[0] - 1, shape[0])
    cols = np.linspace(0, image.shape[1] - 1, shape[1])
    tall = np.stack([np.interp(rows, np.arange(image.shape[0]), c) for c in image.T], axis=1)
    return np.stack([np.interp(cols, np.arange(image.shape[1]), r) for r in tall])


def _stamp(rgba: np.ndarray, away: np.ndarray, color: np.ndarray) -> None:
    """Paint a ring around a foot that is down; ``away`` is every cell's distance from the foot."""
    ring = _smooth(0.024, 0.012, np.abs(away - 0.085))[..., None]
    rgba[..., :3] = rgba[..., :3] * (1 - ring) + color * ring
    rgba[..., 3:] = np.maximum(rgba[..., 3:], 0.95 * ring)
