"""A recording of any rig, at any rate, cleaned: `clean_recording`.

The network knows one body at one rate. A smooth line through the recording, on its own rig, is brought
there, as no limb of it is bent the wrong way; what was seen is then put beside that line, each joint
turned off it as on the rig. This is cleaned, and what the network corrects of the line is brought back
to the line on the rig. Joints that the two bodies don't share, fingers and face among them, keep their
own rotations, and all bones their lengths. Where the recording has more frames than the network knows,
the line through all of them is what is corrected, at those frames that it knows.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np
import torch
from scipy.interpolate import CubicSpline
from scipy.ndimage import correlate1d
from torch import Tensor, nn

from ..errors import SkeletonError, SolverError
from ..feet.contacts import label
from ..filters import channel_mask, channels_of, joined
from ..ik.turns import shortest_turn
from ..io.bvh_units import ancestors, foot_to_head
from ..models import LstmGmm
from ..motion import Motion
from ..retargeting import retarget
from ..retargeting.flat_feet import Stance
from ..retargeting.rest_alignment import limb_length
from ..roles import SIDES
from ..skeleton import Skeleton
from ..weights import load
from .denoise import (
    MODEL,
    Denoised,
    Done,
    as_seen,
    believed_joints,
    calm,
    clean_jobs,
    needs_nothing,
    record_of,
)
from .denoise_checks import (
    called,
    check_clip,
    check_length,
    check_levels,
    check_model,
    check_settings,
    mask_of,
    other_unit,
)
from .denoise_known import least
from .denoise_seen import (
    FEWEST,
    YAW,
    NoiseLevels,
    Seen,
    cross_validated,
    held_frames,
    known_everywhere,
    look,
    motion_of,
    rows_of,
    smooth,
)
from .denoise_windows import Job, Settings

SMALLEST, LARGEST = 0.3, 5.0  # m from foot to head: infants and giants
# Shares of the accelerations that a body is free to have, by which the root's place and heading, and its
# pose, are freed of drift; of 6 each from 0.01 to 1 those with the least error on validation walks.
DRIFT_ROOT, DRIFT_POSE = 0.3, 0.01
_LIMBS = tuple(
    tuple(f"{side}_{part}" for part in parts)
    for side in SIDES
    for parts in (("upper_arm", "lower_arm", "hand"), ("upper_leg", "lower_leg", "foot"))
)

_BONES = {above: below for limb in _LIMBS for above, below in pairwise(limb)}


def clean_recording(
    motion: Motion,
    model: str | nn.Module | None = None,
    *,
    noise: NoiseLevels | tuple[float, float] | None = None,
    missing: Tensor | None = None,
    reference: Motion | Stance | None = None,
    contacts: bool = True,
    settings: Settings | None = None,
    progress: bool = False,
) -> Denoised:
    """A recording of any rig that stands on legs, at any rate; see `denoise` for arguments and record.

    noise is that of the recording's own frames, brought to the network's body. reference : as of
    `retarget`, tells how the rig stands. The motion that comes back has no contacts. Where the clip
    trembles, frames that repeat the one before them were not seen either; the record lists them as "held".

    Raises
    ------
    SolverError : as `denoise`, or a body of no person's size. RetargetError : a rig without legs.
    """
    model = model if isinstance(model, nn.Module) else load(MODEL if model is None else model)
    how = settings or Settings()
    how = how if contacts else replace(how, contact=0.0)
    check_model(model)
    check_settings(how)
    encoding, begin = model.encoding, time.process_time()
    if not isinstance(motion, Motion):
        raise SolverError(f"clean_recording takes a Motion, not {type(motion).__name__}.")
    check_length(motion)
    size = foot_to_head(motion.skeleton)
    if size is not None and not SMALLEST < size < LARGEST:
        raise SolverError(
            f"{called(motion)} is of a body of {size:.3g} m from foot to head. "
            + other_unit(too_large=size >= LARGEST)
        )
    there = mask_of(motion, missing)
    held = _lost(motion, there)
    there = there & ~held[:, None]
    known = known_everywhere(motion, there)
    numbers, mean = channels_of(known)
    levels = None if noise is None else check_levels(noise)
    seen, levels = look(torch.from_numpy(numbers), there, levels)
    own = Job(seen, levels, seen.rows, cross_validated(seen, levels, motion.fps))
    line = _own_where_not_shared(
        known, joined(motion, own.line.numpy(), mean), believed_joints(seen), encoding.skeleton
    )
    body, on_body = _brought_over(known, line, encoding.skeleton, reference, how.slow)
    check_clip(encoding, body.resample(encoding.fps))
    if needs_nothing(own):
        nan = float("nan")
        found, done = motion, Done(seen.rows, "unchanged", nan, nan, None)
    else:
        joints = ~_theirs(~there, motion.skeleton, encoding.skeleton)
        rows = rows_of(encoding, replace(on_body, fps=encoding.fps))
        scale = limb_length(body.skeleton, "leg") / limb_length(motion.skeleton, "leg")
        theirs = NoiseLevels(scale * levels.root_m, levels.angle_rad)
        its = Seen(rows, channel_mask(joints), seen.outliers)
        same = motion.skeleton.matches(encoding.skeleton)
        done = _cleaned(model, its, theirs, motion.fps, how, not same, progress)
        found = line
        if done.way == "map":
            after = replace(motion_of(encoding, done.rows, body), fps=body.fps)
            found = after if same else brought_back(line, body, after)
        if calm(levels):
            found = as_seen(motion, found, believed_joints(seen))
        found = replace(found, contacts=None)
    seconds = time.process_time() - begin
    record = record_of(motion, found, there, own, done, noise is None, seconds)
    return Denoised(found, {**record, "held": held.nonzero()[:, 0].tolist()})


def _lost(motion: Motion, there: Tensor) -> Tensor:
    """Frames (frames,) in which a program held what cameras lost; none in a clip that is calm elsewhere.

    there : bool (frames, joints), what was seen.
    """
    held = held_frames(motion) & there.all(1)
    none = torch.zeros_like(held)
    left = there & ~held[:, None]
    if not held.any() or int(left[:, 0].sum()) < FEWEST:
        return none
    numbers, _ = channels_of(known_everywhere(motion, left))
    _, levels = look(torch.from_numpy(numbers), left)
    return none if calm(levels) else held


def _brought_over(
    known: Motion, line: Motion, body: Skeleton, reference: Motion | Stance | None, slow: float
) -> tuple[Motion, Motion]:
    """A smooth line on the network's body, and what was seen beside it, as far off it as on the rig.

    slow : m/s of a foot that rests in the line.
    """
    if known.skeleton.matches(body):
        return line, known
    with suppress(SkeletonError):  # a rig that lacks a foot: retarget tells of it
        # feet stand flat on the floor there, or the network would not know it for a walk
        line = replace(line, contacts=label(line, "speed-height", speed=slow))
    over = replace(retarget(line, body, reference=reference), contacts=None)
    off = known.orientations() @ line.orientations().mT
    roles, own = body.roles, known.skeleton.roles
    shared = {joint: own[role] for role, joint in roles.items() if role in own}
    world, local, turned = over.orientations(), over.rotations.clone(), []
    for joint, parent in enumerate(body.parents):
        above = turned[parent] if parent >= 0 else torch.eye(3).expand(len(known), 3, 3)
        if joint in shared:
            local[:, joint] = above.mT @ off[:, shared[joint]] @ world[:, joint]
        turned.append(above @ local[:, joint])
    scale = limb_length(body, "leg") / limb_length(known.skeleton, "leg")
    moved = (known.positions() - line.positions())[:, own["hips"]]
    place = over.root_positions + scale * moved
    return over, replace(over, root_positions=place, rotations=local)


def _own_where_not_shared(known: Motion, line: Motion, believed: Tensor, body: Skeleton) -> Motion:
    """The line, but joints that the network's body has no like of as they were seen and believed."""
    roles = known.skeleton.roles
    shared = {joint: 0 for role, joint in roles.items() if role in body.roles}
    moved = {0, *shared, *_between_joints(known.skeleton, shared)}
    others = torch.tensor([joint not in moved for joint in range(known.skeleton.joints)])
    keep = (believed & others)[..., None, None]
    return replace(line, rotations=torch.where(keep, known.rotations, line.rotations))


