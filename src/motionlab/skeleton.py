"""The skeleton: a tree of joints with fixed bone lengths."""

from __future__ import annotations

import operator
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property

import torch
from torch import Tensor

from .errors import SkeletonError

SIDES = ("left", "right")


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton:
    """Joints, bones and end sites of one body.

    Parameters
    ----------
    names : name of each joint, the root first, parents before children.
    parents : index of each joint's parent, -1 for the root.
    offsets : (joints, 3) metres, each joint relative to its parent, in the parent's frame. The
        root's is kept for reference only: a `Motion` says where the root is.
    end_parents : joint that each end site (a fingertip, the top of the head) hangs on.
    end_offsets : (end_sites, 3) metres.
    rotation_orders : per joint the order in which a BVH file lists its Euler angles, as "ZXY".

    Points are the joints in order, then the end sites in order.

    Raises
    ------
    SkeletonError : the arrays disagree, a name appears twice, or the joints are not a tree.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Tensor
    end_parents: tuple[int, ...] = ()
    end_offsets: Tensor = field(default_factory=lambda: torch.zeros(0, 3))
    rotation_orders: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        set_ = lambda name, value: object.__setattr__(self, name, value)
        set_("names", _words(self.names, "names"))
        set_("parents", _indices(self.parents, "parents"))
        set_("offsets", _vectors(self.offsets, "offsets"))
        set_("end_parents", _indices(self.end_parents, "end_parents"))
        set_("end_offsets", _vectors(self.end_offsets, "end_offsets"))
        orders = _words(self.rotation_orders, "rotation_orders")
        set_("rotation_orders", orders or ("ZXY",) * len(self.names))
        self._check()

    def _check(self) -> None:
        count = len(self.names)
        if count == 0:
            raise SkeletonError("A skeleton needs at least one joint; `names` is empty.")
        for name in self.names:
            if not name.strip():
                raise SkeletonError(f"A joint is called {name!r}; every joint needs a name.")
        if not count == len(self.parents) == len(self.offsets) == len(self.rotation_orders):
            raise SkeletonError(
                f"{count} names, {len(self.parents)} parents, {len(self.offsets)} offsets and "
                f"{len(self.rotation_orders)} rotation orders: give one of each per joint."
            )
        if len(self.end_parents) != len(self.end_offsets):
            raise SkeletonError(
                f"{len(self.end_parents)} end-site parents but {len(self.end_offsets)} offsets: "
                "give one of each per end site."
            )
        if len(set(self.names)) < count:
            twice = next(n for i, n in enumerate(self.names) if n in self.names[:i])
            raise SkeletonError(f"Two joints are called {twice!r}; rename one of them.")
        for joint, parent in enumerate(self.parents):
            if (parent != -1) if joint == 0 else not 0 <= parent < joint:
                raise SkeletonError(
                    f"Joint {joint} ({self.names[joint]!r}) has parent {parent}: the first joint "
                    "must be the root (-1) and every other joint must come after its parent."
                )
        for name, order in zip(self.names, self.rotation_orders, strict=True):
            if sorted(order) != ["X", "Y", "Z"]:
                raise SkeletonError(
                    f"Joint {name!r} has rotation order {order!r}; it must be like 'ZXY'."
                )
        if any(not 0 <= p < count for p in self.end_parents):
            raise SkeletonError(f"An end site hangs on a joint that is not there (of {count}).")
        if not (torch.isfinite(self.offsets).all() and torch.isfinite(self.end_offsets).all()):
            raise SkeletonError("An offset is NaN or infinite; every offset must be a number.")

    # -- sizes and names ---------------------------------------------------------------------

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.names)

    @property
    def points(self) -> int:
        """Number of points: joints and end sites."""
        return len(self.names) + len(self.end_parents)

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of all points; an end site is called after its joint."""
        return self.names + tuple(f"{self.names[p]}End" for p in self.end_parents)

    @property
    def point_parents(self) -> tuple[int, ...]:
        """Parent point of each point, -1 for the root."""
        return self.parents + self.end_parents

    def index(self, name: str) -> int:
        """Index of a joint by name, or by role as in ``index("left_foot")``."""
        if name in self.names:
            return self.names.index(name)
        if isinstance(name, str) and name in self.roles:
            return self.roles[name]
        raise SkeletonError(
            f"This skeleton has no joint or role {name!r}. Joints: {', '.join(self.names)}. "
            f"Roles: {', '.join(self.roles)}."
        )

    def __repr__(self) -> str:
        return f"Skeleton({self.joints} joints, {len(self.end_parents)} end sites)"

    def matches(self, other: Skeleton, tolerance: float = 1e-4) -> bool:
        """Same joints in the same tree with offsets equal to `tolerance` metres (root aside)."""
        return self is other or (
            self.names == other.names
            and self.parents == other.parents
            and self.end_parents == other.end_parents
            and torch.allclose(self.offsets[1:], other.offsets[1:], rtol=0, atol=tolerance)
            and torch.allclose(self.end_offsets, other.end_offsets, rtol=0, atol=tolerance)
        )

    def difference(self, other: Skeleton) -> str:
        """In words, where a skeleton that does not match this one differs most plainly."""
        if self.joints != other.joints:
            return f"{self.joints} and {other.joints} joints"
        for joint, names in enumerate(zip(self.names, other.names, strict=True)):
            if names[0] != names[1]:
                return f"joint {joint} is called {names[0]!r} and {names[1]!r}"
        if self.point_parents != other.point_parents:
            return "the joints and end sites hang together in different ways"
        gaps = torch.cat([self.offsets - other.offsets, self.end_offsets - other.end_offsets])
        gaps = gaps.norm(dim=-1)
        gaps[0] = 0  # the root's offset is for reference only
        most = int(gaps.argmax())
        return f"the offsets of {self.point_names[most]!r} differ by {100 * gaps[most]:.2g} cm"

    # -- meaning ------------------------------------------------------------------------------

    @cached_property
    def roles(self) -> dict[str, int]:
        """Joint of each body part that could be told from the names, as ``{"left_foot": 16}``.

        Roles: hips, spine, chest, neck, head, and with ``left_`` or ``right_`` before them
        shoulder, upper_arm, lower_arm, hand, upper_leg, lower_leg, foot, toes.
        """
        found: dict[str, int] = {}
        for joint, name in enumerate(self.names):
            role = _role(name)
            if role is not None:
                found.setdefault(role, joint)
        chest = self._common_ancestor(found.get("left_upper_arm"), found.get("right_upper_arm"))
        if chest:  # a root that carries the arms itself is still the hips
            found["chest"] = chest
            if found.get("spine", chest) >= chest:
                found.pop("spine", None)
        return dict(sorted(found.items(), key=lambda item: item[1]))

    def below(self, role: str, child: str) -> Tensor | None:
        """Where a joint that hangs on another, at any depth, is in its frame, (3,) metres.

        Both by their roles; joints between, such as those that spread a twist, are as at rest. None
        if it does not hang there.
        """
        start, end = self.roles[role], self.roles.get(child, -1)
        offset = torch.zeros(3)
        while end > start:
            offset, end = offset + self.offsets[end], self.parents[end]
        return offset if end == start else None

    @cached_property
    def mirror_partners(self) -> tuple[int, ...]:
        """For each joint the joint on the other side of the body, itself if it is central."""
        keys = [_split_side(name) for name in self.names]
        other = {"left": "right", "right": "left"}
        where: dict[tuple[str | None, str], int] = {}
        for joint, key in enumerate(keys):
            where.setdefault(key, joint)  # of two that read alike the first has the partner
        return tuple(
            where.get((other[side], base), joint) if side and where[side, base] == joint else joint
            for joint, (side, base) in enumerate(keys)
        )

    def mirrored(self) -> Skeleton:
        """The skeleton seen in a mirror that swaps left (+x) and right (-x)."""
        flip = torch.tensor([-1.0, 1.0, 1.0])
        partners = self.mirror_partners
        ends = self._end_partners(partners)
        return Skeleton(
            self.names,
            self.parents,
            self.offsets[list(partners)] * flip,
            self.end_parents,
            self.end_offsets[ends] * flip,
            self.rotation_orders,
        )

    def without_end_sites(self) -> Skeleton:
        """The joints alone: what an encoding or a file without tips describes."""
        return Skeleton(self.names, self.parents, self.offsets, (), (), self.rotation_orders)

    def _end_partners(self, partners: Sequence[int]) -> list[int]:
        """For each end site the one in the same place on the partner of its joint."""
        seen: Counter[int] = Counter()
        rank = []
        for parent in self.end_parents:
            rank.append(seen[parent])
            seen[parent] += 1
        where = {key: i for i, key in enumerate(zip(self.end_parents, rank, strict=True))}
        keys = [(partners[p], r) for p, r in zip(self.end_parents, rank, strict=True)]
        return [where.get(key, i) for i, key in enumerate(keys)]

    def _common_ancestor(self, a: int | None, b: int | None) -> int | None:
        if a is None or b is None:
            return None
        above = set()
        while a != -1:
            above.add(a)
            a = self.parents[a]
        while b not in above:
            b = self.parents[b]
        return b

    @staticmethod
    def canonical() -> Skeleton:
        """The 21-joint skeleton that motionlab's models share: T-pose, facing +z, 1.6 m tall.

        Bone lengths are those of the Bandai-Namco data; that data's end sites have no length, so
        head, hands and toes get tips of human size.
        """
        return _canonical()


