"""A recording of any rig, at any rate, cleaned: `clean_recording`.

The network knows one body at one rate. So a recording is brought there, cleaned, and what was corrected
is brought back: each joint that the two bodies share gets the orientation of its clean like, and keeps,
smoothly, what distinguishes it from that; the hips likewise. All other joints, fingers and face among
them, keep their own rotations, and all bones their lengths. Where the recording has more frames than the
network knows, the smooth line through all of them is what is corrected, at those frames that it knows.
"""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import roma
import torch
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d
from torch import Tensor, nn

from ..errors import SolverError
from ..ik.turns import shortest_turn
from ..io.bvh_units import ancestors, foot_to_head
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
    clean_jobs,
    mended,
    needs_nothing,
    record_of,
    see,
)
from .denoise_checks import FEWEST, check_clip, check_model, check_settings, mask_of
from .denoise_seen import (
    FPS,
    LEAST_ANGLE,
    LEAST_ROOT,
    PUSH_ANGLE,
    PUSH_ROOT,
    NoiseLevels,
    Seen,
    cross_validated,
    motion_of,
    smooth,
    whittaker,
)
from .denoise_windows import Job, Settings

SMALLEST, LARGEST = 0.3, 5.0  # m from foot to head: infants and giants
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
    `retarget`, tells how the rig stands. The motion that comes back has no contacts.

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
    if not isinstance(motion, Motion) or len(motion) < FEWEST:
        raise SolverError(
            f"{motion!r} is no motion of {FEWEST} frames or more; fewer do not tell noise from motion."
        )
    size = foot_to_head(motion.skeleton)
    if size is not None and not SMALLEST < size < LARGEST:
        raise SolverError(
            f"{motion!r} is of a body of {size:.3g} m from foot to head. Are lengths in metres? "
            "read_bvh(path, units='mm') reads millimetres."
        )
    unseen = ~mask_of(motion, missing)
    if motion.skeleton.matches(encoding.skeleton):
        body, hidden = motion, unseen
    else:
        # feet of noisy motion rest nowhere: holding them would bend what was seen
        loose = replace(motion, contacts=torch.zeros(len(motion), 4, dtype=torch.bool))
        body = retarget(loose, encoding.skeleton, reference=reference)
        hidden = _theirs(unseen, motion.skeleton, encoding.skeleton)
    check_clip(encoding, body.resample(encoding.fps))
    job, done, rows = _cleaned(model, body, noise, hidden, how, progress)
    if done.way == "unchanged":
        found = motion
    else:
        after = replace(motion_of(encoding, rows, body), fps=body.fps)
        found = after if body is motion else brought_back(motion, body, after, job.noise, unseen)
        found = mended(motion, found, job)
    seconds = time.process_time() - begin
    return Denoised(found, record_of(motion, found, ~unseen, job, done, noise is None, seconds))


def _cleaned(
    model: nn.Module,
    body: Motion,
    noise: tuple | None,
    hidden: Tensor,
    how: Settings,
    progress: bool,
) -> tuple[Job, Done, Tensor]:
    """The job of a motion on the model's body, what came of it, and its rows at the motion's rate."""
    encoding = model.encoding
    seen, levels = see(encoding, replace(body, fps=encoding.fps), noise, hidden)
    line, calm = smooth(seen, levels, body.fps), cross_validated(seen, levels, body.fps)
    if abs(body.fps - encoding.fps) <= 1e-4 * encoding.fps:
        job = Job(seen, levels, line, calm)
        (done,) = clean_jobs(model, [job], how, progress=progress)
        return job, done, done.rows
    own = torch.arange(len(line)).double() / body.fps
    known = torch.arange(int(own[-1] * encoding.fps + 1e-6) + 1).double() / encoding.fps
    few, fewer = _at(own, known, seen, levels, body.fps / encoding.fps)
    at = lambda rows: _between(own, rows, known)
    job = Job(few, fewer, at(line), at(calm))
    whole = Job(seen, levels, line, calm)
    if needs_nothing(whole):
        nan = float("nan")
        return whole, Done(seen.rows, "unchanged", nan, nan, None), seen.rows
    (done,) = clean_jobs(model, [job], how, progress=progress, always=True)
    if done.way == "filter":
        return whole, done, calm
    change = CubicSpline(known.numpy(), (done.rows - at(line)).numpy(), bc_type="natural")
    change = torch.from_numpy(change(np.clip(own.numpy(), 0, float(known[-1]))))
    return whole, done, line + change


