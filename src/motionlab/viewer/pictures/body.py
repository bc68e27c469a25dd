"""A mannequin for any skeleton: which tapered capsules to hang on which points.

Capsules between pairs of points are all a renderer has to know, so the player (three.js) and the
stills (pyvista) draw the same figure. Where the skeleton has no joint (heel, waist, crown of the
head, finger tips of an end site without length) an *extra point* is added on the line through two
points. A capsule has a round section; the torso gets its breadth from several of them: a bar
through the shoulders, one through the pelvis, a fan from the shoulders to the waist.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

SIDES = ("left", "right")
LEG_LENGTH = 0.85  # metres from hip to ankle, of the adult whose radii are written below
HEEL = 0.070  # metres from an adult's ankle, where the toes are a joint, down to the heel
SHORTEST = 0.008  # metres; shorter bones are drawn by their neighbours' round ends
# Metres from the root to its farthest tip: a smaller body is dressed, and drawn, as if this large.
SMALLEST, SHOWN = 0.1, 1.0

# Radii in metres (at the joint, at its child) of the bones that start at a joint of this role.
LIMBS = {
    "shoulder": (0.052, 0.054),
    "upper_arm": (0.050, 0.040),
    "lower_arm": (0.037, 0.028),
    "hand": (0.030, 0.022),
    "upper_leg": (0.080, 0.056),
    "lower_leg": (0.052, 0.038),
    "foot": (0.036, 0.036),
    "toes": (0.034, 0.026),
}
TRUNK = {"hips": (0.100, 0.096), "spine": (0.096, 0.100), "chest": (0.090, 0.090)}
SPINE = (0.030, 0.030)
NECK = (0.044, 0.042)
FINGER = (0.013, 0.009)


class Bone(NamedTuple):
    """A tapered capsule between points a and b; radii in metres."""

    a: int
    b: int
    radius_a: float
    radius_b: float


class ExtraPoint(NamedTuple):
    """The point ``position[a] + along * (position[b] - position[a])``; a and b may be extra points
    before it."""

    a: int
    b: int
    along: float


@dataclass(frozen=True)
class Body:
    """Bones over the skeleton's points followed by the extra points.

    ``head`` is the index, within ``bones``, of the skull (None if no head was recognised);
    ``feet`` the points to mark for the contacts left heel, left toe, right heel, right toe;
    ``size`` how large it is beside an adult, by its legs, or by its reach where it has none;
    ``magnified`` how many times larger a picture shows a body that is too small for one, such as
    metres read as centimetres; 1 for all others.
    """

    extras: tuple[ExtraPoint, ...]
    bones: tuple[Bone, ...]
    head: int | None
    feet: tuple[int, ...]
    size: float = 1.0
    magnified: float = 1.0

    def points(self, positions: Tensor) -> Tensor:
        """Append the extra points: (..., points, 3) -> (..., points + extras, 3), metres."""
        points = list(positions.unbind(-2))
        for a, b, along in self.extras:
            points.append(points[a] + along * (points[b] - points[a]))
        return torch.stack(points, dim=-2)


def body(skeleton) -> Body:
    """Dress a skeleton. Joints of unknown role get limbs whose radius follows their length."""
    return _Tailor(skeleton).dress()


class _Tailor:
    def __init__(self, skeleton):
        self.roles = dict(skeleton.roles)
        self.parents = list(skeleton.point_parents)
        offsets = torch.cat([skeleton.offsets, skeleton.end_offsets])
        self.lengths = [offset.norm().item() for offset in offsets]
        self.magnified = self._magnify()
        self.names = [name.lower() for name in skeleton.point_names]
        self.role_of = {joint: role for role, joint in self.roles.items()}
        self.children: list[list[int]] = [[] for _ in self.parents]
        for point, parent in enumerate(self.parents):
            if parent >= 0:
                self.children[parent].append(point)
        self.size = self._leg_length() / LEG_LENGTH
        self.extras: list[ExtraPoint] = []
        self.bones: list[Bone] = []

    def dress(self) -> Body:
        above_hips = set(self._ancestors(self.roles["hips"])) if "hips" in self.roles else set()
        for point, parent in enumerate(self.parents):
            # A root above the hips (Bandai's `joint_Root`, still at the origin) is not flesh.
            if parent >= 0 and point not in above_hips and self.lengths[point] > SHORTEST:
                self._limb(parent, point)
        self._torso()
        self._hands()
        feet, head = self._feet(), self._head()
        bones = (Bone(a, b, *(r / self.magnified for r in radii)) for a, b, *radii in self.bones)
        size = self.size / self.magnified
        return Body(tuple(self.extras), tuple(bones), head, feet, size, self.magnified)

    def _limb(self, parent: int, point: int) -> None:
        role = self._nearest_role(parent)
        if role is None:
            thickness = min(0.22 * self.lengths[point], 0.045 * self.size)
            return self._add(parent, point, (thickness, 0.75 * thickness), scaled=False)
        if role == "head":
            return None  # the skull covers eyes, jaw and head top
        if role == "neck":
            return self._add(parent, point, NECK)
        if role in TRUNK:
            return self._trunk(role, parent, point)
        part = role.split("_", 1)[1]
        if part == "hand" and not self._is_palm(parent, point):
            return self._add(parent, point, FINGER)
        return self._add(parent, point, LIMBS[part])

    def _trunk(self, role: str, parent: int, point: int) -> None:
        ahead = self._role_below(point)
        if ahead is not None and ahead.endswith(("shoulder", "upper_arm")):
            self._add(parent, point, (0.064, 0.054))
        elif ahead is not None and ahead.endswith("leg"):
            self._add(parent, point, (0.088, 0.080))
        elif ahead in ("neck", "head"):
            self._add(parent, point, (0.04, 0.046))
        elif self._frame() is None:
            self._add(parent, point, TRUNK[role])
        else:  # the torso hangs on shoulders and hips; a thick spine along the back is a hump
            self._add(parent, point, SPINE)

    def _frame(self) -> tuple[int, int, int, int] | None:
        """Both upper arms, the top of the trunk and the hips, if all are known."""
        arms, hips = self._pair("upper_arm"), self.roles.get("hips")
        top = self.roles.get("neck", self.roles.get("head"))
        return None if arms is None or top is None or hips is None else (*arms, top, hips)

    def _torso(self) -> None:
        frame, legs = self._frame(), self._pair("upper_leg")
        if frame is None:
            return
        *arms, top, hips = frame
        waist = self._extra(hips, top, 0.28)
        chest = [self._extra(*arms, along) for along in (0.15, 0.38, 0.62, 0.85)]
        self._add(chest[0], chest[-1], (0.066, 0.066))
        for rib, radius in zip(chest, (0.070, 0.088, 0.088, 0.070), strict=True):
            self._add(rib, waist, (radius, 0.098))
        if legs:
            self._add(*legs, (0.082, 0.082))
            self._add(waist, self._extra(*legs, 0.5), (0.098, 0.094))
            for leg in legs:
                self._add(waist, leg, (0.094, 0.084))

    def _hands(self) -> None:
        # Some sources end at the wrist: lengthen the forearm by a hand.
        for side in SIDES:
            hand = self.roles.get(f"{side}_hand")
            elbow = self._role_above(f"{side}_lower_arm", hand)
            if elbow is None:
                continue
            reach = max((self._reach(child) for child in self.children[hand]), default=0.0)
            if reach < 0.04 * self.size:
                self._add(hand, self._beyond(elbow, hand, 0.12), LIMBS["hand"])

    def _feet(self) -> tuple[int, ...]:
        marks = []
        for side in SIDES:
            foot = self.roles.get(f"{side}_foot")
            knee = self._role_above(f"{side}_lower_leg", foot)
            if knee is None:
                return ()
            toes = self.roles.get(f"{side}_toes")
            named = toes is not None and foot in self._ancestors(toes)
            # Where the toes are a joint of their own, the ankle is marked higher up.
            heel = self._beyond(knee, foot, HEEL if named else 0.030)
            self._add(foot, heel, (0.036, 0.034))
            toes = toes if named else next(iter(self.children[foot]), foot)
            if toes != foot:
                self._add(heel, toes, (0.036, 0.034))
            tips = [tip for tip in self.children[toes] if self.lengths[tip] > SHORTEST]
            if named and not tips:
                self._add(toes, self._toe_tip(heel, foot, toes), LIMBS["toes"])
            marks += [heel, toes]
        return tuple(marks)

    def _toe_tip(self, heel: int, foot: int, toes: int) -> int:
        """Ahead of toes that end in the air, as in files from Blender: along the sole. The instep
        slopes; on a line with it the toes would point into the floor, and lift the body onto them.
        """
        instep = self._distance(foot, toes)
        sole = max(instep**2 - (HEEL * self.size) ** 2, (instep / 2) ** 2, SHORTEST**2) ** 0.5
        return self._extra(heel, toes, 1 + 0.05 * self.size / sole)

    def _head(self) -> int | None:
        head = self.roles.get("head")
        if head is None:
            return None
        # without a neck, the skull goes on from whatever carries the head
        below = [p for p in self._ancestors(head)[1:] if self._distance(p, head) > SHORTEST]
        neck = self._role_above("neck", head)
        neck = next(iter(below), None) if neck is None else neck
        if neck is None:
            return None
        tops = [
            p for p in self.children[head] if self.lengths[p] > 0.07 and "eye" not in self.names[p]
        ]
        if tops and len(self.children[head]) == 1:
            length = self.lengths[tops[0]] / self.size
            jaw, crown = (self._extra(head, tops[0], along / length) for along in (0.062, 0.122))
        else:
            jaw, crown = (self._beyond(neck, head, along) for along in (0.062, 0.122))
        self._add(jaw, crown, (0.068, 0.092))
        return len(self.bones) - 1

    def _add(self, a: int, b: int, radii: tuple[float, float], scaled: bool = True) -> None:
        scale = self.size if scaled else 1.0
        self.bones.append(Bone(a, b, round(radii[0] * scale, 4), round(radii[1] * scale, 4)))

    def _extra(self, a: int, b: int, along: float) -> int:
        self.extras.append(ExtraPoint(a, b, round(along, 4)))
        return len(self.parents) + len(self.extras) - 1

    def _beyond(self, a: int, b: int, metres: float) -> int:
        """A point `metres` (of an adult) behind b, on the line from a."""
        length = max(self._distance(a, b), SHORTEST)
        return self._extra(a, b, 1 + metres * self.size / length)

    def _distance(self, ancestor: int, point: int) -> float:
        total = 0.0
        while point != ancestor and point >= 0:
            total += self.lengths[point]
            point = self.parents[point]
        return total

    def _reach(self, point: int) -> float:
        return self.lengths[point] + max(
            (self._reach(c) for c in self.children[point]), default=0.0
        )

    def _leg_length(self) -> float:
        knee, foot = self.roles.get("left_lower_leg"), self.roles.get("left_foot")
        if knee is not None and foot is not None:
            return max(self.lengths[knee] + self._distance(knee, foot), SHORTEST)
        return max(self._farthest(), SHORTEST)

    def _farthest(self) -> float:
        """How far the farthest tip is from the root, along the bones."""
        along = [0.0] * len(self.parents)
        for point, parent in enumerate(self.parents):
            if parent >= 0:
                along[point] = along[parent] + self.lengths[point]
        return max(along)

    def _magnify(self) -> float:
        """Make `lengths` those of a body that is large enough to be dressed; how many times."""
        farthest = self._farthest()
        times = SHOWN / farthest if 0 < farthest < SMALLEST else 1.0
        self.lengths = [times * length for length in self.lengths]
        return times

    def _ancestors(self, point: int) -> list[int]:
        line = [point]
        while self.parents[line[-1]] >= 0:
            line.append(self.parents[line[-1]])
        return line

    def _nearest_role(self, point: int) -> str | None:
        return next((self.role_of[p] for p in self._ancestors(point) if p in self.role_of), None)

    def _role_above(self, role: str, point: int | None) -> int | None:
        """The point of a role if it carries another: from a point that does not, no line leads on."""
        above = self.roles.get(role)
        return above if point is not None and above in self._ancestors(point) else None

    def _role_below(self, point: int) -> str | None:
        while point not in self.role_of and len(self.children[point]) == 1:
            point = self.children[point][0]
        return self.role_of.get(point)

    def _is_palm(self, hand: int, point: int) -> bool:
        return len(self.children[hand]) == 1 and self.role_of.get(hand, "").endswith("hand")

    def _pair(self, role: str) -> tuple[int, int] | None:
        pair = tuple(self.roles.get(f"{side}_{role}") for side in SIDES)
        return None if None in pair else pair
