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
    upper arm     upperarm uparm uarm armupper humerus bicep biceps arm; shoulder shldr, below a collar or
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
joint from the one to the other, the neck carries the head. Of limbs whose names say too little
(``leg_L_01`` to ``leg_L_04``, or words of another language) the bones tell: of the two chains on each
side the leg is the one nearer to the root, and its two longest bones are thigh and shin; what hangs
on an ankle without a name is no foot though it be called so. `Roles.placed` names what was told so,
and `retarget` warns of it. No clear word is overruled.

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
from pathlib import Path

from .errors import SkeletonError
from .joint_names import ARM, CLEAR, LEG, LIMB_OF, NEARLY_ALL, SIDES, TRUNK, TRUNK_OF, readings
from .joint_tree import between, by_place, limb, trunk

_SIDED = tuple(f"{side}_{part}" for side in SIDES for part in ARM + LEG)
ALL = TRUNK + _SIDED
_OF_LIMBS = tuple(f"{side}_{part}" for side in SIDES for part in ARM[1:] + LEG[:3])
_SAID = 1000  # weight of what was said, more than all names of a limb together


class Roles(dict):
    """Joint index of each role that a skeleton has; `given` are those that were said by name, `placed`
    those that no name says and the lengths of bones tell."""

    def __init__(
        self, found: Mapping[str, int], given: Mapping[str, str], placed: Sequence[str] = ()
    ) -> None:
        super().__init__(found)
        self.given, self.placed = dict(given), tuple(placed)

    def __reduce__(self):
        return Roles, (dict(self), self.given, self.placed)


def find(
    names: Sequence[str],
    parents: Sequence[int],
    given: Mapping[str, str] | None = None,
    lengths: Sequence[float] = (),
) -> Roles:
    """Joint of each role, as ``{"left_foot": 16}``, in the order of the joints.

    Parameters
    ----------
    names, parents : as a `Skeleton`'s.
    given : joints by role, as ``{"left_foot": "LFoot"}``, which win over what is understood; a role
        that no joint has is ``""``.
    lengths : of each joint's offset from its parent (joints,), in any unit. Without them no limb is
        told by its bones where names leave it open.

    Raises
    ------
    SkeletonError : `given` names a role or a joint that there is not, or one joint twice.
    """
    given = given.given if isinstance(given, Roles) else given
    rig = tuple(names), tuple(parents), tuple(_check(given, names).items())
    found, placed = dict(_find(*rig)), ()
    if len(lengths) and any(role not in found for role in _SIDED):
        sides = [side for side, *_ in readings(rig[0])]
        named, placed = found, by_place(sides, parents, lengths)
        found = dict(_find(*rig, tuple(placed.items())))
        placed = [role for role in found if role in placed and named.get(role) != found[role]]
    return Roles(found, given or {}, placed)


@lru_cache(256)  # the clips of a data set have few skeletons
def _find(
    names: tuple[str, ...],
    parents: tuple[int, ...],
    given: tuple[tuple[str, int | None], ...],
    placed: tuple[tuple[str, int], ...] = (),
) -> tuple[tuple[str, int], ...]:
    """The roles and their joints; given : those that were said, None for a role without a joint;
    placed : joints of limbs by their place, for limbs that names leave open."""
    said = dict(given)
    sides, words, left_out = zip(*readings(names), strict=True)
    counts = Counter(token for rest in left_out for token in set(rest))
    common = {token for token, n in counts.items() if n >= NEARLY_ALL * len(names)}
    plain = [not any(map(str.isalpha, {*rest} - common)) for rest in left_out]
    silent = [word not in LIMB_OF and word not in TRUNK_OF for word in words]
    limbs: dict[str, int] = {}
    for parts in (ARM, LEG):
        both: dict[str, int] = {}
        for side in SIDES:
            own = [word if s == side else "" for s, word in zip(sides, words, strict=True)]
            own = ["" if _open(word, own) else word for word in own]
            found = limb(_weights(own, plain, parts, side, said), parents, parts)
            mute = [s in (None, side) and quiet for s, quiet in zip(sides, silent, strict=True)]
            free = [part for part in parts if f"{side}_{part}" not in said]
            found |= between(found, mute, parents, parts, free)
            both |= {f"{side}_{part}": joint for part, joint in found.items()}
        limbs |= _or_placed(both, dict(placed), parts, said, list(zip(sides, words, strict=True)))
    taken = {*limbs.values(), *said.values()}
    kinds = [
        None if side or joint in taken else word
        for joint, (side, word) in enumerate(zip(sides, words, strict=True))
    ]
    found = limbs | trunk(limbs, kinds, parents, said, dict(placed))
    return tuple(sorted(found.items(), key=lambda item: item[1]))


def _open(word: str, own: Sequence[str]) -> bool:
    """Whether more joints of a side have a word than it has meanings, as arm_L_01 to arm_L_04."""
    return own.count(word) > len(LIMB_OF.get(word, ())) > 1


def _or_placed(
    named: dict[str, int],
    placed: Mapping[str, int],
    parts: Sequence[str],
    said: Mapping[str, int | None],
    words: Sequence[tuple[str | None, str]],
) -> dict[str, int]:
    """Both sides of a limb as names have it; or by its place, where names lack a part, what they have
    is not enough or elsewhere, and neither what was said nor a clear word speaks against it."""
    every = {f"{side}_{part}" for side in SIDES for part in parts}
    role_of = {joint: role for role, joint in placed.items() if role in every}
    needs = any(role in every and role not in named for role in _OF_LIMBS)
    # or names fit, but a joint too high or too low: what hangs on an unknown ankle is called foot
    shifts = not every <= {*named} and any(
        role in named and named[role] != joint for joint, role in role_of.items()
    )
    agree = all(placed.get(role) == joint for role, joint in said.items()
                if role in every and joint is not None)  # fmt: skip
    if not role_of or not agree or not (needs or shifts):
        return named
    for joint, (side, word) in enumerate(words):
        says = {f"{side}_{part}": weight for part, weight in LIMB_OF.get(word, {}).items()}
        first = words.index((side, word)) == joint
        if not first or (len(says) > 1 and words.count((side, word)) > 1):
            continue  # arm_L_02 after arm_L_01; of toe_L and toe_L_end the first one counts
        clear = any(role in every and weight >= CLEAR for role, weight in says.items())
        if (clear or (says and joint in role_of)) and role_of.get(joint) not in says:
            return named
    return {role: joint for joint, role in role_of.items() if said.get(role, joint) is not None}


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
