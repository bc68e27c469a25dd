"""The skeleton: a tree of joints with fixed bone lengths."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import torch
from torch import Tensor

from .errors import SkeletonError
from .roles import find, partners, sided

_MIDDLE = 0.02  # metres off a body's middle where a joint without partner is on one side


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
    roles : joints by role, as ``{"left_foot": "LFoot"}``, where names are not understood or wrongly;
        these win. The attribute has the index of each role's joint, as ``{"left_foot": 16}``, in
        the order of the joints: those given, and those told from names and tree (`motionlab.roles`).

    Points are the joints in order, then the end sites in order.

    Raises
    ------
    SkeletonError : the arrays disagree, a name appears twice, the joints are not a tree, or `roles`
        names what is not there.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Tensor
    end_parents: tuple[int, ...] = ()
    end_offsets: Tensor = field(default_factory=lambda: torch.zeros(0, 3))
    rotation_orders: tuple[str, ...] = ()
    roles: Mapping[str, str] | None = None

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
        set_(
            "roles", find(self.names, self.parents, self.roles, self.offsets.norm(dim=-1).tolist())
        )

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
        """Index of a joint by name, or by role as in ``index("left_foot")``.

        SMPL calls the joint of its toes left_foot: a name wins, and `role` asks for roles alone.
        """
        if name in self.names:
            return self.names.index(name)
        return self.role(name)

    def role(self, name: str) -> int:
        """Index of the joint that has a role, as in ``role("left_foot")``."""
        if isinstance(name, str) and name in self.roles:
            return self.roles[name]
        raise SkeletonError(
            f"This skeleton has no joint or role {name!r}. Joints: {', '.join(self.names)}. "
            f"Roles: {', '.join(self.roles) or 'none'}. Which joint has one is said with "
            f"read_bvh(path, roles={{{str(name)!r}: 'NAME'}})."
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
    @torch.inference_mode(False)  # kept for later calls, which may need gradients
    def rest_points(self) -> Tensor:
        """Points (points, 3) in metres of the rest pose, the root at the origin."""
        points = torch.zeros(self.points, 3)
        offsets = torch.cat([self.offsets, self.end_offsets])
        for point, parent in enumerate(self.point_parents[1:], start=1):
            points[point] = points[parent] + offsets[point]
        return points

    @cached_property
    def mirror_partners(self) -> tuple[int, ...]:
        """For each joint the joint on the other side of the body, itself if it is central."""
        return partners(self.names, self.roles)

    @cached_property
    def without_partner(self) -> tuple[int, ...]:
        """Joints on one side of the body whose partner on the other is not known.

        Those with a side in their names, and those that lie off the plane in which the partners of
        the rest pose are mirrored; without any partners, off the plane x = 0 through the hips.
        """
        alone = [joint for joint, other in enumerate(self.mirror_partners) if joint == other]
        marked = sided(self.names)
        off = self._off_middle()
        return tuple(joint for joint in alone if marked[joint] or off[joint] > _MIDDLE)

    def _off_middle(self) -> Tensor:
        """How far in metres each joint (joints,) lies off the body's middle; 0 if that is unknown."""
        points = self.rest_points[: self.joints]
        pairs = [(a, b) for a, b in enumerate(self.mirror_partners) if a < b]
        across, middle = torch.tensor([1.0, 0.0, 0.0]), points[self.roles.get("hips", 0)]
        if pairs:
            ones, others = (points[list(joints)] for joints in zip(*pairs, strict=True))
            apart = ones - others
            apart = apart * (apart @ apart[apart.norm(dim=-1).argmax()]).sign()[:, None]
            across = torch.nn.functional.normalize(apart.sum(0), dim=0)
            middle = ((ones + others) / 2).mean(0)
            mirrored = others + 2 * ((middle - others) @ across)[:, None] * across
            if (mirrored - ones).norm(dim=-1).median() > _MIDDLE:
                return torch.zeros(self.joints)  # bones drawn along their axes, say
        return ((points - middle) @ across).abs()

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
            self.roles,
        )

    def without_end_sites(self) -> Skeleton:
        """The joints alone: what an encoding or a file without tips describes."""
        return replace(self, end_parents=(), end_offsets=torch.zeros(0, 3))

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
