"""What a joint's name says: which side it is on, and which word for a part of a body it has.

`roles` says in words how names are read, and lists those that are known.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections import Counter
from functools import lru_cache
from os.path import commonprefix

SIDES = ("left", "right")
TRUNK = ("hips", "spine", "chest", "neck", "head")
ARM = ("shoulder", "upper_arm", "lower_arm", "hand")
LEG = ("upper_leg", "lower_leg", "foot", "toes")

# What words say of a joint that has a side, and how strongly. A limb is read so that the sum of
# what its joints say is largest; words that leave a choice must be weaker than those that do not.
CLEAR = 35
NEARLY_ALL = 0.6  # share of the joints, of a rig's word such as a prefix
_GLUED = 4  # letters at an end of nearly all names, which a helper's need not have
_MANY = 10  # joints that share the letters in front of them by no chance
_LONGEST = 30  # letters of what may be glued to a side's
_PAIRED = {
    "thigh upleg upperleg legupper uleg femur": {"upper_leg": 40},
    "hip hips": {"upper_leg": 20},
    "shin calf shank knee tibia lowerleg lowleg loleg leglower": {"lower_leg": 40},
    "leg": {"upper_leg": 30, "lower_leg": 31},
    "ankle talocrural": {"foot": 40},
    "foot": {"foot": 35, "toes": 20},
    "toe toes toebase ball forefoot footindex": {"toes": 40},
    "bigtoe": {"toes": 38},
    "collar collarbone clavicle clav scapula": {"shoulder": 40},
    "shoulder shldr": {"shoulder": 30, "upper_arm": 31},
    "upperarm uparm uarm armupper humerus bicep biceps": {"upper_arm": 40},
    "arm": {"upper_arm": 35, "lower_arm": 25},
    "forearm farm lowerarm lowarm loarm armlower elbow radius ulna": {"lower_arm": 40},
    "hand wrist": {"hand": 40},
}
_CENTRAL = {
    "hips": "hips hip pelvis midhip hipcenter spinebase root",
    "spine": "spine abdomen ab waist lowerback upperback back tospine torso stomach belly lumbar "
    "spinemid spinenavel",
    "chest": "chest thorax upperchest ribs ribcage sternum spinechest spineshoulder",
    "neck": "neck necktwist lowerneck upperneck necklower neckupper cervical",
    "head": "head skull",
}
LIMB_OF = {word: says for words, says in _PAIRED.items() for word in words.split()}
TRUNK_OF = {word: role for role, words in _CENTRAL.items() for word in words.split()}
_OF_SIDES = (
    "left lft lt l links gauche izquierda izquierdo sinistra sinistro",
    "right rgt rt r rechts droite derecha derecho destra destro",
)
_SIDE_OF = {
    word: side for side, words in zip(SIDES, _OF_SIDES, strict=True) for word in words.split()
}
# MikuMikuDance's, longer words before those that they hold
_JAPANESE = dict(
    pair.split("=")
    for pair in "手首=wrist 足首=ankle つま先=toe 下半身=hips 上半身=spine 左=left 右=right 首=neck 頭=head "
    "肩=shoulder 腕=arm ひじ=elbow 足=leg ひざ=knee 捩=twist".split()
)
_SILENT = frozenset(
    "joint jnt jt bone bn bind skin def org bip biped bend stretch center centre mid b c j m x".split()
)
# Glued to names, backwards: of "leftjnt" and "rightjnt" the t is not the rig's, and of "spine2jnt"
# the digit has parted the end already.
_SILENT_ENDS = frozenset(word[::-1] for word in _SILENT if len(word) > 2)
# Words of a body that have a side and no role, and what may stand before and after them.
_OTHERS = "thumb index middle ring pinky finger fingers eye ear brow breast heel buttock palm"
_BESIDE = "up upper lo low lower fore twist roll end tip base joint ik"
_BODY = "|".join(sorted([*LIMB_OF, *_OTHERS.split()], key=len, reverse=True))
_BESIDES = "|".join(_BESIDE.split())
_SIDED = re.compile(rf"(?:{_BESIDES})*(?:{_BODY})(?:{_BESIDES}|{_BODY})*")
_WHOLE = frozenset([*LIMB_OF, *TRUNK_OF, "rear"])  # of which no first letter is a side
_KEPT = frozenset([*_WHOLE, *_SIDE_OF, *_OTHERS.split(), *_BESIDE.split()]) - {"base"}


@lru_cache(4096)
def _tokens(name: str) -> tuple[str, ...]:
    """("left", "up", "leg", "1") of "rig:LeftUpLeg.001" and the like, lower case."""
    name = unicodedata.normalize("NFKC", name)
    for word, english in _JAPANESE.items():
        name = name.replace(word, f" {english} ")
    marks = unicodedata.normalize("NFD", name)  # of Rücken no "r" is left alone
    name = "".join(letter for letter in marks if not unicodedata.combining(letter))
    name = unicodedata.normalize("NFC", name)
    name = re.sub(r"\[[A-Za-z ]*\]", " ", name)  # Skyrim's "NPC L Thigh [LThg]"
    name = re.sub(r"FBXASC\d{3}", " ", name)  # how FBX writes blanks, dots and the like
    name = re.sub(r"(?i)(?<![a-z])lf(?![a-z])", "left", name)  # but LFArm is a left forearm
    parts = [part for part in re.split(r"[:|]", name) if re.search(r"[^\W\d_]", part)]
    found = re.findall(
        r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_A-Za-z]+", parts[-1] if parts else ""
    )
    return tuple(token.lower() for token in found)


@lru_cache(256)  # the clips of a data set have few skeletons
def readings(names: tuple[str, ...]) -> tuple[tuple[str | None, str, tuple[str, ...]], ...]:
    """Side and word of each name, ("left", "upleg"), and what was left out of it."""
    counts = Counter(token for name in names for token in set(_tokens(name)))
    enough = max(3, NEARLY_ALL * len(names))
    common = {token for token, n in counts.items() if n >= enough and token not in _KEPT}
    quiet = common | _SILENT
    letters, left_out = [], []
    for name in names:
        words = [token for token in _tokens(name) if not token.isdigit()]
        if all(word in quiet or word in _SIDE_OF for word in words):
            beside = set()  # a middle finger is rMid
        else:
            beside = quiet
        letters.append([word for word in words if word not in beside])
        left_out.append(tuple(t for t in _tokens(name) if t.isdigit() or t in beside))
    sides = map(_side, _unglued(letters))
    return tuple((*read, rest) for read, rest in zip(sides, left_out, strict=True))


def _unglued(letters: list[list[str]]) -> list[list[str]]:
    """Names without the letters that nearly all begin or end with, as in "mixamorighips"."""
    whole = ["".join(words) for words in letters]
    start, end = _shared(whole), _shared([word[::-1] for word in whole], _SILENT_ENDS)[::-1]
    of_a_body = any(part in _WHOLE or _side([part])[0] for part in (start, end))
    if len(whole) < _MANY or of_a_body:
        return letters
    cut = []
    for words, word in zip(letters, whole, strict=True):
        first, last = (part if fits else "" for part, fits in
                       ((start, word.startswith(start)), (end, word.endswith(end))))  # fmt: skip
        if len(first + last) < len(word):
            words = [words[0].removeprefix(first), *words[1:]]
            words[-1] = words[-1].removesuffix(last)
        cut.append(words)
    return cut


def _shared(words: list[str], known: frozenset[str] = frozenset()) -> str:
    """What all words begin with, or nearly all: a word that is known, or else `_GLUED` letters at least."""
    ordered, most = sorted(words), math.ceil(NEARLY_ALL * len(words))
    windows = zip(ordered, ordered[most - 1 :], strict=False)
    often = max((commonprefix(pair) for pair in windows), key=len, default="")
    for end in range(len(often), 0, -1):
        if often[:end] in known:
            return often[:end]
    return often if len(often) >= _GLUED else commonprefix(ordered)


def _side(letters: list[str]) -> tuple[str | None, str]:
    """A side among the words of a name, and the words without it in one."""
    whole = "".join(letters)
    places = [i for i, word in enumerate(letters) if word in SIDES]
    places = places or [i for i, word in enumerate(letters) if word in _SIDE_OF]
    if len({_SIDE_OF[letters[i]] for i in places}) == 1 and len(places) < len(letters):
        at = places[0]
        return _SIDE_OF[letters[at]], "".join(letters[:at] + letters[at + 1 :])
    if places or whole in _WHOLE:  # ROOT is no right "oot"
        return None, whole
    for word, side in _SIDE_OF.items():
        for rest in (whole.removeprefix(word), whole.removesuffix(word)):
            known = len(rest) <= _LONGEST and _SIDED.fullmatch(rest)
            if rest and rest != whole and (word in SIDES or known):
                return side, rest
    return None, whole
