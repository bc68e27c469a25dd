"""Joint angles, as Wang, Chai and Xia (2021) feed them to their network (RNN-GAN)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import roma
import torch
from torch import Tensor

from ..errors import EncodingError
from ..kinematics import heading, yaw_matrix
from ..motion import Motion
from ..skeleton import Skeleton
from .base import (
    check_features,
    check_motion,
    check_rate,
    check_skeleton,
    contact_channels,
    skeleton_config,
)
from .effectors import body_points, chain_ends, effector_chains, effector_joints, moving
from .limbs import Limbs
from .mean_pose import check_pose, mean_pose_of
from .path import Start, read_start, steps_between, walk
from .rotations import WIDTHS, euler_matrix, from_numbers, to_numbers

_ROOT = 6  # step to the left, step ahead, turn, height, and two numbers for the tilt
_TOES = (1, 3)  # which of a motion's four contact channels the paper carries


class JointAngles:
    """``[dx dz dyaw | height tilt_x tilt_z | joint angles | contacts]`` (RNN-GAN, eq. 3, 14).

    The root's step over the ground and its turn are seen from the frame before, so the features do
    not change when the whole motion is moved over the ground or turned about the vertical. Bones
    keep their length whatever the numbers are.

    Parameters
    ----------
    skeleton : the body.
    fps : frames per second; a step is one frame long.
    rotation : how a joint's rotation becomes numbers. "vector", the default: rotation vector (axis
        times angle, radians) relative to the mean pose. "euler": angles in the order of the
        skeleton's file, as in the paper. "6d": two columns of the matrix (Zhou et al. 2019).
    mean_pose : (joints, 3, 3), local rotations that "vector" is relative to (the root's is not
        used). None: the mean of motionlab's training data for `Skeleton.canonical`, the rest pose
        for any other skeleton.
    contacts : whether left and right toe contact (0 or 1) are part of a row (eq. 14).

    The heading is the swing-twist yaw (`motionlab.kinematics.heading`), and the tilt is the rotation
    vector of what is left, which has no y component. With "euler" both, and with them the yaw of
    `start`, are the angles of the order YXZ, as in the paper: the same for an upright body, another
    for a tilted one, undefined for one that is pitched by 90 degrees.

    Raises
    ------
    EncodingError : unknown rotation, or a mean pose that is not one rotation a joint.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        fps: float = 30.0,
        rotation: str = "vector",
        mean_pose: Tensor | None = None,
        contacts: bool = False,
    ) -> None:
        if rotation not in list(WIDTHS):
            raise EncodingError(f"rotation is {rotation!r}; it must be one of {list(WIDTHS)}.")
        self.skeleton, self.fps = check_skeleton(JointAngles, skeleton), check_rate(fps)
        self.rotation = rotation
        given = mean_pose is not None
        self.mean_pose = check_pose(mean_pose, skeleton) if given else mean_pose_of(skeleton)
        self.points, self.point_names = skeleton.points, skeleton.point_names
        end = _ROOT + WIDTHS[rotation] * (skeleton.joints - 1)
        self.slices = {"root": slice(0, _ROOT), "pose": slice(_ROOT, end)}
        if contacts:
            self.slices["contacts"] = slice(end, end + 2)
        self.dim = end + 2 * contacts
        self.feature_names = self._names()

    def _names(self) -> tuple[str, ...]:
        names = ["dx", "dz", "dyaw", "height", "tilt_x", "tilt_z"]
        joints = zip(self.skeleton.names, self.skeleton.rotation_orders, strict=True)
        for joint, order in list(joints)[1:]:
            columns = ("xx", "xy", "xz", "yx", "yy", "yz")
            parts = {"vector": "xyz", "euler": order.lower(), "6d": columns}[self.rotation]
            names += [f"{joint}_{part}" for part in parts]
        return (*names, "left_toe", "right_toe")[: self.dim]

    @property
    def effector_names(self) -> tuple[str, ...]:
        """What `end_effectors` gives, in its order."""
        return tuple(effector_joints(self.skeleton))

    # -- motion to features -----------------------------------------------------------------------

    def encode(self, motion: Motion) -> Tensor:
        """Features (frames, dim); see `Encoding.encode`."""
        check_motion(self, motion)
        yaw, tilt = self._split_root(motion.rotations[:, 0])
        numbers = to_numbers(
            motion.rotations[:, 1:], self.rotation, self.mean_pose[1:], self._orders
        )
        rows = [
            steps_between(motion.root_positions, yaw),
            motion.root_positions[:, 1:2],
            tilt,
            numbers.flatten(1),
        ]
        if "contacts" in self.slices:
            rows.append(contact_channels(motion, _TOES))
        return torch.cat(rows, dim=1).float()

    def start_of(self, motion: Motion) -> Tensor:
        """x, z and yaw of frame 0 (3,); see `Encoding.start_of`."""
        check_motion(self, motion)
        x, _, z = motion.root_positions[0].double()
        return torch.stack([x, z, *self._split_root(motion.rotations[:1, 0])[0]])

    def _split_root(self, orientations: Tensor) -> tuple[Tensor, Tensor]:
        """Yaw (frames,) and two numbers of tilt (frames, 2) of the root, float64."""
        if self.rotation == "euler":
            angles = to_numbers(orientations[:, None], "euler", self.mean_pose, ["YXZ"])[:, 0]
            return angles[:, 0], angles[:, 1:]
        orientations = orientations.double()
        yaw = heading(orientations)
        swing = torch.einsum("fba,fbc->fac", yaw_matrix(yaw), orientations)
        return yaw, roma.rotmat_to_rotvec(swing)[:, [0, 2]]

    @property
    def _orders(self) -> tuple[str, ...]:
        return self.skeleton.rotation_orders[1:]

    # -- features to motion -----------------------------------------------------------------------

    def positions(
        self, features: Tensor, start: Start | None = None, points: Iterable[int] | None = None
    ) -> Tensor:
        """Points (..., frames, points, 3); see `Encoding.positions`.

        points : those that somebody will look at. The others come out as NaN: of a whole body, feet
        are a third of the work, and the root's way none.
        """
        if points is None:
            root_positions, rotations = self.rotations(features, start)
            return body_points(self.skeleton, rotations, root_positions)
        limbs = Limbs.to(self.skeleton, points)
        return limbs.points(*self.rotations(features, start, limbs.joints))

    def rotations(
        self, features: Tensor, start: Start | None = None, joints: Sequence[int] | None = None
    ) -> tuple[Tensor, Tensor]:
        """Root positions (..., frames, 3) and local rotations (..., frames, joints, 3, 3).

        joints : whose rotations, the root, 0, first; None: all.
        """
        features = check_features(self, features)
        tilt, joints = self._turns(features, joints)
        place, yaw = self._way(features, start)
        root = torch.einsum("...ab,...bc->...ac", yaw_matrix(yaw), tilt)
        return place, torch.cat([root[..., None, :, :], joints], dim=-3)

    def root_path(self, features: Tensor, start: Start | None = None) -> Tensor:
        """Root positions (..., frames, 3), metres; `start` as for `Encoding.positions`."""
        return self._way(check_features(self, features), start)[0]

    def _way(self, features: Tensor, start: Start | None) -> tuple[Tensor, Tensor]:
        """Root positions (..., frames, 3) and yaw (..., frames)."""
        path, yaw = walk(features[..., :3], read_start(start, features, default=(0.0, 0.0, 0.0)))
        return torch.stack([path[..., 0], features[..., 3], path[..., 2]], dim=-1), yaw

    def to_motion(
        self, features: Tensor, start: Start | None = None, name: str = "", source: str = ""
    ) -> Motion:
        """The motion of features (frames, dim); see `Encoding.to_motion`.

        Toe contacts are taken over (true above 0.5); heels, which no row knows of, are False.
        """
        features = check_features(self, features, frames_only=True).detach()
        root_positions, rotations = self.rotations(features, start)
        contacts = None
        if "contacts" in self.slices:
            contacts = torch.zeros(len(features), 4, dtype=torch.bool)
            contacts[:, _TOES] = self.contacts(features).cpu() > 0.5
        return Motion(
            self.skeleton, root_positions.cpu(), rotations.cpu(), self.fps, name, source, contacts
        )

    def end_effectors(self, features: Tensor) -> Tensor:
        """Positions and velocities (..., frames, effectors, 6); see `Encoding.end_effectors`."""
        features = check_features(self, features)
        chains = effector_chains(self.skeleton)
        tilt, joints = self._turns(features, chains.joints)
        local = torch.cat([tilt[..., None, :, :], joints], dim=-3)
        local = local.flatten(0, -4).permute(1, 2, 3, 0).contiguous()  # (joints, 3, 3, batch)
        ends = chain_ends(local, chains.levels, chains.offsets.to(local))
        points = ends.permute(2, 0, 1).unflatten(0, features.shape[:-1])
        height = features[..., 3]
        still = torch.zeros_like(height)
        points = points + torch.stack([still, height, still], dim=-1)[..., None, :]
        # a rotation vector without a y component does not turn its body about the vertical
        facing = heading(tilt) if self.rotation == "euler" else None
        return moving(points, features[..., :3], self.fps, facing)

    def contacts(self, features: Tensor) -> Tensor | None:
        """Left and right toe (..., frames, 2) as they are; None if not carried."""
        features = check_features(self, features)
        return features[..., self.slices["contacts"]] if "contacts" in self.slices else None

    def _turns(
        self, features: Tensor, joints: Sequence[int] | None = None
    ) -> tuple[Tensor, Tensor]:
        """Tilt (..., frames, 3, 3) of the root and rotations of the other joints, or some of them."""
        x, z = features[..., 4], features[..., 5]
        if self.rotation == "euler":
            tilt = euler_matrix(features[..., 4:6], "XZ")
        else:
            tilt = roma.rotvec_to_rotmat(torch.stack([x, torch.zeros_like(x), z], dim=-1))
        pose = features[..., self.slices["pose"]].unflatten(-1, (-1, WIDTHS[self.rotation]))
        mean, orders = self.mean_pose[1:], self._orders
        if joints is not None:
            some = [joint - 1 for joint in joints[1:]]
            pose, mean, orders = pose[..., some, :], mean[some], [orders[i] for i in some]
        return tilt, from_numbers(pose, self.rotation, mean, orders)

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """Settings for `motionlab.encodings.from_config`."""
        return {
            "encoding": "JointAngles",
            "skeleton": skeleton_config(self.skeleton),
            "fps": self.fps,
            "rotation": self.rotation,
            "mean_pose": self.mean_pose.tolist(),
            "contacts": "contacts" in self.slices,
        }
