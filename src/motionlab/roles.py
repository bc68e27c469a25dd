"""Which joint is which: by its name, and what names leave open by its place in the tree.

Roles are hips, spine, chest, neck, head, and with ``left_`` or ``right_`` before them shoulder
(the collar bone's joint), upper_arm, lower_arm, hand, upper_leg, lower_leg, foot (the ankle's
joint), toes. A joint is called after the bone that it turns: the knee is ``lower_leg``.

Names are cut where case, digits or separators tell words apart. Namespaces, numbers, what nearly
all joints are called and what says nothing (``jnt``, ``bind``, ``DEF``, ``Bip01``) are left out. A
side is ``left``, ``l``, ``lf``, ``lft`` or ``lt``, ``right``, ``r``, ``rgt`` or ``rt``, anywhere in
the name, also glued to a known word (``lshoulder``, ``RUArm``). The rest must be a known word; a
name that says more, as ``LeftFootIK`` or ``LeftHandThumb1``, gets no role::

    upper leg     thigh upleg upperleg legupper uleg femur; hip, if it has a side
    lower leg     shin calf shank knee tibia lowerleg lowleg loleg leglower
    either leg    leg
    foot          ankle talocrural; foot, which is the toes below an ankle
    toes          toe toes toebase ball bigtoe forefoot footindex
    shoulder      collar collarbone clavicle clav scapula; shoulder shldr
    upper arm     upperarm uparm uarm armupper humerus arm; shoulder shldr, below a collar or
                  right above an elbow
    lower arm     forearm farm lowerarm lowarm loarm armlower elbow radius ulna; arm, below another
    hand          hand wrist
    hips          hips hip pelvis midhip hipcenter spinebase root
    spine         spine abdomen ab waist lowerback upperback back tospine torso stomach belly
                  lumbar spinemid spinenavel
    chest         chest thorax upperchest ribs ribcage sternum spinechest spineshoulder
    neck          neck necktwist lowerneck upperneck necklower neckupper cervical
    head          head skull

MikuMikuDance's Japanese names are read, too, and what stands in square brackets is left out.

Then the tree: down a leg come upper leg, lower leg, foot and toes, down an arm shoulder, upper arm,
lower arm and hand, and of two joints that could be either the upper one is it, or the one whose name
has nothing left out (CMU's ``LeftHip``, which hangs on a ``LHipJoint``). Hips are where both
legs meet, whatever they are called, one joint between shin and toes is the foot, the chest is where the arms branch off, the spine is the first
joint from the one to the other, the neck carries the head.

What is understood wrongly or not at all is said with ``roles={"left_foot": "LFoot"}``; ``motionlab
info FILE`` shows what was understood.
"""

from __future__ import annotations

import json
import os
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path

from .errors import SkeletonError
from .joint_names import CLEAR, LIMB_OF, NEARLY_ALL, SIDES, TRUNK_OF, readings

TRUNK = ("hips", "spine", "chest", "neck", "head")
ARM = ("shoulder", "upper_arm", "lower_arm", "hand")
LEG = ("upper_leg", "lower_leg", "foot", "toes")
ALL = TRUNK + tuple(f"{side}_{part}" for side in SIDES for part in ARM + LEG)
_SAID = 1000  # weight of what was said, more than all names of a limb together


class Roles(dict):
    """Joint index of each role that a skeleton has; `given` are those that were said by name."""

    def __init__(self, found: Mapping[str, int], given: Mapping[str, str]) -> None:
        super().__init__(found)
        self.given = dict(given)

    def __reduce__(self):
        return Roles, (dict(self), self.given)


def find(
    names: Sequence[str], parents: Sequence[int], given: Mapping[str, str] | None = None
) -> Roles:
    """Joint of each role, as ``{"left_foot": 16}``, in the order of the joints.

    Parameters
    ----------
    names, parents : as a `Skeleton`'s.
    given : joints by role, as ``{"left_foot": "LFoot"}``, which win over what is understood; a role
        that no joint has is ``""``.

    Raises
    ------
    SkeletonError : `given` names a role or a joint that there is not, or one joint twice.
    """
    given = given.given if isinstance(given, Roles) else given
    said = _check(given, names)
    found = _find(tuple(names), tuple(parents), tuple(said.items()))
    return Roles(dict(found), given or {})


@lru_cache(256)  # the clips of a data set have few skeletons
def _find(
    names: tuple[str, ...], parents: tuple[int, ...], given: tuple[tuple[str, int | None], ...]
) -> tuple[tuple[str, int], ...]:
    """The roles and their joints; given : those that were said, None for a role without a joint."""
    said = dict(given)
    sides, words, left_out = zip(*readings(names), strict=True)
    counts = Counter(token for rest in left_out for token in set(rest))
    common = {token for token, n in counts.items() if n >= NEARLY_ALL * len(names)}
    plain = [not any(map(str.isalpha, {*rest} - common)) for rest in left_out]
    limbs: dict[str, int] = {}
    for side in SIDES:
        own = [word if s == side else "" for s, word in zip(sides, words, strict=True)]
        for parts in (ARM, LEG):
            limb = _limb(_weights(own, plain, parts, side, said), parents, parts)
            silent = [
                s in (None, side) and word not in LIMB_OF and word not in TRUNK_OF
                for s, word in zip(sides, words, strict=True)
            ]
            free = [part for part in parts if f"{side}_{part}" not in said]
            limb |= _between(limb, silent, parents, parts, free)
            limbs |= {f"{side}_{part}": joint for part, joint in limb.items()}
    taken = {*limbs.values(), *said.values()}
    kinds = [
        None if side or joint in taken else word
        for joint, (side, word) in enumerate(zip(sides, words, strict=True))
    ]
    found = limbs | _trunk(limbs, kinds, parents, said)
    return tuple(sorted(found.items(), key=lambda item: item[1]))


