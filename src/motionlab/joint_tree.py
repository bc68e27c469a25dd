"""Which joint is which by its place in the tree: limbs, and the trunk between them.

`roles` says in words how; `joint_names` reads the names that come before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, pairwise

from .joint_names import ARM, CLEAR, LEG, SIDES, TRUNK_OF

_LIKE = 0.75  # of the two long bones of a limb the shorter is this share of the other at least
_LONG = 0.75  # and any other bone of the limb is at most this share of the shorter one
_FOOT = 0.2  # of the longer one a foot has this share at least, and its toes are no longer than it


def limb(
    weights: list[dict[str, int]], parents: Sequence[int], parts: Sequence[str]
) -> dict[str, int]:
    """Joint of each part of a limb: the parts in their order down one chain, at most weight.

    Parts that do not hang on that chain are taken from wherever their name is clear.
    """
    count = len(parts)
    # of what hangs below each joint (and, last, below nothing): the best from part k on
    below = [[(0, ())] * (count + 1) for _ in range(len(parents) + 1)]
    for joint in reversed(range(len(parents))):
        own, above = list(below[joint]), below[parents[joint]]
        for k in range(count):
            for m in range(k, count):
                if weight := weights[joint].get(parts[m]):
                    score, rest = below[joint][m + 1]
                    own[k] = max((weight + score, ((parts[m], joint), *rest)), own[k], key=_score)
        for k in range(count):
            above[k] = max(own[k], above[k], key=_score)  # of equals the first joint
    found = dict(below[-1][0][1])
    if not {"shoulder", "lower_arm"} & {*found} and "upper_arm" in found:
        if "shoulder" in weights[found["upper_arm"]]:  # and no elbow hangs on it
            found["shoulder"] = found.pop("upper_arm")
    for part in parts:
        if part not in found:
            clear = (j for j, says in enumerate(weights) if says.get(part, 0) >= CLEAR)
            joint = next((j for j in clear if j not in found.values()), None)
            found |= {} if joint is None else {part: joint}
    return found


def by_place(
    sides: Sequence[str | None], parents: Sequence[int], lengths: Sequence[float]
) -> dict[str, int]:
    """Joints of both arms and both legs from the tree alone, as ``{"left_foot": 16}``.

    On each side two chains of three joints or more hang on the trunk. The one that leaves it nearer
    to the root is the leg. Of a chain's bones the two longest are thigh and shin, or upper and lower
    arm; that tells a collar bone before them, and toes and tips behind.

    Parameters
    ----------
    sides, parents : of each joint (joints,).
    lengths : of each joint's offset from its parent (joints,), in any unit.

    Returns
    -------
    nothing where there is a choice: other chains, all on one joint, sides that differ, no two bones
    that stand out.
    """
    found: dict[str, int] = {}
    shapes, hung = [], _hung(parents)
    for side in SIDES:
        starts = [j for j, s in enumerate(sides) if s == side and _sided(parents[j], sides) != side]
        chains = [line for line in (_stem(j, hung) for j in starts) if len(line) >= 3]
        if len(chains) != 2:
            return {}
        leg, arm = sorted(chains, key=lambda line: len(_line(parents[line[0]], parents)))
        if parents[leg[0]] not in _line(parents[arm[0]], parents)[:-1]:
            return {}
        for parts, upper, line in ((ARM, 1, arm), (LEG, 0, leg)):
            first = _long_bones(line, lengths)
            if first is None or (parts is LEG and not _ends_in_a_foot(line[first:], lengths)):
                return {}
            line = line[max(first - upper, 0) :]
            own = dict(zip(parts[max(upper - first, 0) :], line, strict=False))
            shapes.append([*own])
            found |= {f"{side}_{part}": joint for part, joint in own.items()}
    if shapes[:2] != shapes[2:]:
        return {}
    return found | _crown(_meeting(found, ARM[1], parents)[-1], sides, hung, lengths)


def _sided(joint: int, sides: Sequence[str | None]) -> str | None:
    return sides[joint] if joint >= 0 else None


def _hung(parents: Sequence[int]) -> list[list[int]]:
    """The joints that hang on each joint."""
    hung: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            hung[parent].append(joint)
    return hung


def _stem(joint: int, hung: list[list[int]]) -> list[int]:
    """The joints from one down to where the tree branches, single joints that hang there aside."""
    line = [joint]
    while True:
        below = hung[line[-1]]
        below = [child for child in below if hung[child]] if len(below) > 1 else below
        if len(below) != 1:
            return line
        line += below


def _crown(
    chest: int, sides: Sequence[str | None], hung: list[list[int]], lengths: Sequence[float]
) -> dict[str, int]:
    """Neck and head, if two joints alone go up from where the arms meet, or a third one on them whose
    way is longer than from neck to head, as a tip's is."""
    alone = [_stem(joint, hung) for joint in hung[chest] if sides[joint] is None]
    if len(alone) != 1 or not 2 <= len(alone[0]) <= 3:
        return {}
    neck, head, *tip = alone[0]
    return {} if tip and lengths[tip[0]] < lengths[head] else {"neck": neck, "head": head}