def _words(values: Sequence[str], what: str) -> tuple[str, ...]:
    given = not isinstance(values, str) and isinstance(values, Iterable)
    words = tuple(values) if given else (values,)
    if not given or not all(isinstance(word, str) for word in words):
        raise SkeletonError(f"`{what}` is {values!r}; it must be a list of words, one per joint.")
    return words


def _indices(values: Sequence[int], what: str) -> tuple[int, ...]:
    try:
        return tuple(operator.index(value) for value in values)
    except TypeError as error:
        raise SkeletonError(f"`{what}` must be whole numbers, joint indices: {error}.") from error


@torch.inference_mode(False)  # a body met while sampling must serve when training
def _vectors(values: Tensor, what: str) -> Tensor:
    """Values as float32 (n, 3)."""
    # an array is copied: its owner may go on writing to it
    keep = torch.as_tensor if isinstance(values, Tensor) else torch.tensor
    values = values.clone() if isinstance(values, Tensor) and values.is_inference() else values
    try:
        vectors = keep(values, dtype=torch.float32)
    except (TypeError, ValueError, RuntimeError) as error:
        raise SkeletonError(f"`{what}` must be numbers, (n, 3): {error}.") from error
    if vectors.numel() == 0:
        return vectors.reshape(0, 3)
    if vectors.ndim != 2 or vectors.shape[1] != 3:
        raise SkeletonError(f"`{what}` has shape {tuple(vectors.shape)}; it must be (n, 3).")
    return vectors


