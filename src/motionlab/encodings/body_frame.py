"""Points in the body's own frame, as Wang, Ho and Shum (2021) feed them to their network (STRNN)."""

from __future__ import annotations

import roma
import torch
from torch import Tensor

from ..kinematics import heading, yaw_matrix
from ..motion import Motion
from ..skeleton import Skeleton
from .base import (
    check_features,
    check_motion,
    check_rate,
    check_skeleton,
    contact_channels,
    motion_through,
    skeleton_config,
)
from .effectors import body_points, effector_joints, moving
from .path import Start, read_start, steps_between, turned, walk

_ROOT = 9  # position, rotation vector, two velocities, turn rate


class BodyFrame:
    """``[joints | root position, root rotation vector | vx vz, turn rate | contacts]``, 73 numbers
    on the canonical skeleton (STRNN, section 3).

    Everything is seen from the root's place on the ground, facing where the root faces, so the
    features do not change when the motion is moved over the ground or turned about the vertical.
    In that frame the root is at x = z = 0 and its rotation vector has no y component: constant
    channels, which `Normalizer` drops, and with them 70 numbers are left. Nothing keeps a bone's
    length, and end sites (fingertips, top of the head) are not carried.

    Velocities are per second, not per frame, so that their size does not depend on the frame rate:
    metres a second in the heading frame of the frame before, and radians a second.

    Parameters
    ----------
    skeleton : the body.
    fps : frames per second.
    contacts : whether left heel, left toe, right heel, right toe (0 or 1) are part of a row.
    """

    def __init__(self, skeleton: Skeleton, fps: float = 30.0, contacts: bool = True) -> None:
        self.skeleton, self.fps = check_skeleton(BodyFrame, skeleton), check_rate(fps)
        self.points, self.point_names = skeleton.joints, skeleton.names
        pose = 3 * (skeleton.joints - 1)
        self.slices = {"pose": slice(0, pose), "root": slice(pose, pose + _ROOT)}
        if contacts:
            self.slices["contacts"] = slice(pose + _ROOT, pose + _ROOT + 4)
        self.dim = pose + _ROOT + 4 * contacts
        joints = [f"{joint}_{axis}" for joint in skeleton.names[1:] for axis in "xyz"]
        root = [f"root_{axis}" for axis in "xyz"] + [f"tilt_{axis}" for axis in "xyz"]
        feet = ["left_heel", "left_toe", "right_heel", "right_toe"]
        self.feature_names = (*joints, *root, "vx", "vz", "turn_rate", *feet)[: self.dim]

    @property
    def effector_names(self) -> tuple[str, ...]:
        """What `end_effectors` gives, in its order."""
        return tuple(effector_joints(self.skeleton))

    # -- motion to features -----------------------------------------------------------------------

    def encode(self, motion: Motion) -> Tensor:
        """Features (frames, dim); see `Encoding.encode`."""
        check_motion(self, motion)
        root = motion.rotations[:, 0].double()
        yaw = heading(root)
        tilt = torch.einsum("fba,fbc->fac", yaw_matrix(yaw), root)
        place = motion.root_positions * motion.root_positions.new_tensor([0.0, 1.0, 0.0])
        rotations = torch.cat([tilt.float()[:, None], motion.rotations[:, 1:]], dim=1)
        points = body_points(self.skeleton, rotations, place)[:, 1 : self.points]
        tilt = roma.rotmat_to_rotvec(tilt) * tilt.new_tensor([1.0, 0.0, 1.0])
        velocities = steps_between(motion.root_positions, yaw) * self.fps
        rows = [points.flatten(1), place, tilt, velocities]
        if "contacts" in self.slices:
            rows.append(contact_channels(motion, range(4)))
        return torch.cat(rows, dim=1).float()

    def start_of(self, motion: Motion) -> Tensor:
        """x, z and yaw of frame 0 (3,); see `Encoding.start_of`."""
        check_motion(self, motion)
        x, _, z = motion.root_positions[0].double()
        return torch.stack([x, z, heading(motion.rotations[0, 0].double())])

    # -- features to motion -----------------------------------------------------------------------

    def positions(self, features: Tensor, start: Start | None = None) -> Tensor:
        """Joints (..., frames, joints, 3); see `Encoding.positions`."""
        features = check_features(self, features)
        path, yaw = self._walk(features, start)
        return path[..., None, :] + turned(self._points(features), yaw[..., None])

    def to_motion(
        self, features: Tensor, start: Start | None = None, name: str = "", source: str = ""
    ) -> Motion:
        """The motion whose joints come nearest, by IK; see `Encoding.to_motion`.

        Contacts are taken over: true above 0.5.
        """
        features = check_features(self, features, frames_only=True).detach()
        contacts = self.contacts(features)
        contacts = None if contacts is None else contacts.cpu() > 0.5
        return motion_through(self, self.positions(features, start), contacts, name, source)

    def end_effectors(self, features: Tensor) -> Tensor:
        """Positions and velocities (..., frames, effectors, 6); see `Encoding.end_effectors`."""
        features = check_features(self, features)
        effectors = list(effector_joints(self.skeleton).values())
        return moving(self._points(features)[..., effectors, :], self._steps(features), self.fps)

    def contacts(self, features: Tensor) -> Tensor | None:
        """Heels and toes (..., frames, 4) as they are; None if not carried."""
        features = check_features(self, features)
        return features[..., self.slices["contacts"]] if "contacts" in self.slices else None

    def bones_off(self, features: Tensor) -> Tensor:
        """Metres (..., frames, joints - 1) by which bones are longer than the skeleton's; to be learned
        by, so nothing is checked. STRNN, equation 10, asks for it in control."""
        points, parents = self._points(features), list(self.skeleton.parents[1:])
        right = self.skeleton.offsets[1:].norm(dim=-1).to(features)
        return (points[..., 1:, :] - points[..., parents, :]).norm(dim=-1) - right

    def _points(self, features: Tensor) -> Tensor:
        """Joints (..., frames, joints, 3) in the heading frame, the root first."""
        root = features[..., self.slices["root"]][..., :3]
        joints = torch.cat([root, features[..., self.slices["pose"]]], dim=-1)
        return joints.unflatten(-1, (-1, 3))

    def _steps(self, features: Tensor) -> Tensor:
        return features[..., self.slices["root"]][..., 6:] / self.fps

    def _walk(self, features: Tensor, start: Start | None) -> tuple[Tensor, Tensor]:
        return walk(self._steps(features), read_start(start, features, default=(0.0, 0.0, 0.0)))

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """Settings for `motionlab.encodings.from_config`."""
        return {
            "encoding": "BodyFrame",
            "skeleton": skeleton_config(self.skeleton),
            "fps": self.fps,
            "contacts": "contacts" in self.slices,
        }