def _long_bones(line: list[int], lengths: Sequence[float]) -> int | None:
    """Where a limb's two long bones begin in a chain of joints; None if no two stand out."""
    bones = [lengths[joint] for joint in line[1:]]  # the last joint's is not known
    pairs = [a + b for a, b in pairwise(bones)]
    first = max(range(len(pairs)), key=pairs.__getitem__)
    short, long = sorted(bones[first : first + 2])
    others = bones[:first] + bones[first + 2 :]
    alike = 0 < short and short >= _LIKE * long
    return first if alike and all(bone <= _LONG * short for bone in others) else None


def _ends_in_a_foot(leg: list[int], lengths: Sequence[float]) -> bool:
    """Whether what follows thigh and shin may be a foot, and no joint low in the shin."""
    long, *rest = max(lengths[joint] for joint in leg[1:3]), *(lengths[j] for j in leg[3:])
    return not rest or (rest[0] >= _FOOT * long and (len(rest) == 1 or rest[1] <= rest[0]))


def between(
    known: Mapping[str, int],
    silent: Sequence[bool],
    parents: Sequence[int],
    parts: Sequence[str],
    free: Sequence[str],
) -> dict[str, int]:
    """Parts that are missing between two others of a limb, where one joint alone lies between them
    whose name is `silent` (joints,): what hangs on a shin and carries toes is a foot."""
    found = {}
    for above, part, below in zip(parts, parts[1:], parts[2:], strict=False):
        if part in free and part not in known and above in known and below in known:
            joint = parents[known[below]]
            if joint >= 0 and silent[joint] and parents[joint] == known[above]:
                found[part] = joint
    return found


def _score(best: tuple[int, tuple]) -> int:
    return best[0]


def trunk(
    limbs: Mapping[str, int],
    words: Sequence[str | None],
    parents: Sequence[int],
    said: Mapping[str, int | None],
    placed: Mapping[str, int],
) -> dict[str, int]:
    """Joint of each role of the trunk.

    words : each joint's, None where it is none of the trunk; placed : what `by_place` found, of which
    the head is taken where no name tells it."""
    kinds = [TRUNK_OF.get(word) for word in words]
    every = range(len(kinds))
    found: dict[str, int] = {}

    def settle(role: str, *choices: list[int]) -> None:
        taken = {*limbs.values(), *said.values(), *found.values()}
        free = (joint for joint in chain(*choices) if joint not in taken)
        if (joint := said.get(role, next(free, None))) is not None:
            found[role] = joint

    of = lambda kind, among=every: [joint for joint in among if kinds[joint] == kind]
    legs, arms = (_meeting(limbs, part, parents) for part in ("upper_leg", "upper_arm"))
    settle("hips", legs[-1:], [j for j in of("hips") if words[j] != "root"], of("hips"))
    hips = _line(found.get("hips"), parents)
    # a root may carry all limbs itself, and Biped's neck carries the arms, another rig's neck_base
    arms = [joint for joint in arms if joint not in hips and "neck" not in (words[joint] or "")]
    settle("chest", arms[-1:], of("chest"))
    chest = _line(found.get("chest"), parents)
    between = [joint for joint in chest[:-1] if joint not in hips] if hips else []
    named = [j for j in (between if hips and chest else every) if kinds[j] in ("spine", "chest")]
    settle("spine", named, between)

    top = _below(found["chest"], parents) if chest else every
    spines = of("spine", top) if arms else []
    spines = spines if len(spines) > 1 else []  # Rigify's go on to the head
    crown = [joint for role, joint in placed.items() if role == "head" and joint in top]
    settle("head", of("head", top), of("head"), spines[-1:], crown)
    neck = _line(found.get("head"), parents)[:-1]
    silent = [j for j in neck if chest and j in top and words[j] is not None and kinds[j] is None]
    named = spines[:1] if found.get("head") in spines else []
    settle("neck", of("neck", neck), of("neck", top), of("neck"), named, silent[-1:])
    return found


def _line(joint: int | None, parents: Sequence[int]) -> list[int]:
    """The joints from the root down to one, both included."""
    line = []
    while joint is not None and joint >= 0:
        line.append(joint)
        joint = parents[joint]
    return line[::-1]


def _meeting(limbs: Mapping[str, int], part: str, parents: Sequence[int]) -> list[int]:
    """The joints above both sides' part, from the root down to where they meet."""
    left, right = (_line(limbs.get(f"{side}_{part}"), parents) for side in SIDES)
    return [a for a, b in zip(left, right, strict=False) if a == b]


def _below(joint: int, parents: Sequence[int]) -> list[int]:
    """The joints that hang on one, at any depth."""
    inside = {joint}
    for other, parent in enumerate(parents):
        if parent in inside:
            inside.add(other)
    return sorted(inside - {joint})