# What people call their joints. Matched against the name without its side, lower case, letters
# only: "LeftUpLeg" -> "upleg", "rThigh" -> "thigh", "UpperArm_L" -> "upperarm".
_CENTRAL = {
    "hips": "hips hip pelvis root",
    "spine": "spine lowerback abdomen tospine torso",
    "chest": "chest thorax spine1 spine2 upperchest",
    "neck": "neck",
    "head": "head",
}
_PAIRED = {
    "shoulder": "shoulder collar clavicle",
    "upper_arm": "arm upperarm uparm shldr",
    "lower_arm": "forearm lowerarm elbow",
    "hand": "hand wrist",
    "upper_leg": "upleg upperleg thigh",
    "lower_leg": "leg lowerleg shin calf knee",
    "foot": "foot ankle",
    "toes": "toes toe toebase ball",
}
_ROLE_OF = {
    (paired, word): role
    for paired, table in ((False, _CENTRAL), (True, _PAIRED))
    for role, words in table.items()
    for word in words.split()
}


def _split_side(name: str) -> tuple[str | None, str]:
    """("left", "upleg") from LeftUpLeg, lUpLeg, UpLeg_L, mixamorig:LeftUpLeg; (None, ...) else."""
    name = name.rsplit(":", 1)[-1]
    letters = re.sub(r"[^a-z0-9]", "", name.lower())
    if (False, letters) in _ROLE_OF:  # ROOT is no right "oot"
        return None, letters
    for side in SIDES:
        initial = side[0]
        patterns = (
            rf"^{side}[_ .-]?(.+)$",
            rf"^(.+?)[_ .-]?{side}$",
            rf"^(?:{initial}|{initial.upper()})(?=[A-Z_ .-])[_ .-]?(.+)$",
            rf"^(.+)[_ .-](?:{initial}|{initial.upper()})$",
        )
        for i, pattern in enumerate(patterns):
            match = re.match(pattern, name, re.IGNORECASE if i < 2 else 0)
            if match:
                return side, re.sub(r"[^a-z0-9]", "", match[1].lower())
    return None, letters


