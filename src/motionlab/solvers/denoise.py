"""Noise taken away (RNN-GAN, section 5.4): the likeliest motion, given what the cameras saw.

    clean = motionlab.solvers.denoise(noisy)
    clean.motion, clean.record["noise"]

Of all motions, which is both likely under the network and near to what was seen (eq. 25 to 27)? A filter
knows that bodies are slow to turn; the network knows how they walk. Where it does not know how they
move, the filter's answer is the better one, and is what comes back; see `denoise_known`.

A recording of any rig, at any rate: `denoise_rig.clean_recording`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor, nn
from tqdm import tqdm

from ..encodings import JointAngles
from ..feet.contacts import label
from ..models import LstmGmm
from ..motion import Motion
from ..weights import load
from .denoise_checks import (
    check_clip,
    check_levels,
    check_model,
    check_settings,
    mask_of,
    start_of,
    theirs,
)
from .denoise_known import judge
from .denoise_seen import (
    LEAST_ANGLE,
    LEAST_ROOT,
    NoiseLevels,
    Seen,
    cross_validated,
    look,
    motion_of,
    rows_of,
    smooth,
)
from .denoise_windows import Cleaned, Job, Settings, clean

MODEL = "lstm-gmm-contacts"


class Denoised(NamedTuple):
    """A clean motion, and how it was found; see `denoise`."""

    motion: Motion
    record: dict


def denoise(
    motions: Motion | Sequence[Motion],
    model: str | nn.Module | None = None,
    *,
    noise: NoiseLevels | tuple[float, float] | None = None,
    missing: Tensor | Sequence[Tensor | None] | None = None,
    start: Motion | Sequence[Motion | None] | None = None,
    contacts: bool = True,
    settings: Settings | None = None,
    generator: torch.Generator | None = None,
    progress: bool = False,
) -> Denoised | list[Denoised]:
    """The likeliest motion, given a noisy one (RNN-GAN, eq. 25).

    Parameters
    ----------
    motions : on the model's skeleton, at its rate; or a list, which is cleaned side by side.
    model : with a likelihood, on `JointAngles` of rotation vectors, its weights or their name; None:
        the shipped lstm-gmm-contacts.
    noise : standard deviations of the root's place in metres and of angles in radians; None: told by
        each clip itself (`denoise_seen.levels_of`).
    missing : bool (frames,) or (frames, joints), true where nothing was seen; a list for a list. What
        the motion says there is not looked at.
    start : smooth motions to begin with, such as a filter made; None: ours (`denoise_seen.smooth`).
    contacts : whether feet that are down are to stand (eq. 19).
    settings : see `denoise_windows.Settings`.
    generator : source of chance, of which there is none unless the method is a swarm.
    progress : show a bar, on a terminal.

    Returns
    -------
    Denoised : or a list, for a list. Its `motion` has contacts, of heels and toes.

    Raises
    ------
    SolverError : a clip of too few frames, another rate or body, or of no person's size; a mask of
        another shape, or of all joints; levels or settings that make no sense; a model that has no
        likelihood. Nothing is cleaned then.

    Notes
    -----
    The record has

    * "noise": "root_m", "angle_rad", and whether they were "estimated";
    * "outliers": frames that were seen and not believed; "missing": share of joints not seen;
    * "way": "map", the likeliest motion; "filter", where the network does not know such motion and a
      smooth line is what comes back, as free as the clip asks for, or the start that was given;
      "unchanged", where there was nothing to clean;
    * "likelihood" of the likeliest motion, nats a frame, and "least", below which it is not known;
    * "changed (cm)": farthest that a joint was moved, where it was seen;
    * "elsewhere as it was": whether the clip is calm, so that only frames which were not seen or not
      believed were changed;
    * "energy": nats a frame of each term, weighed; "evaluations" of it;
    * "seconds": of the processor, the clip's share.
    """
    alone = isinstance(motions, Motion)
    clips = [motions] if alone else list(motions)
    model = model if isinstance(model, nn.Module) else load(MODEL if model is None else model)
    how = settings or Settings()
    how = how if contacts else replace(how, contact=0.0)
    check_model(model)
    check_settings(how)
    masks = theirs("missing", missing, len(clips), alone)
    starts = theirs("start", start, len(clips), alone)
    for clip in clips:
        check_clip(model.encoding, clip)
    begin = time.process_time()
    looked = [
        see(model.encoding, clip, noise, mask) for clip, mask in zip(clips, masks, strict=True)
    ]
    jobs = [
        job_of(
            model.encoding, its, levels, first and rows_of(model.encoding, start_of(clip, first))
        )
        for clip, (its, levels), first in zip(clips, looked, starts, strict=True)
    ]
    done = clean_jobs(model, jobs, how, generator, progress)
    share = (time.process_time() - begin) / max(1, sum(map(len, clips)))
    found = []
    for clip, job, its in zip(clips, jobs, done, strict=True):
        motion = clip
        if its.way != "unchanged":
            motion = motion_of(model.encoding, its.rows, clip)
            if calm(job.noise):
                motion = as_seen(clip, motion, believed_joints(job.seen))
            motion = replace(motion, contacts=label(motion))
        seen = job.seen.mask[:, 5::3]  # one channel of each joint
        record = record_of(clip, motion, seen, job, its, noise is None, share * len(clip))
        found.append(Denoised(motion, record))
    return found[0] if alone else found


class Done(NamedTuple):
    """rows (frames, channels) of a clean clip; way : as of `denoise`; what else the record tells."""

    rows: Tensor
    way: str
    likelihood: float
    least: float
    cleaned: Cleaned | None


def clean_jobs(
    model: LstmGmm,
    jobs: list[Job],
    how: Settings,
    generator: torch.Generator | None = None,
    progress: bool = False,
    always: bool = False,
) -> list[Done]:
    """The best known answer to each job: those that need nothing are left, the others solved together.

    always : none is left.
    """
    encoding = model.encoding
    needed = [job for job in jobs if always or not needs_nothing(job)]
    total = how.rounds * sum(len(job.rows) for job in needed)
    found: list[Cleaned] = []
    hidden = None if progress else True  # None: unless a terminal looks on
    with tqdm(total=total, unit="frame", disable=hidden, leave=False) as bar:
        for _ in range(how.rounds if needed else 0):
            for job in needed:
                job.contacts = resting(encoding, job.rows, how.slow)[:, [1, 3]].double()
            with torch.no_grad(), _weights_alone(model):
                found = clean(model, needed, how, generator, bar.update)
            for job, its in zip(needed, found, strict=True):
                job.rows = its.rows
    cleaned = {id(job): its for job, its in zip(needed, found, strict=True)}
    done = []
    for job in jobs:
        if id(job) not in cleaned:
            done.append(Done(job.seen.rows, "unchanged", float("nan"), float("nan"), None))
            continue
        its = cleaned[id(job)]
        toes = resting(encoding, its.rows, how.slow)[:, [1, 3]]
        likelihood, least = judge(model, its.rows, toes, job.noise)
        least = least if how.least is None else how.least
        known = likelihood >= least
        done.append(
            Done(its.rows, "map", likelihood, least, its)
            if known
            else Done(job.line, "filter", likelihood, least, its)
        )
    return done


def see(
    encoding: JointAngles, clip: Motion, noise: tuple | None, missing: Tensor | None
) -> tuple[Seen, NoiseLevels]:
    """A clip as it was seen, and its noise, estimated if it is not given."""
    joints = mask_of(clip, missing)
    return look(
        rows_of(encoding, clip, joints), joints, None if noise is None else check_levels(noise)
    )


def job_of(
    encoding: JointAngles, seen: Seen, levels: NoiseLevels, start: Tensor | None = None
) -> Job:
    """A clip, ready to be cleaned from a smooth line, or from the rows (frames, channels) of one."""
    if start is not None:
        return Job(seen, levels, start, start)
    line = smooth(seen, levels, encoding.fps)
    return Job(seen, levels, line, cross_validated(seen, levels, encoding.fps))


def needs_nothing(job: Job) -> bool:
    """Whether all was seen, believed, and is as smooth as clean motion."""
    return calm(job.noise) and bool(job.seen.believed.all())


def calm(noise: NoiseLevels) -> bool:
    """Whether a clip is as smooth as clean motion where it was seen and believed."""
    return noise.root_m < LEAST_ROOT and noise.angle_rad < LEAST_ANGLE


def believed_joints(seen: Seen) -> Tensor:
    """Which joints (frames, joints) of a clip were seen and believed."""
    return seen.believed[:, 5::3]  # one channel of each joint


def as_seen(before: Motion, after: Motion, believed: Tensor) -> Motion:
    """A clean motion of a calm recording, which is right wherever it was believed, (frames, joints)."""
    root = torch.where(believed[:, :1], before.root_positions, after.root_positions)
    rotations = torch.where(believed[..., None, None], before.rotations, after.rotations)
    return replace(after, root_positions=root, rotations=rotations)


def resting(encoding: JointAngles, rows: Tensor, speed: float = 0.45) -> Tensor:
    """Whether heels and toes (frames, 4) of rows rest, by the paper's rule."""
    return label(motion_of(encoding, rows), speed=speed)


