"""Which axis of a BVH file points up: motion turned so that y does, and back, and files that do not
say so."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import torch
from torch import Tensor

from ..errors import BvhError
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_units import Doubt, ancestors

# What x, y and z become where the named axis of the file points up: turned about the file's x, and
# where that is up itself, about its z. "-y" is the half turn from a camera's axes, whose y is down.
_TURNS = {
    "y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-y": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "-z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "-x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
}
_UPRIGHT = 0.7  # of a unit vector along the trunk, what must point up
_SHARE = 0.05  # of the frames; with fewer upright ones, it is not a person who lies down for once
_MOST = 0.5  # of the frames; upright people are so in more
_LOOKED_AT = 64  # frames, spread over the clip: enough to tell, and no time


def check_up(up: str | None) -> None:
    """Raise a BvhError if it is no axis."""
    if up is not None and not (isinstance(up, str) and up in _TURNS):
        raise BvhError(
            f"up={up!r} is no axis; use one of {', '.join(map(repr, _TURNS))}: the file's that "
            "points up."
        )


def turn_up(motion: Motion, up: str | None) -> Motion:
    """The motion with y up, of one whose axis `up` is.

    World and rest pose are turned alike, so that both are y-up, and local rotations are about the
    turned axes, in which order and by which angles is as before. A rest pose that stands upright
    along y already, on a root that carries the quarter turn, stays as it is.
    """
    if up in (None, "y"):
        return motion
    turn = torch.tensor(_TURNS[up], dtype=torch.float32)
    if _rests_upright(motion.skeleton):
        return _turned(motion, turn, motion.skeleton)
    return _turned(motion, turn, _turned_skeleton(motion.skeleton, turn))


def turn_back(motion: Motion, up: str | None, drawn: Skeleton | None = None) -> Motion:
    """The inverse of `turn_up`: a motion with y up in the axes of a file whose axis `up` points up.

    drawn : its skeleton as the file has it; None is one whose rest pose is turned as the world is.
    """
    turn = torch.tensor(_TURNS[up or "y"], dtype=torch.float32).T
    if drawn is not None and _rests_upright(drawn):
        return replace(_turned(motion, turn, motion.skeleton), skeleton=drawn)
    return _turned(motion, turn, drawn or _turned_skeleton(motion.skeleton, turn))


def turned_back(points: Tensor, up: str | None) -> Tensor:
    """Points (..., 3) with y up in the axes of a file whose axis `up` points up."""
    return points @ torch.tensor(_TURNS[up or "y"], dtype=torch.float32)


def vertical(up: str | None) -> tuple[int, float]:
    """Which axis of a file points up, 0 to 2, and 1, or -1 if it points down."""
    up = up or "y"
    return "xyz".index(up[-1]), -1.0 if up[0] == "-" else 1.0


def _turned(motion: Motion, turn: Tensor, skeleton: Skeleton) -> Motion:
    """The motion in a world turned by (3, 3), its rest pose, too, if it gets another skeleton."""
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    if skeleton is not motion.skeleton:
        rotations = rotations @ turn.T
        rotations[:, 1:] = turn @ rotations[:, 1:]
    root = motion.root_positions @ turn.T
    return replace(motion, skeleton=skeleton, root_positions=root, rotations=rotations)


def _turned_skeleton(skeleton: Skeleton, turn: Tensor) -> Skeleton:
    becomes = {"XYZ"[old]: "XYZ"[new] for new, old in enumerate(turn.abs().argmax(1).tolist())}
    orders = ("".join(becomes[axis] for axis in order) for order in skeleton.rotation_orders)
    return replace(
        skeleton,
        offsets=skeleton.offsets @ turn.T,
        end_offsets=skeleton.end_offsets @ turn.T,
        rotation_orders=tuple(orders),
    )


def doubt_up(motion: Motion, up: str | None = None) -> Doubt | None:
    """What to say if the trunk, as far as the joints' roles tell it, is hardly ever upright.

    motion : turned; up : the file's axis that was said to point up. "y" is how to say that a person
    lies, crawls or stands on the hands, so of that nothing is said.
    """
    some = motion.rotations[:: -(-len(motion) // _LOOKED_AT)]
    trunk = None if up == "y" else _trunk(motion.skeleton, some)
    if trunk is None or (trunk[:, 1] > _UPRIGHT).float().mean() >= _SHARE:
        return None
    trunk = trunk @ torch.tensor(_TURNS[up or "y"], dtype=torch.float32)  # in the file's axes
    mean = trunk.mean(0)
    axis = int(mean.abs().argmax())
    sign = -1.0 if mean[axis] < 0 else 1.0
    name = "-" * (sign < 0) + "xyz"[axis]
    if name == (up or "y"):  # leaning, this way and that
        return None
    if up is not None:
        if (sign * trunk[:, axis] > _UPRIGHT).float().mean() < _MOST:
            return None
        return Doubt(
            f"read with up={up!r} the body's trunk is upright in hardly any frame; it points along the "
            f"file's {name}: if that is up, read it with up={name!r}. Of a person who lies, crawls or "
            "stands on the hands it may be right.",
            f"up={name!r}",
        )
    return Doubt(
        f"the body's trunk points along {name} and is upright (along y) in hardly any frame; if "
        f"{name} is up in this file, read it with up={name!r}, if the person lies, crawls or "
        "stands on the hands, with up='y'.",
        f"up={name!r}",
    )


def _rests_upright(skeleton: Skeleton) -> bool:
    trunk = _trunk(skeleton, torch.eye(3).expand(1, skeleton.joints, 3, 3))
    return trunk is not None and bool(trunk[0, 1] > _UPRIGHT)


def _trunk(skeleton: Skeleton, rotations: Tensor) -> Tensor | None:
    """Unit vectors (frames, 3) from the hips to neck, head or chest; None if the names don't tell.

    rotations : (frames, joints, 3, 3), local.
    """
    roles = skeleton.roles
    top = next((roles[role] for role in ("neck", "head", "chest") if role in roles), None)
    hips = roles.get("hips")
    if top is None or hips is None or hips == top:
        return None
    way = ancestors(skeleton, top)[::-1]
    if hips not in way:
        return None
    turn, trunk = torch.eye(3).expand(len(rotations), 3, 3), torch.zeros(len(rotations), 3)
    for joint, child in pairwise(way):
        turn = turn @ rotations[:, joint]
        if joint >= hips:
            trunk = trunk + turn @ skeleton.offsets[child]
    length = trunk.norm(dim=-1, keepdim=True)
    return trunk / length if bool((length > 0).all()) else None
