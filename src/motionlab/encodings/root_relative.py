"""Points relative to the root, as Zhou et al. (2018) feed them to their network (acLSTM)."""

from __future__ import annotations

import math

import roma
import torch
from torch import Tensor

from ..errors import EncodingError
from ..kinematics import heading
from ..motion import Motion
from ..skeleton import Skeleton
from .base import (
    check_features,
    check_motion,
    check_rate,
    check_skeleton,
    motion_through,
    number,
    skeleton_config,
)
from .effectors import body_points, effector_joints, moving
from .path import Start, read_start, total, turned, walk

HEIGHTS = ("absolute", "difference")


class RootRelative:
    """``[dx y dz | every other point minus the root]``, world axes, metres (acLSTM, section 4).

    Turning the motion turns the features (they are equivariant to yaw), so the network sees a walk
    in each direction as another walk; the ground position is gone. Nothing keeps a bone's length.

    Parameters
    ----------
    skeleton : the body.
    fps : frames per second; a displacement is one frame long.
    stature : metres. Features are those of a body scaled to this standing height, as the 1.54 m of
        the paper; decoding scales back. None leaves the body as it is.
    height : "absolute", the default: the root's height above the ground, as in the paper's code.
        "difference": its change, as in the paper's text. Decoded heights then start from the rest
        pose standing on the ground, or from a fourth number in `start`: (x, z, yaw, height).

    `start`'s yaw turns the whole motion; as the features face the way the motion did, `start_of`
    gives yaw 0.

    Raises
    ------
    EncodingError : bad arguments, or a stature for a skeleton whose rest pose does not stand.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        fps: float = 30.0,
        stature: float | None = None,
        height: str = "absolute",
    ) -> None:
        if height not in HEIGHTS:
            raise EncodingError(f"height is {height!r}; it must be one of {list(HEIGHTS)}.")
        if stature is not None and not 0 < number(stature) < math.inf:
            raise EncodingError(f"stature is {stature!r}; it must be a positive number of metres.")
        self.skeleton, self.fps = check_skeleton(RootRelative, skeleton), check_rate(fps)
        self.stature, self.height = stature, height
        self._rest = body_points(skeleton, torch.eye(3).expand(skeleton.joints, 3, 3))
        self._scale = 1.0 if stature is None else stature / _standing_height(skeleton, self._rest)
        self.points, self.point_names = skeleton.points, skeleton.point_names
        self.dim = 3 * self.points
        self.slices = {"root": slice(0, 3), "pose": slice(3, self.dim)}
        root = ("dx", "y" if height == "absolute" else "dy", "dz")
        others = tuple(f"{point}_{axis}" for point in self.point_names[1:] for axis in "xyz")
        self.feature_names = root + others

    @property
    def effector_names(self) -> tuple[str, ...]:
        """What `end_effectors` gives, in its order."""
        return tuple(effector_joints(self.skeleton))

    # -- motion to features -----------------------------------------------------------------------

    def encode(self, motion: Motion) -> Tensor:
        """Features (frames, dim); see `Encoding.encode`."""
        check_motion(self, motion)
        others = body_points(self.skeleton, motion.rotations)[:, 1:]
        root = motion.root_positions.double()
        steps = root.diff(dim=0)
        steps = torch.cat([steps[:1], steps]) if len(steps) else torch.zeros_like(root)
        if self.height == "absolute":
            steps = torch.stack([steps[:, 0], root[:, 1], steps[:, 2]], dim=1)
        return (torch.cat([steps, others.double().flatten(1)], dim=1) * self._scale).float()

    def start_of(self, motion: Motion) -> Tensor:
        """x, z and yaw 0 of frame 0; with height="difference" a fourth number, its height."""
        check_motion(self, motion)
        x, y, z = motion.root_positions[0].double()
        start = [x, z, torch.zeros_like(x)]
        return torch.stack(start if self.height == "absolute" else [*start, y])

    # -- features to motion -----------------------------------------------------------------------

    def positions(self, features: Tensor, start: Start | None = None) -> Tensor:
        """Points (..., frames, points, 3); see `Encoding.positions`."""
        features = check_features(self, features)
        default = (0.0, 0.0, 0.0) if self.height == "absolute" else (0.0, 0.0, 0.0, self._floor)
        x, z, yaw, *height = read_start(start, features, default)
        root, others = self._points(features)
        still = torch.zeros_like(root[..., 0])
        path, yaw = walk(torch.stack([root[..., 0], root[..., 2], still], dim=-1), [x, z, yaw])
        up = total(height[0], root[..., 1]) if height else root[..., 1]
        root = torch.stack([path[..., 0], up, path[..., 2]], dim=-1)[..., None, :]
        return torch.cat([root, root + turned(others, yaw[..., None])], dim=-2)

    def to_motion(
        self, features: Tensor, start: Start | None = None, name: str = "", source: str = ""
    ) -> Motion:
        """The motion whose points come nearest, by IK; see `Encoding.to_motion`."""
        features = check_features(self, features, frames_only=True).detach()
        return motion_through(self, self.positions(features, start), None, name, source)

    def end_effectors(self, features: Tensor) -> Tensor:
        """Positions and velocities (..., frames, effectors, 6); see `Encoding.end_effectors`.

        Which way the root faces is told by its neighbours, the upper legs and the spine. With
        height="difference" heights start from the rest pose standing on the ground.
        """
        features = check_features(self, features)
        root, others = self._points(features)
        up = root[..., 1]
        if self.height == "difference":
            up = total(self._floor, up)
        still = torch.zeros_like(up)
        place = torch.stack([still, up, still], dim=-1)[..., None, :]
        points = torch.cat([place, place + others], dim=-2)
        steps = torch.stack([root[..., 0], root[..., 2], still], dim=-1)
        effectors = list(effector_joints(self.skeleton).values())
        return moving(points[..., effectors, :], steps, self.fps, self._facing(points))

    def contacts(self, features: Tensor) -> None:
        """None: the paper's rows have no contacts."""
        return None

    def _points(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """The root's three numbers and the other points relative to it, on the skeleton's scale."""
        metres = features / self._scale
        return metres[..., :3], metres[..., 3:].unflatten(-1, (-1, 3))

    @property
    def _floor(self) -> float:
        """Height of the root when the rest pose stands on the ground."""
        return -float(self._rest[:, 1].min())

    def _facing(self, points: Tensor) -> Tensor:
        """Yaw of the root (..., frames), from points that its bones hold in place."""
        now, rest = self._pelvis(points), self._pelvis(self._rest.to(points))
        return heading(torch.einsum("...ab,cb->...ac", now, rest))

    def _pelvis(self, points: Tensor) -> Tensor:
        """Frame (..., 3, 3) of the hips: x from right to left leg, y towards the trunk."""
        left, right, trunk = _pelvis_joints(self.skeleton, self._rest)
        across = points[..., left, :] - points[..., right, :]
        middle = (points[..., left, :] + points[..., right, :]) / 2
        frame = torch.stack([across, points[..., trunk, :] - middle], dim=-1)
        return roma.special_gramschmidt(frame, epsilon=1e-9)

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """Settings for `motionlab.encodings.from_config`."""
        return {
            "encoding": "RootRelative",
            "skeleton": skeleton_config(self.skeleton),
            "fps": self.fps,
            "stature": self.stature,
            "height": self.height,
        }


def _standing_height(skeleton: Skeleton, rest: Tensor) -> float:
    """From the lowest to the highest point of the rest pose, in metres."""
    height = float(rest[:, 1].max() - rest[:, 1].min())
    feet = [joint for role, joint in skeleton.roles.items() if role.endswith("_foot")]
    head = skeleton.roles.get("head")
    # some files have a rest pose with all bones along one axis
    if head is None or not feet or rest[head, 1] - rest[feet, 1].max() < 0.7 * height:
        raise EncodingError(
            f"The rest pose of {skeleton!r} does not stand upright, so its stature is not known; "
            "leave stature out, or retarget the motion to Skeleton.canonical() first."
        )
    return height


def _pelvis_joints(skeleton: Skeleton, rest: Tensor) -> tuple[int, int, int]:
    """Left and right upper leg and the first trunk joint that is not in line with them."""
    roles = skeleton.roles
    left, right = roles.get("left_upper_leg"), roles.get("right_upper_leg")
    for role in ("spine", "chest", "neck", "head"):
        if left is not None and right is not None and role in roles:
            across, up = rest[left] - rest[right], rest[roles[role]] - rest[right]
            if torch.linalg.cross(across, up).norm() > 0.02 * across.norm():
                return left, right, roles[role]
    raise EncodingError(
        f"{skeleton!r} has no upper legs and spine that could tell which way it faces. "
        f"Joints: {', '.join(skeleton.names)}."
    )
