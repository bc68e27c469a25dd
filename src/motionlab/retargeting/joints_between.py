"""Joints without a role between those of a limb, whose rest pose is none that they ever take.

Twist bones, null objects and joints that only have an offset carry a limb on. Where a rig draws
their axes otherwise than those around them, its rest pose folds the limb there, and says nothing of
how the limb lies in motion. Here such a rig gets new axes for these joints alone, so that at rest
they are where they mostly are. Places in all frames, and all other joints' axes, stay as they are.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import roma
import torch
from torch import Tensor

from ..roles import ARM, LEG, SIDES
from ..skeleton import Skeleton

if TYPE_CHECKING:
    from ..motion import Motion

# Degrees by which a limb's joint may lie elsewhere at rest than on average, seen from the joint with
# a role above it; where the limb begins it may move. In 242 clips of seven real sources it is 8 there
# at most.
_FOLDED, _BEGINS = 2.0, 15.0


def settled(motion: Motion) -> Motion:
    """The motion on a skeleton whose joints between those of limbs rest where they mostly are.

    The same motion if their rest pose is near to that, as in most rigs.
    """
    odd = _folded(motion)
    if not odd:
        return motion
    axes: list[Tensor] = []
    for joint, parent in enumerate(motion.skeleton.parents):
        calm = torch.eye(3)
        if joint in odd:
            calm = axes[parent] @ roma.special_procrustes(motion.rotations[:, joint].mean(0))
        axes.append(calm)
    turned = torch.stack(axes)
    return replace(
        motion,
        skeleton=reaxed(motion.skeleton, turned),
        rotations=in_axes(motion.rotations, motion.skeleton, turned),
    )


def reaxed(skeleton: Skeleton, axes: Tensor) -> Skeleton:
    """The same joints with other axes: at rest they stand as here with orientations `axes`.

    axes : (joints, 3, 3). Orientations R of a joint here are ``R @ axes.mT`` there.
    """
    above = axes[list(skeleton.parents)]
    offsets = (above @ skeleton.offsets[..., None])[..., 0]
    offsets[0] = skeleton.offsets[0]
    ends = (axes[list(skeleton.end_parents)] @ skeleton.end_offsets[..., None])[..., 0]
    return replace(skeleton, offsets=offsets, end_offsets=ends)


def in_axes(rotations: Tensor, skeleton: Skeleton, axes: Tensor) -> Tensor:
    """Local rotations (frames, joints, 3, 3) of a skeleton, on the one that `reaxed` makes of it."""
    above = axes[list(skeleton.parents)]
    above[0] = torch.eye(3)
    return above @ rotations @ axes.mT


def _folded(motion: Motion) -> set[int]:
    """Joints without a role between two of a limb, or a limb and the trunk, that fold it at rest."""
    skeleton, roles = motion.skeleton, motion.skeleton.roles
    with_role = {joint: role for role, joint in roles.items()}
    chains = {}
    limbs = [f"{side}_{part}" for side in SIDES for part in ARM + LEG]
    for end in (roles[part] for part in limbs if part in roles):
        chain, joint = [], skeleton.parents[end]
        while joint >= 0 and joint not in with_role:
            chain.append(joint)
            joint = skeleton.parents[joint]
        if chain and joint >= 0:
            chains[joint, end] = chain
    if not chains:
        return set()
    points, world = motion.positions(), motion.orientations()
    odd: set[int] = set()
    for (start, end), chain in chains.items():
        seen = world[:, start].mT @ (points[:, end] - points[:, start])[..., None]
        rest = skeleton.below(with_role[start], with_role[end])
        most = math.radians(_FOLDED if with_role[start] in limbs else _BEGINS)
        if (seen.mean(0)[:, 0] - rest).norm() > most * rest.norm():
            odd |= {*chain}
    return odd
