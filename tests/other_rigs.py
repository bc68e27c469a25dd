"""One motion on rigs that draw the same body otherwise: joint axes, rest pose, joints between."""

from __future__ import annotations

from dataclasses import replace

import roma
import torch

from motionlab import Motion, Skeleton
from motionlab.kinematics import yaw_matrix
from motionlab.roles import SIDES


def redrawn(motion: Motion, axes: torch.Tensor) -> Motion:
    """The same points in motion, each joint's axes (joints, 3, 3) drawn as said in its old ones.

    What the rest pose is changes with them: it is the body with all new axes along the world's.
    """
    s = motion.skeleton
    offsets, ends, rotations = s.offsets.clone(), s.end_offsets.clone(), motion.rotations @ axes
    for joint, parent in enumerate(s.parents[1:], start=1):
        offsets[joint] = axes[parent].mT @ offsets[joint]
        rotations[:, joint] = axes[parent].mT @ rotations[:, joint]
    for end, parent in enumerate(s.end_parents):
        ends[end] = axes[parent].mT @ ends[end]
    return replace(
        motion, skeleton=replace(s, offsets=offsets, end_offsets=ends), rotations=rotations
    )


def random_axes(skeleton: Skeleton, seed: int = 0) -> torch.Tensor:
    """Axes (joints, 3, 3) that lie any way at all."""
    return roma.random_rotmat(skeleton.joints, generator=torch.Generator().manual_seed(seed))


def sitting(skeleton: Skeleton) -> torch.Tensor:
    """Axes (joints, 3, 3) of a rig whose rest pose sits: thighs ahead, shanks down."""
    axes = torch.eye(3).repeat(skeleton.joints, 1, 1)
    ahead = roma.rotvec_to_rotmat(torch.tensor([torch.pi / 2, 0.0, 0.0]))
    for side in SIDES:  # as at rest the thigh is turned up by 90 degrees against these axes
        axes[skeleton.role(f"{side}_upper_leg")] = ahead
    return axes


def along_bones(skeleton: Skeleton, direction: torch.Tensor) -> torch.Tensor:
    """Axes (joints, 3, 3) of a rig in which all bones go one way (3,) in their joints' frames."""
    axes = torch.eye(3).repeat(skeleton.joints, 1, 1)
    offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
    for joint in range(skeleton.joints):
        bones = [offsets[p] for p, above in enumerate(skeleton.point_parents) if above == joint]
        longest = max(bones, key=torch.norm, default=direction)
        if longest.norm() > 0:
            axes[joint] = _turn(direction, longest / longest.norm())
    return axes


def _turn(start: torch.Tensor, end: torch.Tensor) -> torch.Tensor:
    """A rotation (3, 3) that brings one unit vector to another."""
    axis = torch.linalg.cross(start, end)
    if axis.norm() < 1e-6:  # along it or against it, then by half a turn about any axis across
        across = torch.linalg.cross(start, start.roll(1) + torch.tensor([0.1, 0.2, 0.3]))
        half = torch.pi * across / across.norm()
        return roma.rotvec_to_rotmat(half if start @ end < 0 else 0 * half)
    angle = torch.atan2(axis.norm(), start @ end)
    return roma.rotvec_to_rotmat(axis / axis.norm() * angle)


def facing(motion: Motion, yaw: float) -> Motion:
    """The motion turned as a whole about the vertical by radians."""
    turn = yaw_matrix(torch.tensor(yaw))
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    return replace(motion, root_positions=motion.root_positions @ turn.mT, rotations=rotations)


def with_joints_between(motion: Motion, roles: tuple[str, ...]) -> Motion:
    """The motion on a rig in which the bone of each of these roles has a joint in its middle.

    The bone's children hang on that joint, as a foot hangs on the twist joint of its shank.
    """
    s = motion.skeleton
    names, parents, offsets = list(s.names), list(s.parents), list(s.offsets)
    ends, rotations = list(s.end_parents), list(motion.rotations.unbind(1))
    for joint in sorted((s.role(role) for role in roles), reverse=True):
        (child,) = (c for c, p in enumerate(parents) if p == joint)
        half = offsets[child] / 2
        names.insert(joint + 1, f"{names[joint]}Extra")
        parents = [p + (p > joint) for p in parents]
        ends = [p + (p > joint) for p in ends]
        parents.insert(joint + 1, joint)
        offsets.insert(joint + 1, half)
        child += 1
        parents[child], offsets[child] = joint + 1, half
        rotations.insert(joint + 1, torch.eye(3).expand_as(rotations[joint]))
    body = Skeleton(tuple(names), tuple(parents), torch.stack(offsets), tuple(ends), s.end_offsets)
    return replace(motion, skeleton=body, rotations=torch.stack(rotations, 1))


def with_more_joints(motion: Motion, joints: int, seed: int = 0) -> Motion:
    """The motion on a rig of so many joints: more hang on any of its own, and move by themselves.

    Some lie where their parent lies, as in many a rig.
    """
    s, random = motion.skeleton, torch.Generator().manual_seed(seed)
    names, parents, offsets = list(s.names), list(s.parents), list(s.offsets)
    ends, tips, rotations = (
        list(s.end_parents),
        list(s.end_offsets),
        list(motion.rotations.unbind(1)),
    )
    sway = torch.sin(torch.arange(len(motion)) / 10)[:, None]
    while len(names) < joints:
        new, (any_of, in_place) = len(names), torch.rand(2, generator=random)
        chain = 2 * any_of > 1  # on the joint before it, or on any
        parents.append(new - 1 if chain else int(2 * any_of * new))
        offsets.append((in_place > 0.2) * 0.08 * torch.randn(3, generator=random))
        names.append(f"Extra{new}")
        rotations.append(roma.rotvec_to_rotmat(sway * 0.3 * torch.randn(3, generator=random)))
        ends.append(new)
        tips.append(0.03 * torch.randn(3, generator=random))
    body = Skeleton(
        tuple(names), tuple(parents), torch.stack(offsets), tuple(ends), torch.stack(tips)
    )
    return replace(motion, skeleton=body, rotations=torch.stack(rotations, 1), contacts=None)