def _at(
    own: Tensor, known: Tensor, seen: Seen, levels: NoiseLevels, times: float
) -> tuple[Seen, NoiseLevels]:
    """What was seen at the network's moments, each the mean of `times` frames around it, if so many are."""
    width = max(1, round(times))
    believed = seen.believed.double().numpy()
    mean = lambda x: uniform_filter1d(x, width, axis=0, mode="nearest")
    weight = mean(believed)
    rows = mean(believed * seen.rows.numpy()) / np.maximum(weight, 1e-9)
    rows = np.where(weight > 1e-6, rows, seen.rows.numpy())
    nearest = (known * (1 / (own[1] - own[0]))).round().long().clamp(max=len(own) - 1)
    mask = torch.from_numpy(weight > 0.5 / width)[nearest]
    found = Seen(
        _between(own, torch.from_numpy(rows), known),
        mask,
        torch.zeros(len(known), dtype=torch.bool),
    )
    return found, NoiseLevels(*(level / width**0.5 for level in levels))


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


def brought_back(
    motion: Motion, before: Motion, after: Motion, noise: NoiseLevels, unseen: Tensor
) -> Motion:
    """A motion of any rig with what was corrected on the network's body.

    Parameters
    ----------
    motion : the recording; before : the same on the network's body; after : cleaned there.
    noise : on that body. unseen : (frames, joints) of the recording, what is not to be looked at.
    """
    own, body = motion.skeleton, before.skeleton
    world, old, new = motion.orientations(), before.orientations(), after.orientations()
    shared = {own.roles[role]: joint for role, joint in body.roles.items() if role in own.roles}
    own_role = {joint: role for role, joint in own.roles.items()}
    between = _between_joints(own, shared)
    rate = (FPS / motion.fps) ** 1.5
    stiff = (max(noise.angle_rad, LEAST_ANGLE) / (PUSH_ANGLE * rate)) ** 2
    local, turned = motion.rotations.clone(), []
    for joint, parent in enumerate(own.parents):
        above = turned[parent] if parent >= 0 else torch.eye(3).expand(len(motion), 3, 3)
        if joint in shared:
            like = shared[joint]
            apart = _smooth_turns(old[:, like].mT @ world[:, joint], ~unseen[:, joint], stiff)
            found = new[:, like] @ apart
            if below := _BONES.get(own_role[joint]):
                # how a limb turns about itself is lost on the other body where it is straight
                bone = own.below(own_role[joint], below)[:, None]
                still = above @ _smooth_turns(local[:, joint], ~unseen[:, joint], stiff)
                found = shortest_turn((still @ bone)[..., 0], (found @ bone)[..., 0]) @ still
            local[:, joint] = above.mT @ found
        elif joint in between:
            local[:, joint] = _smooth_turns(local[:, joint], ~unseen[:, joint], stiff)
        turned.append(above @ local[:, joint])
    hips, their = own.roles["hips"], body.roles["hips"]
    scale = limb_length(body, "leg") / limb_length(own, "leg")
    apart = scale * motion.positions()[:, hips] - before.positions()[:, their]
    stiff = torch.tensor((max(noise.root_m, LEAST_ROOT) / (PUSH_ROOT * rate)) ** 2).expand(3)
    apart = whittaker(apart, (~unseen[:, [hips]]).expand(-1, 3), stiff).float()
    place = (after.positions()[:, their] + apart) / scale
    found = replace(motion, rotations=local, contacts=None)
    moved = place - found.positions()[:, hips]
    return replace(found, root_positions=found.root_positions + moved)


def _between_joints(skeleton: Skeleton, shared: dict[int, int]) -> set[int]:
    """Joints of a limb or a spine that the other body lacks: their noise moves what it has."""
    found: set[int] = set()
    for joint in shared:
        way = ancestors(skeleton, joint)
        if skeleton.roles["hips"] in way:
            found |= {*way[: way.index(skeleton.roles["hips"])]}
    return found - {*shared}


def _smooth_turns(turns: Tensor, seen: Tensor, stiffness: float) -> Tensor:
    """Turns (frames, 3, 3) that hardly change, smoothed about their mean."""
    mean = roma.special_procrustes(turns[seen].mean(0) if seen.any() else turns.mean(0))
    off = roma.rotmat_to_rotvec(mean.mT @ turns)
    smooth_off = whittaker(off, seen[:, None].expand(-1, 3), torch.tensor(stiffness).expand(3))
    return mean @ roma.rotvec_to_rotmat(smooth_off).float()
