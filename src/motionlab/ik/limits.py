"""How far the joints of a body turn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import roma
import torch
from torch import Tensor

from ..errors import IkError
from ..roles import SIDES
from ..skeleton import Skeleton
from .hinge import STRAIGHT, Hinge
from .turns import place, turn_about, unit

Table = Mapping[str, float | tuple[float, float]]

# Degrees, by role without its side. A pair: the bend of a hinge from straight, negative backwards.
# A number: the largest turn away from the neutral pose, in any direction. The ranges are wide: what
# people do in the Bandai and ACCAD recordings lies inside, broken frames with a foot turned about
# outside. Knees get two degrees, for recordings in which standing legs are straight.
HUMAN: Table = {
    "spine": 90, "chest": 60, "neck": 70, "head": 70,
    "shoulder": 75, "upper_arm": 160, "lower_arm": (-10, 165), "hand": 120,
    "upper_leg": 160, "lower_leg": (-2, 165), "foot": 120, "toes": 120,
}  # fmt: skip

# Which joints a hinge lies between, and where it swings the bone below: ahead (1) or back (-1).
_HINGES = {"lower_arm": ("upper_arm", "hand", 1), "lower_leg": ("upper_leg", "foot", -1)}


@dataclass(frozen=True)
class Limits:
    """The limits of one skeleton in one neutral pose."""

    hinges: dict[int, Hinge] = field(default_factory=dict)  # by the joint above
    ranges: dict[int, float] = field(default_factory=dict)  # radians, by joint
    neutral: Tensor | None = None  # (joints, 3, 3)

    def clamp(self, rotations: Tensor) -> Tensor:
        """Local rotations (..., joints, 3, 3) brought inside the limits."""
        rotations = rotations.clone() if self.hinges or self.ranges else rotations
        for hinge in self.hinges.values():
            bend = hinge.bend(rotations)
            back = turn_about(hinge.axis, bend.clamp(hinge.low, hinge.high) - bend)
            rotations[..., hinge.lower, :, :] = back @ rotations[..., hinge.lower, :, :]
        if self.ranges:
            joints, most = list(self.ranges), torch.tensor(list(self.ranges.values()))
            rest = self.neutral[joints]
            turn = roma.rotmat_to_rotvec(rotations[..., joints, :, :] @ rest.mT)
            angle = turn.norm(dim=-1)
            over = angle > most
            if over.any():
                share = torch.where(over, most / angle.clamp(min=1e-9), 1)
                within = roma.rotvec_to_rotmat(turn * share[..., None]) @ rest
                rotations[..., joints, :, :] = torch.where(
                    over[..., None, None], within, rotations[..., joints, :, :]
                )
        return rotations


def read_limits(limits: str | Table | None, skeleton: Skeleton, neutral: Tensor) -> Limits:
    """Limits from their name or table.

    limits : "human", a table like `HUMAN`, or None.
    neutral : (joints, 3, 3), the pose that the hinges' axes are told from: upright, legs down.
    """
    if limits is None:
        return Limits()
    table = HUMAN if isinstance(limits, str) and limits == "human" else limits
    if not isinstance(table, Mapping):
        raise IkError(f'limits is {limits!r}; it must be None, "human" or a table such as HUMAN.')
    hinges: dict[int, Hinge] = {}
    ranges: dict[int, float] = {}
    for part, span in table.items():
        if part not in HUMAN or not _fits(span, pair=part in _HINGES):
            raise IkError(
                f"The table of limits has {part!r}: {span!r}. Roles are {', '.join(HUMAN)}; "
                f"{' and '.join(_HINGES)} take a pair of degrees (from, to), the others a number "
                "from 0."
            )
        for role in (part, *(f"{side}_{part}" for side in SIDES)):
            if role not in skeleton.roles:
                continue
            if part not in _HINGES:
                ranges[skeleton.roles[role]] = math.radians(span)
            elif hinge := _hinge(skeleton, neutral, role, span):
                hinges[hinge.upper] = hinge
    return Limits(hinges, ranges, neutral)


def _fits(span: float | tuple[float, float], pair: bool) -> bool:
    """Whether this is a range: from the less to the more, or a size."""
    ends = span if isinstance(span, tuple) else (0, span)
    numbers = len(ends) == 2 and all(isinstance(value, int | float) for value in ends)
    return isinstance(span, tuple) == pair and numbers and ends[0] <= ends[1]


def _hinge(
    skeleton: Skeleton, neutral: Tensor, role: str, degrees: tuple[float, float]
) -> Hinge | None:
    """The hinge in a limb, None if the limb is not made of two bones."""
    side, _, part = role.partition("_")
    above, end, sense = _HINGES[part]
    names = (f"{side}_{above}", role, f"{side}_{end}")
    if not all(name in skeleton.roles for name in names):
        return None
    a, b, c = (skeleton.roles[name] for name in names)
    if (skeleton.parents[b], skeleton.parents[c]) != (a, b):
        return None
    places, world = place(skeleton, neutral.new_zeros(3), neutral)
    along, below = unit(places[b] - places[a]), unit(places[c] - places[b])
    expected = torch.linalg.cross(along, sense * _facing(skeleton, places))
    if expected.norm() < 0.5:
        raise IkError(
            f"The neutral pose does not show how {role} bends: the bone above it points forwards "
            "or backwards. Give a `prior` with the limb to the side or hanging."
        )
    # A limb that is bent in the neutral pose shows the axis better than the body's facing does.
    axis = unit(torch.linalg.cross(along, below) + STRAIGHT * unit(expected))
    frame = world[a].mT
    low, high = (math.radians(value) for value in degrees)
    return Hinge(a, b, c, frame @ axis, frame @ along, world[b].mT @ below, low, high)


def _facing(skeleton: Skeleton, places: Tensor) -> Tensor:
    """Where the neutral pose faces, (3,), told from hips, head, legs and feet."""
    at = {role: places[joint] for role, joint in skeleton.roles.items()}
    try:
        up = unit(at["head"] - at["hips"])
        forward = unit(torch.linalg.cross(at["left_upper_leg"] - at["right_upper_leg"], up))
        legs = [at[f"{side}_lower_leg"] - at[f"{side}_upper_leg"] for side in SIDES]
    except KeyError as error:
        raise IkError(
            f"Human limits need a skeleton with the role {error}; this one has "
            f"{', '.join(skeleton.roles) or 'none'}. Solve with limits=None."
        ) from error
    feet = [at[f"{s}_toes"] - at[f"{s}_foot"] for s in SIDES if f"{s}_toes" in at]
    upright = all(unit(leg) @ up < -0.5 for leg in legs)
    if not (upright and all(unit(foot) @ forward > 0 for foot in feet)):
        raise IkError(
            "Human limits are told from the neutral pose, which must stand upright, legs down and "
            "toes ahead; this skeleton's rest pose does not. Give `prior`, the rotations "
            f"({skeleton.joints}, 3, 3) of a pose that does."
        )
    return forward
