"""Motion brought to a rig of any kind, whatever its rest pose and however its joints' axes lie.

`retarget` wants a target that rests standing and faces +z. Any other rig has a *standing twin*: the
same joints at the same places in every pose, with axes so drawn that at rest it stands. The motion
is brought to the twin, and what the twin does is then said in the rig's own axes. The two are one
body: all points agree in all frames.

Which pose stands is learned from the rig's file: its rest pose, turned as a whole, if that stands;
else the part of its motion in which a person stands; else all of its motion.
"""

from __future__ import annotations

import math
from dataclasses import replace

import roma
import torch
from torch import Tensor

from ..errors import RetargetError
from ..motion import Motion
from ..roles import SIDES
from ..skeleton import Skeleton
from .flat_feet import Stance
from .joints_between import in_axes, reaxed
from .rest_alignment import alignment, bone, facing, frame, stands
from .retarget import NEEDED, retarget
from .stance import find_stance

_TILTED, _TURNED = 10.0, 2.0  # degrees by which a rest pose as people make it leans, or is turned
_LEAST = 30  # frames that may be asked as a motion; fewer are poses
_UPRIGHT = 0.5  # share of frames in which the trunk must be upright
_LEANING = 0.7  # cosine of how far an upright trunk may lean


def onto_rig(motion: Motion, rig: Motion, *, reference: Motion | Stance | None = None) -> Motion:
    """The motion on the skeleton of `rig`, feet on the floor y = 0 and still while in contact.

    Parameters
    ----------
    motion : from any source whose joints are called as people call them.
    rig : a file of the rig, as it was read. Unless its rest pose is a standing body, a person should
        stand in its motion; one frame is enough. Feet that end at the ankle get toes of human size
        to stand on, which the result is without.
    reference : of the source's skeleton, as for `retarget`.

    Returns
    -------
    Motion : on ``rig.skeleton`` itself; otherwise as `retarget` gives it.

    Raises
    ------
    RetargetError : how the rig stands can't be told, or as for `retarget`.
    """
    if not isinstance(motion, Motion) or not isinstance(rig, Motion):
        raise RetargetError(
            f"onto_rig takes two motions, of which the second is of the rig, not "
            f"{type(motion).__name__} and {type(rig).__name__}."
        )
    if motion.skeleton.matches(rig.skeleton):
        return motion
    if any(role not in rig.skeleton.roles for role in NEEDED):
        return retarget(motion, rig.skeleton)  # which says what is missing
    axes = standing(rig)
    twin = retarget(motion, _with_toes(reaxed(rig.skeleton, axes)), reference=reference)
    rotations = in_axes(twin.rotations, twin.skeleton, axes.mT)
    return replace(twin, skeleton=rig.skeleton, rotations=rotations)


def standing(rig: Motion) -> Tensor:
    """World orientations (joints, 3, 3) of a rig's joints where it stands and faces +z.

    Raises
    ------
    RetargetError : neither its rest pose nor its motion tells.
    """
    skeleton = rig.skeleton
    whole = _rest_turned(skeleton)
    if stands(reaxed(skeleton, whole)):
        return whole
    stance = find_stance([rig])
    known = stance is not None or _mostly_upright(rig)
    if stance is None and len(rig) < _LEAST:
        stance = rig  # a pose or two, upright: made for this, though the knees be bent
    axes = _learned(rig, stance) if known else whole
    if not stands(reaxed(skeleton, axes)):
        raise RetargetError(
            f"{rig!r}: how this rig stands can't be told: neither is its rest pose a person who "
            "stands, nor does one stand in its motion. Give a file of the rig in which a person "
            "stands upright, arms hanging or spread; one frame is enough."
        )
    return axes


def _learned(rig: Motion, stance: Motion | None) -> Tensor:
    """Orientations (joints, 3, 3) as a stance tells them, or all motion of the rig."""
    seen = rig if stance is None else stance
    skeleton, roles = rig.skeleton, rig.skeleton.roles
    # joints without a role, at rest where they are on average: what lies between two that have one
    calm = _spread(seen, {joint: torch.eye(3) for joint in roles.values()})
    turned = replace(
        seen,
        skeleton=reaxed(skeleton, calm),
        rotations=in_axes(seen.rotations, skeleton, calm),
        contacts=None,
    )
    found = alignment(turned, Skeleton.canonical(), None if stance is None else turned)
    return _spread(seen, {roles[role]: axes.mT for role, axes in found.items()})


def _with_toes(twin: Skeleton) -> Skeleton:
    """A standing skeleton with toes of human size, as end sites, on feet that end at the ankle."""
    body = Skeleton.canonical()
    size = _leg(twin) / _leg(body)
    bare = [side for side in SIDES if bone(twin, f"{side}_foot", f"{side}_toes") is None]
    toes = [body.below(f"{side}_foot", f"{side}_toes") * size for side in bare]
    return replace(
        twin,
        end_parents=twin.end_parents + tuple(twin.roles[f"{side}_foot"] for side in bare),
        end_offsets=torch.cat([twin.end_offsets, *(each[None] for each in toes)]),
    )


def _leg(skeleton: Skeleton) -> Tensor:
    """Metres () from an ankle of a standing skeleton up to the hip joint."""
    points, roles = skeleton.rest_points, skeleton.roles
    return points[roles["left_upper_leg"], 1] - points[roles["left_foot"], 1]


def _rest_turned(skeleton: Skeleton) -> Tensor:
    """Orientations (joints, 3, 3), all the same, that let a rest pose face +z, upright if it can."""
    points, roles = skeleton.rest_points, skeleton.roles
    at = lambda part: torch.stack([points[roles[f"{side}_{part}"]] for side in ("left", "right")])
    hips, shoulders, feet = at("upper_leg"), at("upper_arm"), at("foot")
    left = hips[0] - hips[1] + shoulders[0] - shoulders[1]
    body = frame(left, shoulders.mean(0) - feet.mean(0))
    if body[1, 1] > math.cos(math.radians(_TILTED)):
        body = facing(points[None], skeleton)[0]
        if body[2, 2] > math.cos(math.radians(_TURNED)):
            body = torch.eye(3)
    return body.mT.repeat(skeleton.joints, 1, 1)


def _mostly_upright(rig: Motion) -> bool:
    points, roles = rig.positions(), rig.skeleton.roles
    middle = lambda part: points[:, roles[f"left_{part}"]] + points[:, roles[f"right_{part}"]]
    trunk = torch.nn.functional.normalize(middle("upper_arm") - middle("upper_leg"), dim=-1)
    return bool((trunk[:, 1] > _LEANING).float().mean() >= _UPRIGHT)


def _spread(rig: Motion, known: dict[int, Tensor]) -> Tensor:
    """Orientations (joints, 3, 3) of all joints: those known, others as they mostly are on those.

    A root that is not known is as it mostly is to a body that faces +z.
    """
    found = []
    for joint, parent in enumerate(rig.skeleton.parents):
        if joint in known:
            found.append(known[joint])
        elif parent >= 0:
            found.append(found[parent] @ _mean(rig.rotations[:, joint]))
        else:
            ahead = facing(rig.positions(), rig.skeleton)
            found.append(_mean(ahead.mT @ rig.rotations[:, 0]))
    return torch.stack(found)


def _mean(rotations: Tensor) -> Tensor:
    """Mean (3, 3) of rotations (frames, 3, 3)."""
    return roma.special_procrustes(rotations.mean(0))
