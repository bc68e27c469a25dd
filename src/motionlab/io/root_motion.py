"""Way and heading taken out of a motion, as game engines want them: in place, or on a root joint.

An engine moves a character by its root: the joint on the floor below the body, which faces as the
body does. The rest of the motion is told in this root's frame. Here the root lies straight below
the hips at y = 0, in every frame, as Unity projects a body onto the ground; it faces as hips and
shoulders together do, which turn against each other in every step: it sways half as much as hips.

* ``"ground"``: files get such a root, and the hips move in its frame. All joints stay where they are.
* ``"in-place"``: the root is left out, so that the body stays above the origin and faces +z. The hips
  rise and fall, pitch, roll and sway in turning; only their way over the floor is gone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor

from ..errors import MotionError
from ..kinematics import heading, yaw_matrix
from ..motion import Motion
from ..retargeting.rest_alignment import frame
from .free_names import free_name

KINDS = ("in-place", "ground")
NAME = "Root"
_FLAT = torch.tensor([1.0, 0.0, 1.0])
_LINES = ("upper_leg", "upper_arm")


def root_name(names: Sequence[str]) -> str:
    """What a root joint above joints of these names is called."""
    return free_name(names, NAME)


class Parts(NamedTuple):
    """A motion in two: ``x_world = way + turn @ x_body`` for every point x of it."""

    way: Tensor  # (frames, 3) metres, on the floor y = 0
    turn: Tensor  # (frames, 3, 3) about the vertical
    body: Motion  # above the origin, facing +z


def split(motion: Motion) -> Parts:
    """Way and heading of a motion, and the motion without them.

    The heading is that of hips and shoulders where these are known, else of the root joint.
    """
    points, world = motion.positions(), motion.orientations()
    roles = motion.skeleton.roles
    way = points[:, roles.get("hips", 0)] * _FLAT
    turn = yaw_matrix(heading(_facing(points, roles, world[:, 0])))
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn.mT @ rotations[:, 0]
    root = (turn.mT @ (motion.root_positions - way)[..., None])[..., 0]
    return Parts(way, turn, replace(motion, root_positions=root, rotations=rotations))


def in_place(motion: Motion) -> Motion:
    """The motion above the origin, facing +z in every frame; heights, pitch and roll stay."""
    return split(motion).body


def check_kind(root_motion: str | None) -> None:
    """Raise MotionError for what is no kind of root motion."""
    if root_motion not in (None, *KINDS):
        raise MotionError(
            f"root_motion={root_motion!r} is not known; use {' or '.join(map(repr, KINDS))}, or leave "
            "it out."
        )


def _facing(points: Tensor, roles: dict[str, int], root: Tensor) -> Tensor:
    """Orientations (frames, 3, 3) of the whole body: left, up and ahead in columns."""
    try:
        pairs = [[points[:, roles[f"{side}_{part}"]] for side in ("left", "right")]
                 for part in _LINES]  # fmt: skip
    except KeyError:
        return root
    (hip, other_hip), (shoulder, other_shoulder) = pairs
    unit = lambda way: torch.nn.functional.normalize(way, dim=-1)
    left = unit(hip - other_hip) + unit(shoulder - other_shoulder)
    return frame(left, shoulder + other_shoulder - hip - other_hip)