def _cleaned(
    model: LstmGmm, seen: Seen, levels: NoiseLevels, fps: float, how: Settings, other: bool,
    progress: bool,
) -> Done:  # fmt: skip
    """What came of a recording on the network's body; rows at its own rate. other : whether of another rig."""
    rate = model.encoding.fps
    line = smooth(seen, levels, fps)
    if abs(fps - rate) <= 1e-4 * rate:
        return _solved(model, Job(seen, levels, line, line), how, other, progress)
    own = torch.arange(len(line)).double() / fps
    known = torch.arange(int(own[-1] * rate + 1e-6) + 1).double() / rate
    few, fewer = _at(own, known, seen, levels, fps / rate)
    start = _between(own, line, known)
    done = _solved(model, Job(few, fewer, start, start), how, other, progress)
    change = CubicSpline(known.numpy(), (done.rows - start).numpy(), bc_type="natural")
    change = torch.from_numpy(change(np.clip(own.numpy(), 0, float(known[-1]))))
    return done._replace(rows=line + change)


def _solved(model: LstmGmm, job: Job, how: Settings, other: bool, progress: bool) -> Done:
    """What the network makes of a clip, brought back to what was seen where it drifts off.

    It seeks steps, and an error of one goes on in all frames after it: what a few rounds of descent leave
    of place and heading is slow, and more than the noise of means of many frames. So are habits, such as
    how far arms hang from the trunk. A line that is stiffer than any motion, through what was seen less
    what was found, is neither motion nor noise.
    """
    if other and how.least is None:
        how = replace(how, least=least(job.noise, other_rig=True))
    (done,) = clean_jobs(model, [job], how, progress=progress, always=True)
    left = replace(job.seen, rows=job.seen.rows - done.rows)
    drift = smooth(left, job.noise, model.encoding.fps, (DRIFT_ROOT, DRIFT_POSE))
    drift[:, YAW] = smooth(left, job.noise, model.encoding.fps, (DRIFT_ROOT, DRIFT_ROOT))[:, YAW]
    return done._replace(rows=done.rows + drift)