def partners(names: Sequence[str], roles: Mapping[str, int]) -> tuple[int, ...]:
    """For each joint the joint on the other side of the body, itself if none is known."""
    keys = [(side, (word, *beside)) for side, word, beside in readings(tuple(names))]
    where: dict[tuple, int] = {}
    for joint, key in enumerate(keys):
        where.setdefault(key, joint)  # of two that read alike the first has the partner
    other = dict(zip(SIDES, SIDES[::-1], strict=True))
    found = [
        where.get((other[side], rest), joint) if side and where[side, rest] == joint else joint
        for joint, (side, rest) in enumerate(keys)
    ]
    for part in ARM + LEG:  # what was said of joints whose names are no pair, or another one
        pair = [roles.get(f"{side}_{part}") for side in SIDES]
        if None in pair:
            continue
        for joint in pair:
            found[found[joint]] = found[joint]
        found[pair[0]], found[pair[1]] = pair[1], pair[0]
    return tuple(found)


def sided(names: Sequence[str]) -> tuple[bool, ...]:
    """For each joint whether its name has a side."""
    return tuple(side is not None for side, *_ in readings(tuple(names)))


def read(path: str | os.PathLike) -> dict[str, str]:
    """Joints by role out of a TOML or JSON file, as ``left_foot = "LFoot"``.

    Raises
    ------
    SkeletonError : no such file, its syntax is wrong, or it holds no such table.
    """
    found = table(path, 'a line there looks like left_foot = "LFoot"')
    if not isinstance(found, dict) or not all(isinstance(name, str) for name in found.values()):
        raise SkeletonError(
            f'{path}: must be one flat table of joints by role, as left_foot = "LFoot".'
        )
    return found


def table(path: str | os.PathLike, example: str) -> object:
    """What a TOML or JSON file holds; example : what is said of how it should look.

    Raises
    ------
    SkeletonError : no such file, or its syntax is wrong.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
        found = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise SkeletonError(
            f"{path}: can't be opened ({error.strerror}); name a TOML or JSON file."
        ) from error
    except ValueError as error:  # both parsers', and text that is no UTF-8
        raise SkeletonError(
            f"{path}: is no {'JSON' if path.suffix.lower() == '.json' else 'TOML'}: {error}; "
            f"{example}."
        ) from error
    return found


# -- the tree -------------------------------------------------------------------------------------


def _check(given: Mapping[str, str] | None, names: Sequence[str]) -> dict[str, int | None]:
    """Joint index by role of what was said; None where no joint has the role."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise SkeletonError(f"`roles` is {given!r}; give joints by role: {{'left_foot': 'LFoot'}}.")
    said: dict[str, int | None] = {}
    for role, name in given.items():
        if role not in ALL:
            raise SkeletonError(f"`roles` has {role!r}, which is no role; roles: {', '.join(ALL)}.")
        if name != "" and name not in names:
            raise SkeletonError(
                f"`roles` says that {role} is {name!r}, but there is no such joint; joints: "
                f"{', '.join(names)}."
            )
        said[role] = None if name == "" else names.index(name)
        if name != "" and list(said.values()).count(said[role]) > 1:
            raise SkeletonError(f"`roles` gives the joint {name!r} two roles; it can have one.")
    return said


def _weights(
    words: Sequence[str],
    plain: Sequence[bool],
    parts: Sequence[str],
    side: str,
    said: Mapping[str, int | None],
) -> list[dict[str, int]]:
    """How much each joint's word speaks for each part of a limb, a little more if it is all of the
    name; what was said outweighs all."""
    open_ = [part for part in parts if f"{side}_{part}" not in said]
    fixed = {joint: role for role, joint in said.items() if joint is not None}
    weights: list[dict[str, int]] = []
    for joint, word in enumerate(words):
        known = LIMB_OF.get(word, {}).items()
        says = {part: weight + plain[joint] for part, weight in known if part in open_}
        if joint in fixed:
            part = fixed[joint].removeprefix(f"{side}_")
            says = {part: _SAID} if part in parts else {}
        weights.append(says)
    return weights


def _limb(
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


def _between(
    limb: Mapping[str, int],
    silent: Sequence[bool],
    parents: Sequence[int],
    parts: Sequence[str],
    free: Sequence[str],
) -> dict[str, int]:
    """Parts that are missing between two others of a limb, where one joint alone lies between them
    whose name is `silent` (joints,): what hangs on a shin and carries toes is a foot."""
    found = {}
    for above, part, below in zip(parts, parts[1:], parts[2:], strict=False):
        if part in free and part not in limb and above in limb and below in limb:
            joint = parents[limb[below]]
            if joint >= 0 and silent[joint] and parents[joint] == limb[above]:
                found[part] = joint
    return found


def _score(best: tuple[int, tuple]) -> int:
    return best[0]


def _trunk(
    limbs: Mapping[str, int],
    words: Sequence[str | None],
    parents: Sequence[int],
    said: Mapping[str, int | None],
) -> dict[str, int]:
    """Joint of each role of the trunk. words : each joint's, None where it is none of the trunk."""
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
    settle("head", of("head", top), of("head"), spines[-1:])
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
