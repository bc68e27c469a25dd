"""The takes of O3DE's motion matching, as a Godot project publishes them, put on a body.

The files hold rotations of bones and the way of the root, **no joint offsets**. Ours were found so:

* thigh and shank, the ankle's height, the width of the hips, by fitting: planted toes do not slip
  (2.8 cm/s are left in the main takes); the thigh is 0.51, the shank 0.37 of the hips' height;
* the hips' height, 1.02 m, which all lengths in the files are multiples of, from six free flights
  under gravity (long ones say 1.03);
* how high above the floor, 3 cm higher than the files say, so that planted toes lie on it;
* arms, trunk and head are assumed. Toes are rigid.

As only rotations and the root's way are real, retargeting to another body loses nothing else.
"""

from __future__ import annotations

import os
from functools import cache

import numpy as np
import torch
from scipy.spatial.transform import Rotation, Slerp

from ..errors import GodotError
from ..io.godot import parse_animation
from ..motion import Motion
from ..skeleton import Skeleton

FPS = 60
HIP_HEIGHT = 1.02  # metres
LIFT = 0.0306  # metres
# Joint, its parent, and where it is from there in the T-pose: centimetres to the left, up, forward.
_JOINTS = """
    Hips           -               0       0        0
    Spine          Hips            0      10.2      0
    Chest          Spine           0      13.26     0
    UpperChest     Chest           0      13.26     0
    Neck           UpperChest      0      17.34    -2.04
    Head           Neck            0      11.22     2.04
    LeftShoulder   UpperChest      2.55   14.28     0
    LeftUpperArm   LeftShoulder   14.28    0       -1.02
    LeftLowerArm   LeftUpperArm   28.56    0        0
    LeftHand       LeftLowerArm   26.01    0        0
    RightShoulder  UpperChest     -2.55   14.28     0
    RightUpperArm  RightShoulder -14.28    0       -1.02
    RightLowerArm  RightUpperArm -28.56    0        0
    RightHand      RightLowerArm -26.01    0        0
    LeftUpperLeg   Hips            9.67   -4.7469  -1.2157
    LeftLowerLeg   LeftUpperLeg    0     -52.3779   0
    LeftFoot       LeftLowerLeg    0     -37.215    0
    LeftToes       LeftFoot        0     -12.119   17.4245
    RightUpperLeg  Hips           -9.67   -4.7469  -1.2157
    RightLowerLeg  RightUpperLeg   0     -52.3779   0
    RightFoot      RightLowerLeg   0     -37.215    0
    RightToes      RightFoot       0     -12.119   17.4245
"""
_ENDS = """
    Head       0      20.4   0
    LeftHand   18.36   0     0
    RightHand -18.36   0     0
    LeftToes   0       0     7.14
    RightToes  0       0     7.14
"""


@cache
def skeleton() -> Skeleton:
    """The body: 22 joints, at rest in a T-pose that faces +z."""
    joints, ends = (
        [line.split() for line in table.strip().splitlines()] for table in (_JOINTS, _ENDS)
    )
    names = [name for name, *_ in joints]
    metres = lambda rows: torch.tensor([[float(x) / 100 for x in row[-3:]] for row in rows])
    return Skeleton(
        names=names,
        parents=[names.index(row[1]) if row[1] in names else -1 for row in joints],
        offsets=metres(joints),
        end_parents=[names.index(row[0]) for row in ends],
        end_offsets=metres(ends),
    )


def parse_take(data: bytes, where: str | os.PathLike, *, source: str = "") -> Motion:
    """A take from the bytes of its file, at 60 frames a second. Frame 0, a T-pose, is part of it.

    The last keys are of the end of the take, which is before the frame that they are set at: that
    frame is left out. The file turns bones against their parents, in axes of its own; a joint of
    `skeleton` turns against its parent from the T-pose.

    Raises
    ------
    GodotError : the bytes are no animation of this body.
    """
    tracks = parse_animation(data, where)
    body = skeleton()
    try:
        turns = {name: tracks[name, "rotation_3d"] for name in ("Root", *body.names)}
        root, hips = (tracks[name, "position_3d"] for name in ("Root", "Hips"))
    except KeyError as error:
        raise GodotError(
            f"{where}: has no track {error}; it is no take of O3DE's motion matching."
        ) from error
    last = max(keys[-1, 0] for keys in (root, hips, *turns.values()))
    times = np.arange(max(1, round(FPS * last))) / FPS
    local = {name: _between(times, keys) for name, keys in turns.items()}
    world, turned, rotations = [], [], []
    for name, parent in zip(body.names, body.parents, strict=True):
        world.append((world[parent] if parent >= 0 else local["Root"]) * local[name])
        turned.append(world[-1] * world[-1][0].inv())
        joint = turned[parent].inv() * turned[-1] if parent >= 0 else turned[-1]
        rotations.append(joint.as_matrix())
    way = _between(times, root) + local["Root"].apply(_between(times, hips))
    way = HIP_HEIGHT * way + [0, LIFT, 0]
    return Motion(body, way, np.stack(rotations, 1), FPS, source=source)


def _between(times: np.ndarray, keys: np.ndarray) -> np.ndarray | Rotation:
    """Positions (times, 3) or rotations at these times, from keys as of `parse_animation`."""
    when, values = keys[:, 0].astype(float), keys[:, 1:].astype(float)
    times = times.clip(when[0], when[-1])
    if values.shape[1] == 3:
        return np.stack([np.interp(times, when, axis) for axis in values.T], -1)
    turns = Rotation.from_quat(values)
    return Slerp(when, turns)(times) if len(when) > 1 else turns[np.zeros(len(times), int)]