def _at(
    own: Tensor, known: Tensor, seen: Seen, levels: NoiseLevels, times: float
) -> tuple[Seen, NoiseLevels]:
    """What was seen at the network's moments, each the mean of the frames about it that belong to it."""
    shares = _shares(times)
    mean = lambda x: correlate1d(x, shares, axis=0, mode="nearest")
    believed = seen.believed.double().numpy()
    weight = mean(believed)
    rows = mean(believed * seen.rows.numpy()) / np.maximum(weight, 1e-9)
    rows = np.where(weight > 1e-6, rows, seen.rows.numpy())
    nearest = (known * (1 / (own[1] - own[0]))).round().long().clamp(max=len(own) - 1)
    mask = torch.from_numpy(weight > shares.min() / 2)[nearest]
    found = Seen(
        _between(own, torch.from_numpy(rows), known),
        mask,
        torch.zeros(len(known), dtype=torch.bool),
    )
    left = noise_left(times)
    return found, NoiseLevels(*(level * left for level in levels))


def _shares(times: float) -> np.ndarray:
    """Of frames about one, for so many of them to each of the network's; as many before it as after."""
    half = max(times, 1.0) / 2
    reach = np.arange(-round(half), round(half) + 1)
    inside = np.minimum(reach + 0.5, half) - np.maximum(reach - 0.5, -half)
    shares = inside.clip(0)
    return shares / shares.sum()


def noise_left(times: float) -> float:
    """What is left of the deviation of white noise in means of so many frames."""
    return float(np.square(_shares(times)).sum() ** 0.5)


def _between(own: Tensor, rows: Tensor, known: Tensor) -> Tensor:
    """Rows (frames, channels) of moments `own` at other moments."""
    where = known / (own[1] - own[0])
    before = where.floor().long().clamp(max=len(own) - 2)
    return torch.lerp(rows[before], rows[before + 1], (where - before)[:, None])


def _theirs(unseen: Tensor, own: Skeleton, body: Skeleton) -> Tensor:
    """Which joints (frames, joints) of the network's body can't be told, as joints of a rig are missing.

    A limb is brought over by where its end is: if one of its joints is missing, all are.
    """
    hidden = torch.zeros(len(unseen), body.joints, dtype=torch.bool)
    for role, joint in body.roles.items():
        if role in own.roles:
            hidden[:, joint] = unseen[:, own.roles[role]]
    hidden[:, 0] |= unseen[:, 0]
    for limb in _LIMBS:
        joints = [body.roles[role] for role in limb]
        hidden[:, joints] = hidden[:, joints].any(1, keepdim=True)
    return hidden


def brought_back(line: Motion, before: Motion, after: Motion) -> Motion:
    """A motion of any rig with what was corrected on the network's body.

    line : on the rig; before : the same on the network's body; after : cleaned there. How a limb turns
    about itself stays as in the line: it can't be told of a straight limb on the other body.
    """
    own, body = line.skeleton, before.skeleton
    turn = after.orientations() @ before.orientations().mT
    shared = {own.roles[role]: joint for role, joint in body.roles.items() if role in own.roles}
    own_role = {joint: role for role, joint in own.roles.items()}
    world, local, turned = line.orientations(), line.rotations.clone(), []
    for joint, parent in enumerate(own.parents):
        above = turned[parent] if parent >= 0 else torch.eye(3).expand(len(line), 3, 3)
        if joint in shared:
            found = turn[:, shared[joint]] @ world[:, joint]
            if below := _BONES.get(own_role[joint]):
                bone = own.below(own_role[joint], below)[:, None]
                still = above @ local[:, joint]
                found = shortest_turn((still @ bone)[..., 0], (found @ bone)[..., 0]) @ still
            local[:, joint] = above.mT @ found
        turned.append(above @ local[:, joint])
    hips, their = own.roles["hips"], body.roles["hips"]
    scale = limb_length(body, "leg") / limb_length(own, "leg")
    moved = (after.positions() - before.positions())[:, their] / scale
    found = replace(line, rotations=local, contacts=None)
    place = line.positions()[:, hips] + moved
    return replace(found, root_positions=found.root_positions + place - found.positions()[:, hips])


def _between_joints(skeleton: Skeleton, shared: dict[int, int]) -> set[int]:
    """Joints of a limb or a spine that the other body lacks: their noise moves what it has."""
    found: set[int] = set()
    for joint in shared:
        way = ancestors(skeleton, joint)
        if skeleton.roles["hips"] in way:
            found |= {*way[: way.index(skeleton.roles["hips"])]}
    return found - {*shared}
