"""A motion made ready to be drawn: numpy positions, a body on them, where it faces and stands."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral, Real

import numpy as np
import torch
from matplotlib.colors import to_rgb
from scipy.ndimage import gaussian_filter1d

from ...errors import ViewerError
from . import palette
from .body import Body, body
from .picture import GRID, UP, Figure, capsules, unit

FLOOR_SLACK = 0.15  # metres, as in the player
FOLLOW_SECONDS = 0.5  # the following camera ignores what is quicker


def check_frame(frame: int, count: int) -> int:
    """A plain index from 0 into `count` frames; negative ones count from the end."""
    try:
        index = operator.index(frame)
    except TypeError as error:
        raise ViewerError(f"frame {frame!r} is not a whole number; round it.") from error
    if not -count <= index < count:
        raise ViewerError(f"frame {index} is not in this motion of {count} frames.")
    return index % count


def _rate(fps: float) -> float:
    if not isinstance(fps, Real) or not 0 < fps < math.inf:  # NaN is not either
        raise ViewerError(f"fps is {fps!r}; give frames per second, a positive number as 30.")
    return float(fps)


@dataclass(frozen=True)
class Take:
    """Positions (frames, points, 3) in metres: the skeleton's points, then the body's extras.

    A body that is too small for a picture is magnified (`Body.magnified`), and its way with it.
    """

    positions: np.ndarray
    fps: float
    body: Body
    roles: dict[str, int]
    color: np.ndarray  # rgb in 0..1
    contacts: np.ndarray | None  # bool (frames, 4); None if they are not to be drawn

    @classmethod
    def of(cls, motion, *, color=None, contacts=False, skeleton=None, fps=None) -> Take:
        """Take a Motion, or positions (frames, points, 3) with their skeleton and rate."""
        if isinstance(motion, list | tuple):
            raise ViewerError(
                "a list can't be drawn: give one motion at a time, or play several with "
                "motionlab.show([a, b])."
            )
        fps = None if fps is None else _rate(fps)
        skeleton = skeleton if skeleton is not None else getattr(motion, "skeleton", None)
        if skeleton is None:
            raise ViewerError(
                "an array of positions can't be drawn without its skeleton; "
                "pass skeleton=..., or pass a Motion."
            )
        is_motion = hasattr(motion, "positions")
        places = torch.as_tensor(motion.positions() if is_motion else motion).detach().float().cpu()
        if places.ndim != 3 or places.shape[1:] != (skeleton.points, 3) or not len(places):
            raise ViewerError(
                f"positions have shape {tuple(places.shape)}; this skeleton needs "
                f"(frames, {skeleton.points}, 3) with at least one frame."
            )
        if not torch.isfinite(places).all():
            bad = ~torch.isfinite(places).flatten(1).all(dim=1)
            raise ViewerError(f"positions of frame {int(bad.nonzero()[0])} hold NaN or infinity.")
        if contacts and getattr(motion, "contacts", None) is None:
            raise ViewerError(
                "contacts=True, but this motion has no contact labels; draw "
                "dataclasses.replace(motion, contacts=labels), with labels of shape (frames, 4), "
                "or leave contacts=False."
            )
        dress = body(skeleton)
        if not (dress.bones and torch.cat([skeleton.offsets[1:], skeleton.end_offsets]).any()):
            raise ViewerError(
                f"{skeleton!r} has no bone with a length, so there is no body to draw."
            )
        return cls(
            positions=dress.magnified * dress.points(places).double().numpy(),
            fps=float(motion.fps if is_motion else fps or 30.0),
            body=dress,
            roles=dict(skeleton.roles),
            color=np.array(to_rgb(palette.check_color("mocap" if color is None else color))),
            contacts=np.asarray(motion.contacts) if contacts else None,
        )

    def check_frames(self, frames: Sequence[int]) -> list[int]:
        """Plain indices from 0; negative ones count from the end."""
        checked = [check_frame(frame, len(self.positions)) for frame in frames]
        if not checked:
            raise ViewerError("no frame to draw; name at least one.")
        return checked

    def spread(self, count: int) -> np.ndarray:
        """Frames evenly over the motion, `count` of them or all that there are."""
        if not isinstance(count, Integral) or count < 1:
            raise ViewerError(
                f"frames: {count!r} bodies can't be drawn; give a whole number from 1 on, or a "
                "list of frames."
            )
        last = len(self.positions) - 1
        return np.linspace(0, last, min(count, last + 1)).round().astype(int)

    @cached_property
    def bones(self) -> np.ndarray:
        """Capsules (bones, 4): points a and b, radii there in metres."""
        return np.array(self.body.bones) * [1, 1, self.body.magnified, self.body.magnified]

    @property
    def grid(self) -> float:
        """Metres of the picture between the lines of the floor, which are 0.5 m apart."""
        return GRID * self.body.magnified

    def figure(self, frame: int) -> Figure:
        """The body at a frame, its feet marked where they are down."""
        marks = np.zeros((0, 3))
        if self.contacts is not None and self.body.feet:
            marks = self.positions[frame, np.array(self.body.feet)[self.contacts[frame]]]
        return Figure(self.positions[frame], self.bones, self.color, marks)

    @cached_property
    def hips(self) -> np.ndarray:
        """(frames, 3)."""
        return self.positions[:, self.roles.get("hips", 0)]

    @cached_property
    def facing(self) -> np.ndarray:
        """Horizontal unit vector (frames, 3) to where the body faces; +z where hips are unknown."""
        ahead = np.tile([0.0, 0.0, 1.0], (len(self.positions), 1))
        pair = [self.roles.get(f"{side}_upper_leg") for side in ("left", "right")]
        if None not in pair:
            left, right = (self.positions[:, joint] for joint in pair)
            found = np.cross(left - right, UP)
            known = np.linalg.norm(found, axis=-1) > 1e-3
            ahead[known] = unit(found[known])
        return ahead

    @cached_property
    def mean_facing(self) -> np.ndarray:
        mean = self.facing.mean(axis=0)
        return unit(mean) if np.linalg.norm(mean) > 0.2 else self.facing[0]

    @cached_property
    def ground(self) -> float:
        """Height of the floor: where the lowest limb is in all but the lowest 2 % of the frames.

        Zero if that is far from zero: who is in the air all the time has left the floor there.
        """
        low = self.positions[:, self.bones[:, :2].astype(int), 1] - self.bones[:, 2:]
        sole = float(np.quantile(low.min(axis=(1, 2)), 0.02))
        return sole if abs(sole) < FLOOR_SLACK * self.body.magnified else 0.0

    @cached_property
    def height(self) -> float:
        """About how tall the body stands: its greatest extent above the floor, metres."""
        return float(max(self.positions[..., 1].max() - self.ground, 0.2))

    @cached_property
    def followed(self) -> np.ndarray:
        """Points on the floor (frames, 3) for a camera to follow: the smoothed way of the hips."""
        way = gaussian_filter1d(self.hips, FOLLOW_SECONDS * self.fps, axis=0, mode="nearest")
        return self.on_floor(way)

    def on_floor(self, points: np.ndarray) -> np.ndarray:
        """The points straight below, on the floor."""
        below = np.array(points, dtype=np.float64)
        below[..., 1] = self.ground
        return below

    def poses_at(self, way: np.ndarray) -> np.ndarray:
        """Points (n, 3) of many poses, moved to where a camera that follows ``way`` starts."""
        some = np.linspace(0, len(way) - 1, min(len(way), 100)).astype(int)
        return (self.positions[some] - way[some, None] + way[0]).reshape(-1, 3)

    @staticmethod
    def hull(figure: Figure) -> np.ndarray:
        """Every vertex of the drawn body, (n, 3)."""
        return capsules(figure)[0]
