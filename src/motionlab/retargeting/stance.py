"""How all clips of one rig stand, for rigs whose rest pose is no standing body.

What joint axes such a rig has must be learned. Learned from each clip by itself they differ from
clip to clip; here they are learned once for all clips of a rig, as a `reference` for `retarget`:

* if its limbs lie along axes of their joints, as most programs draw them, the axes of a T-pose are
  quarter turns away, and all motion together tells which;
* else from moments in which a person stands (`find_stance`);
* else, which is less sure, from all motion together.

How its flat feet look is learned so, too, from all clips of one body (`flat_feet`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations, product

import roma
import torch
from torch import Tensor

from ..errors import RetargetError
from ..motion import Motion, concatenate
from ..roles import SIDES
from ..skeleton import Skeleton
from .flat_feet import Stance, with_flat_feet
from .rest_alignment import SHORT, alignment, facing, rising, upright
from .retarget import NEEDED

SECONDS = 0.5  # that a person must stand
MOST = 8  # moments: one alone has a head that looks aside, or an arm that is held a little twisted
_APART = 10.0  # seconds of a clip of which only one moment is taken
# Degrees that a standing body's parts may be off; of the stretches within, the one least off is it.
LIMITS = {
    "trunk": 15.0,  # from upright
    "turn": 20.0,  # of the shoulders against the hips
    "leg": 15.0,  # from upper leg to foot, from straight down
    "knee": 20.0,  # from straight
    "arm": 100.0,  # from upper arm to hand, from straight aside: hanging ones are about 85 off
    "arm ahead": 30.0,  # the same out of the plane of the body
    "elbow": 45.0,  # from straight
}
_SAID = 2.0  # times these limits, for what somebody says stands: knees a little bent, say
_STILL = 0.25  # metres a second, of the fastest joint
_RATE = 15.0  # frames looked at in a second
_SAMPLE = 3000  # frames of all clips together, to learn axes from
_ALONG = 3.0  # degrees between a bone and the axis along which it is drawn
_NEAR = 30.0  # degrees from a quarter turn, of what is learned of one
_LIMBS = (("upper_arm", "lower_arm", "hand"), ("upper_leg", "lower_leg", "foot"))
_PARALLEL, _ALIKE = 10.0, 1.0  # degrees between the bones of two bodies of one rig; of one body


@dataclass(frozen=True)
class Stances:
    """references : for each clip, for `retarget`. said : how joint axes were found, in words."""

    references: list[Stance]
    said: list[str]


def stances(
    motions: Sequence[Motion], skeleton: Skeleton, reference: Motion | None = None
) -> Stances:
    """The reference by which each clip is to be retargeted: one way to stand for all clips of a rig,
    and one pair of flat feet for all clips of a body.

    Parameters
    ----------
    motions : of any rigs. Those with the same joints and bones along the same axes are one rig. One
        whose rest pose stands needs no other motion that does.
    skeleton : what they will be retargeted to.
    reference : a motion of one of the rigs, in which a person stands; for its clips that is it.

    Raises
    ------
    RetargetError : nobody stands in `reference`, or it is of another rig than all clips.
    """
    given = None if reference is None else _checked(reference, motions)
    found = [Stance()] * len(motions)
    said = []
    for group in _alike(motions, range(len(motions)), _PARALLEL):
        whole = [motions[i] for i in group if _is_whole(motions[i].skeleton)]
        if not whole or not _is_whole(skeleton):
            continue  # `retarget` says why it can't
        its = whole[0].skeleton
        if given is not None and _same_rig(its, given.skeleton):
            stance = given
        elif upright(its):
            stance = None
        else:
            stance, how = _of_rig(_teachers(whole), skeleton)
            what = "1 clip" if len(group) == 1 else f"{len(group)} clips of one rig"
            said.append(
                f"the rest pose of {what} is no standing body; how its joint axes lie is learned "
                f"once, {how}"
            )
        for body in _alike(motions, group, _ALIKE):
            teachers = [motions[i] for i in body if _is_whole(motions[i].skeleton)]
            its = with_flat_feet(stance, _teachers(teachers)) if teachers else Stance(stance)
            for i in body:
                found[i] = its
    return Stances(found, said)


def find_stance(motions: Sequence[Motion], slack: float = 1.0) -> Motion | None:
    """The moments in clips of one rig in which a person stands most plainly; None if nobody does.

    For half a second upright, with straight legs below, arms hanging or spread, all joints nearly
    still (`LIMITS`). Places alone are asked, so it does not matter how joint axes lie. A clip shorter
    than half a second is looked at as a whole: one frame of a T-pose will do. slack : times `LIMITS`.

    Returns
    -------
    Motion : up to `MOST` such moments one after the other, as their mean pose is asked; its name has
        clips and seconds.
    """
    moments = []
    for motion in motions:
        length = max(1, round(_APART * motion.fps))
        for start in range(0, len(motion), length):
            off, first, last = _stillest(motion[start : start + length], slack)
            if off < math.inf:
                moments.append((off, motion, start + first, start + last))
    moments.sort(key=lambda moment: moment[0])
    moments = [moment for moment in moments[:MOST] if moment[0] <= 1.5 * moments[0][0] + 0.2]
    if not moments:
        return None
    its, fps = moments[0][1].skeleton, moments[0][1].fps
    parts = [
        replace(m[first:last], skeleton=its, fps=fps, contacts=None)
        for _, m, first, last in moments
    ]
    spoken = [
        f"{m.name}, {first / m.fps:.1f} to {last / m.fps:.1f} s" for _, m, first, last in moments
    ]
    return replace(concatenate(parts), name="; ".join(spoken))


def _teachers(motions: Sequence[Motion]) -> Sequence[Motion]:
    """The clips of a rig that tell its axes. One that lies throughout, as clips do whose up was
    mistaken, would spoil them for all others; only if all do they have to do."""
    seen = [motion[:: max(1, len(motion) // 50)] for motion in motions]
    share = [rising(some.positions(), some.skeleton).float().mean() for some in seen]
    upright_ones = [motion for motion, its in zip(motions, share, strict=True) if its > 0.5]
    return upright_ones or motions


def _of_rig(motions: Sequence[Motion], skeleton: Skeleton) -> tuple[Motion, str]:
    """How a rig stands, as its clips say, and in words how that was told."""
    its = motions[0].skeleton
    drawn = _is_drawn_along_axes(its)
    turns = _quarter_turns(_together(motions, skeleton), its, skeleton) if drawn else None
    if turns is not None:
        return _standing(its, turns), (
            "from all its motion together, as its bones lie along them; reference= "
            "names a standing clip."
        )
    stance = find_stance(motions)
    if stance is not None:
        return (
            stance,
            f"where a person stands: {stance.name}; reference= names others.",
        )
    return _standing(its, _together(motions, skeleton)), (
        "from all its motion together, which is less sure, as nobody stands still in it, upright, "
        "with straight legs and arms hanging or spread. If limbs come out turned, give a standing "
        "clip of the rig as reference=."
    )


def _together(motions: Sequence[Motion], skeleton: Skeleton) -> dict[str, Tensor]:
    """Axes as all clips of a rig together tell them by their motion."""
    whole = sum(map(len, motions))
    its, stride = motions[0].skeleton, max(1, -(-whole // _SAMPLE))
    fps = motions[0].fps / stride
    some = [replace(m[::stride], skeleton=its, fps=fps, contacts=None) for m in motions]
    return alignment(concatenate(some), skeleton, None)


def _standing(skeleton: Skeleton, axes: dict[str, Tensor]) -> Motion:
    """One frame of the skeleton in the rest pose of what it is to be retargeted to."""
    role_of = {joint: role for role, joint in skeleton.roles.items()}
    world: list[Tensor] = []
    local = []
    for joint, parent in enumerate(skeleton.parents):
        above = world[parent] if parent >= 0 else torch.eye(3)
        # R_target = R_source @ A, and R_target is the identity at rest
        role = role_of.get(joint)
        world.append(axes[role].mT if role in axes else above)
        local.append(above.mT @ world[joint])
    return Motion(
        skeleton, torch.zeros(1, 3), torch.stack(local)[None], 1.0, name="all clips together"
    )


def _stillest(motion: Motion, slack: float) -> tuple[float, int, int]:
    """The half second in which a person stands most plainly: how far off, and its frames."""
    stride = max(1, round(motion.fps / _RATE))
    seen = motion[::stride]
    frames = min(len(seen), max(1, round(SECONDS * seen.fps)))
    # of each half second the mean, infinite if in one of its frames nobody stands
    means = _off(seen, slack).unfold(0, frames, 1).mean(-1)
    start = int(means.argmin())
    return float(means[start]), start * stride, min((start + frames) * stride, len(motion))


def _is_whole(skeleton: Skeleton) -> bool:
    """Whether it has the joints and limbs without which `retarget` refuses it."""
    if not isinstance(skeleton, Skeleton) or any(role not in skeleton.roles for role in NEEDED):
        return False
    return all(bone is not None and bone.norm() > SHORT for bone in _limb_bones(skeleton))


def _off(motion: Motion, slack: float) -> Tensor:
    """How far (frames,) the body is from standing, 0 to some; infinite if it does not stand."""
    points, roles = motion.positions(), motion.skeleton.roles
    at = {role: points[:, roles[role]] for role in NEEDED}
    way = lambda start, end: torch.nn.functional.normalize(at[end] - at[start], dim=-1)
    middle = lambda part: (at[f"left_{part}"] + at[f"right_{part}"]) / 2
    up = torch.tensor([0.0, 1.0, 0.0])
    left, _, ahead = facing(points, motion.skeleton).unbind(-1)
    hips, shoulders = (way(f"right_{part}", f"left_{part}") for part in ("upper_leg", "upper_arm"))
    angles = {
        "trunk": [_angle(middle("upper_arm") - middle("upper_leg"), up)],
        "turn": [_angle(hips, shoulders)],
    }
    for side, aside in zip(SIDES, (left, -left), strict=True):
        leg = way(f"{side}_upper_leg", f"{side}_foot")
        arm = way(f"{side}_upper_arm", f"{side}_hand")
        for part, value in {
            "leg": _angle(leg, -up),
            "knee": _angle(*_bones(at, side, "upper_leg", "lower_leg", "foot")),
            "arm": _angle(arm, aside),
            "arm ahead": (90 - _angle(arm, ahead)).abs(),
            "elbow": _angle(*_bones(at, side, "upper_arm", "lower_arm", "hand")),
        }.items():
            angles.setdefault(part, []).append(value)
    shares = torch.stack(
        [a / (slack * LIMITS[part]) for part, each in angles.items() for a in each]
    )
    joints = torch.stack([at[role] for role in NEEDED], 1)
    speed = torch.zeros(len(motion))
    if len(motion) > 1:
        steps = (joints[1:] - joints[:-1]).norm(dim=-1).amax(-1) * motion.fps
        speed = torch.cat([steps, steps[-1:]])
    raised = torch.stack([way(f"{side}_upper_arm", f"{side}_hand")[:, 1] for side in SIDES]).amax(0)
    good = (shares <= 1).all(0) & (speed < _STILL) & (raised < 0.5)
    return (shares**2).sum(0).masked_fill(~good, math.inf)


def _bones(at: dict[str, Tensor], side: str, *parts: str) -> tuple[Tensor, Tensor]:
    first, middle, last = (at[f"{side}_{part}"] for part in parts)
    return middle - first, last - middle


def _angle(a: Tensor, b: Tensor) -> Tensor:
    """Degrees (frames,) between vectors (frames, 3)."""
    return torch.rad2deg(torch.arccos(torch.cosine_similarity(a, b, dim=-1).clamp(-1, 1)))


def _checked(reference: Motion, motions: Sequence[Motion]) -> Motion:
    """The part of a given reference in which a person stands."""
    label = f"The reference {reference.name}".rstrip()
    if not any(_same_rig(reference.skeleton, motion.skeleton) for motion in motions):
        raise RetargetError(
            f"{label} is of another rig than all {len(motions)} clips; give a clip of their rig, "
            "with the same joints."
        )
    missing = [role for role in NEEDED if role not in reference.skeleton.roles]
    stance = None if missing else find_stance([reference]) or find_stance([reference], _SAID)
    if stance is None and not missing:
        raise RetargetError(
            f"{label} can't tell how the rig stands: at no time does the body stand still in it, "
            "upright, with straight legs and arms hanging or spread; give one in which it does, "
            "one frame is enough."
        )
    return reference if stance is None else stance


def _alike(motions: Sequence[Motion], indices: Sequence[int], parallel: float) -> list[list[int]]:
    """Some of the motions, by their indices, those of one rig together, or of one body."""
    groups: list[list[int]] = []
    for i in indices:
        for group in groups:
            if _same_rig(motions[group[0]].skeleton, motions[i].skeleton, parallel):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def _same_rig(one: Skeleton, other: Skeleton, parallel: float = _PARALLEL) -> bool:
    """The same joints, drawn along the same axes; bones may be longer, as another actor's are.

    parallel : degrees between their bones.
    """
    if one is other:
        return True
    if (one.names, one.parents) != (other.names, other.parents):
        return False
    a, b = one.offsets[1:], other.offsets[1:]
    long = (a.norm(dim=-1) > 0.01) & (b.norm(dim=-1) > 0.01)
    return bool((_angle(a, b)[long] < parallel).all())


def _limb_bones(skeleton: Skeleton) -> list[Tensor | None]:
    """The long bones of all limbs, each in the frame of its joint."""
    return [
        skeleton.below(f"{side}_{part}", f"{side}_{child}")
        for side, limb in product(SIDES, _LIMBS)
        for part, child in pairwise(limb)
    ]


def _is_drawn_along_axes(skeleton: Skeleton) -> bool:
    """Whether the bones of all limbs lie along axes of their joints."""
    bones = torch.stack(_limb_bones(skeleton))
    along = bones.abs().amax(-1) / bones.norm(dim=-1)
    return bool((along > math.cos(math.radians(_ALONG))).all())


def _quarter_turns(
    axes: dict[str, Tensor], source: Skeleton, target: Skeleton
) -> dict[str, Tensor] | None:
    """Axes of a rig that is drawn along axes, of the limbs rounded to the quarter turns they are;
    None if they are not.

    Where a limb's bones lie along the same axis it is straight at rest, and its joints' axes are the
    same: those of the upper joint, as how far a forearm is turned says little about them. A hand has
    no bone of its own here and goes with the forearm.
    """
    turns, found = _axis_turns(), dict(axes)
    for side, limb in product(SIDES, _LIMBS):
        upper, lower, end = (f"{side}_{part}" for part in limb)
        bones = [
            (target.below(*pair), source.below(*pair)) for pair in ((upper, lower), (lower, end))
        ]
        straight = float(_angle(bones[0][1], bones[1][1])) < _ALONG
        for joint, (ours, theirs) in zip((upper, lower), bones, strict=True):
            along = turns[_angle(turns @ ours, theirs) < 2 * _ALONG]
            learned = found[upper] if joint == lower and straight else axes[joint]
            if not len(along):
                return None
            found[joint] = along[(along * learned).sum((1, 2)).argmax()]
        if torch.rad2deg(roma.rotmat_geodesic_distance(found[upper], axes[upper])) > _NEAR:
            return None
        if end.endswith("hand"):
            found[end] = found[lower]
    return found


def _axis_turns() -> Tensor:
    """The 24 rotations (24, 3, 3) that bring axes to axes."""
    turns = torch.stack([
        torch.eye(3)[list(order)] * torch.tensor(signs)[:, None]
        for order in permutations(range(3)) for signs in product((1.0, -1.0), repeat=3)
    ])  # fmt: skip
    return turns[torch.linalg.det(turns) > 0]
