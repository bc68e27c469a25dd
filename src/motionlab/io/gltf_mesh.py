"""The player's mannequin as a mesh that a skeleton's joints carry (a skin, in glTF's words).

The capsules are those of `viewer.body`. A limb's hangs on one joint and is rigid: the round ends of
two neighbours share their centre, so a bent elbow has neither crease nor gap, which blended weights
would give it. The capsules that fill the trunk join points that different joints carry; their
vertices are blended from one end to the other, and the trunk bends smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import roma
import torch

from ..kinematics import heading, yaw_matrix
from ..motion import Motion
from ..retargeting.rest_alignment import facing, stands
from ..roles import SIDES
from ..skeleton import Skeleton

INFLUENCES = 4  # joints that may carry a vertex, as many as every program reads
_STANDING = {
    f"{side}_{part}" for side in SIDES for part in ("upper_arm", "upper_leg", "lower_leg", "foot")
}


class Skin(NamedTuple):
    """A mesh in the bind pose, metres, and which joints carry it."""

    vertices: np.ndarray  # (vertices, 3)
    normals: np.ndarray  # (vertices, 3), unit, outward
    triangles: np.ndarray  # (triangles, 3), counter-clockwise seen from outside
    joints: np.ndarray  # (vertices, 4); 0 where the weight is 0
    weights: np.ndarray  # (vertices, 4), of sum one


def bind_pose(motion: Motion) -> Motion:
    """The one frame in which the mannequin is put on, its root at the origin.

    That is the rest pose where it is a standing person (a T-pose, mostly). Many files' is not: legs
    and trunk may be folded up, and what is fitted there would be torn when they unfold. Then it is
    the mean pose of the motion, facing ahead.
    """
    skeleton = motion.skeleton
    pose = torch.eye(3).expand(skeleton.joints, 3, 3)
    if not rest_stands(skeleton):
        rotations = motion.rotations.detach().cpu().double()
        if skeleton.roles.keys() >= _STANDING:  # axes of a root may lie anyhow, also upside down
            turn = facing(motion.positions().detach().cpu(), skeleton).double()
        else:
            turn = yaw_matrix(heading(rotations[:, 0]))
        ahead = turn.mT @ rotations[:, 0]
        mean = torch.cat([ahead[:, None], rotations[:, 1:]], dim=1).mean(0)
        pose = roma.special_procrustes(mean)
    return Motion(skeleton, torch.zeros(1, 3), pose[None], 1)


def rest_stands(skeleton: Skeleton) -> bool:
    """Whether a mannequin can be put on in the rest pose: a standing person, as far as is known."""
    return skeleton.roles.keys() >= _STANDING and stands(skeleton)


@dataclass(frozen=True)
class _Bound:
    """A body in its bind pose, equal to others of the same numbers."""

    motion: Motion = field(compare=False)
    body: tuple
    numbers: bytes


def mannequin(bound: Motion) -> Skin | None:
    """Dress a body in its bind pose, one frame; None if no bone has a length. To be read alone: of a
    folder's files, which mostly are of one body, all get the same arrays."""
    its = bound.skeleton
    numbers = torch.cat([its.offsets, its.end_offsets, *bound.rotations[0], bound.root_positions])
    body = (its.names, its.parents, its.end_parents, tuple(its.roles.items()))
    return _dressed(_Bound(bound, body, numbers.detach().cpu().numpy().tobytes()))


@lru_cache(maxsize=4)
def _dressed(pose: _Bound) -> Skin | None:
    bound = pose.motion
    # Not at the top: the viewer brings its widgets along, and this module is loaded with the package.
    from ..viewer.pictures.body import body
    from ..viewer.pictures.picture import Figure, capsules

    dress = body(bound.skeleton)
    if not dress.bones:
        return None
    points = dress.points(bound.positions())[0].double().numpy()
    figure = Figure(points, np.array(dress.bones), color=np.ones(3))
    vertices, normals, triangles = capsules(figure, sides=16, shaft=3)
    start, end, _, _ = figure.ends
    axis = (end - start)[:, None]
    from_start = vertices.reshape(len(dress.bones), -1, 3) - start[:, None]
    along = (from_start * axis).sum(-1) / np.maximum((axis**2).sum(-1), 1e-12)
    joints, weights = _weights(bound.skeleton, dress, along.clip(0, 1))
    return Skin(vertices, normals, _without_slivers(triangles, vertices), joints, weights)


def _weights(skeleton: Skeleton, dress, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints and weights (vertices, 4); `along` (bones, vertices of each): 0 at a bone's start."""
    shares = _shares(skeleton, dress.extras)
    start, end = np.empty((2, len(along), shares.shape[1]))
    for row, (a, b, _, _) in enumerate(dress.bones):
        rigid = a < skeleton.joints and shares[b, a] == 1
        start[row], end[row] = shares[b if rigid else a], shares[b]
    # No bone hangs on more than four joints: two for each of its ends.
    joints = np.argsort(-(start + end), axis=1, kind="stable")[:, :INFLUENCES]
    start, end = (np.take_along_axis(part, joints, axis=1)[:, None] for part in (start, end))
    weights = start + along[..., None] * (end - start)
    joints = np.where(weights > 0, joints[:, None], 0)
    for row, (_, tip, _, _) in enumerate(dress.bones):
        if (
            skeleton.joints <= tip < skeleton.points
        ):  # the round end is the end site's, a joint there
            joints[row, along[row] == 1] = np.where(weights[row, along[row] == 1] > 0, tip, 0)
    return joints.reshape(-1, INFLUENCES), weights.reshape(-1, INFLUENCES)


def _shares(skeleton: Skeleton, extras) -> np.ndarray:
    """How much each joint has in carrying a point, (points and extra points, joints), of sum one.

    A point is carried by its parent: in that frame it never moves. An extra point behind the end of
    a bone goes with the joint there (the heel with the ankle), one within a bone with the bone, and
    one between two others with both.
    """
    parents, joints = skeleton.point_parents, skeleton.joints
    one = np.eye(max(joints, INFLUENCES))
    rows = [one[max(parent, 0)] for parent in parents]
    hips = skeleton.roles.get("hips", 0)
    rows[hips] = one[hips]  # what is above them, if anything, is no part of the body
    for a, b, along in extras:
        if along > 1 and b < joints:
            rows.append(one[b])
        elif along > 1 or parents[b] == a:
            rows.append(rows[b])
        else:
            rows.append((1 - along) * rows[a] + along * rows[b])
    return np.stack(rows)


def _without_slivers(triangles: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Leave out triangles without area: at its poles a capsule's rings are points."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    return triangles[area > 1e-12]