def record_of(
    before: Motion,
    after: Motion,
    seen: Tensor,
    job: Job,
    done: Done,
    estimated: bool,
    seconds: float,
) -> dict:
    """What `denoise` tells of a clip. seen : (frames, joints), where the clip was looked at."""
    far = (after.positions() - before.positions()).norm(dim=-1)[:, : seen.shape[1]]
    its = done.cleaned
    return {
        "noise": {**job.noise._asdict(), "estimated": estimated},
        "outliers": job.seen.outliers.nonzero()[:, 0].tolist(),
        "missing": 1 - float(seen.double().mean()),
        "way": done.way,
        "likelihood": done.likelihood,
        "least": done.least,
        "changed (cm)": 100 * float(far[seen].max()),
        "elsewhere as it was": calm(job.noise),
        "energy": its.parts if its else {},
        "evaluations": its.evaluations if its else 0,
        "seconds": seconds,
    }


@contextmanager
def _weights_alone(model: nn.Module) -> Iterator[None]:
    """No weight asks for a gradient: what is sought is the motion, and that is faster."""
    asked = [weight for weight in model.parameters() if weight.requires_grad]
    for weight in asked:
        weight.requires_grad_(False)
    try:
        yield
    finally:
        for weight in asked:
            weight.requires_grad_(True)