def _role(name: str) -> str | None:
    side, base = _split_side(name)
    role = _ROLE_OF.get((side is not None, base))
    return role if side is None or role is None else f"{side}_{role}"


# Name, parent, offset in metres. The feet are as bandai-locomotion's clips hold them in a flat
# stance; the T-pose stands on the floor y = 0 with ankles 10 cm and toe joints 2.5 cm above it.
_CANONICAL = (
    ("Hips", None, (0.0, 0.9226, 0.0)),
    ("Spine", "Hips", (0.0, 0.1574, 0.0)),
    ("Chest", "Spine", (0.0, 0.0898, 0.0)),
    ("Neck", "Chest", (0.0, 0.1638, 0.0)),
    ("Head", "Neck", (0.0, 0.0646, 0.0)),
    ("LeftShoulder", "Chest", (0.0498, 0.1299, 0.0)),
    ("LeftUpperArm", "LeftShoulder", (0.0535, 0.0, 0.0)),
    ("LeftLowerArm", "LeftUpperArm", (0.2433, 0.0, 0.0)),
    ("LeftHand", "LeftLowerArm", (0.2229, 0.0, 0.0)),
    ("RightShoulder", "Chest", (-0.0498, 0.1299, 0.0)),
    ("RightUpperArm", "RightShoulder", (-0.0535, 0.0, 0.0)),
    ("RightLowerArm", "RightUpperArm", (-0.2433, 0.0, 0.0)),
    ("RightHand", "RightLowerArm", (-0.2229, 0.0, 0.0)),
    ("LeftUpperLeg", "Hips", (0.0647, -0.0219, 0.0)),
    ("LeftLowerLeg", "LeftUpperLeg", (0.0, -0.3908, 0.0)),
    ("LeftFoot", "LeftLowerLeg", (0.0, -0.4099, 0.0)),
    ("LeftToes", "LeftFoot", (0.0, -0.0749, 0.0906)),
    ("RightUpperLeg", "Hips", (-0.0647, -0.0219, 0.0)),
    ("RightLowerLeg", "RightUpperLeg", (0.0, -0.3908, 0.0)),
    ("RightFoot", "RightLowerLeg", (0.0, -0.4099, 0.0)),
    ("RightToes", "RightFoot", (0.0, -0.0749, 0.0906)),
)
_CANONICAL_TIPS = (
    ("Head", (0.0, 0.20, 0.0)),
    ("LeftHand", (0.16, 0.0, 0.0)),
    ("RightHand", (-0.16, 0.0, 0.0)),
    ("LeftToes", (0.0, -0.005, 0.06)),
    ("RightToes", (0.0, -0.005, 0.06)),
)


@cache
def _canonical() -> Skeleton:
    names = [name for name, *_ in _CANONICAL]
    with torch.inference_mode(False):  # kept for later calls, which may need gradients
        return Skeleton(
            tuple(names),
            tuple(names.index(parent) if parent else -1 for _, parent, _ in _CANONICAL),
            torch.tensor([offset for *_, offset in _CANONICAL]),
            tuple(names.index(name) for name, _ in _CANONICAL_TIPS),
            torch.tensor([offset for _, offset in _CANONICAL_TIPS]),
        )
