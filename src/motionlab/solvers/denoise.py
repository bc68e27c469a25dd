"""Noise taken away (RNN-GAN, section 5.4): the likeliest motion, given what the cameras saw.

    clean = motionlab.solvers.denoise(noisy)
    clean.motion, clean.record["noise"]

Of all motions, which is both likely under the network and near to what was seen (eq. 25 to 27)? A filter
knows that bodies are slow to turn; the network knows how they walk.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor, nn
from tqdm import tqdm

from ..feet.contacts import label
from ..motion import Motion
from ..weights import load
from .denoise_seen import (
    NoiseLevels,
    Seen,
    joints_of,
    levels_of,
    motion_of,
    outliers_of,
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
    start: Motion | Sequence[Motion] | None = None,
    contacts: bool = True,
    settings: Settings | None = None,
    generator: torch.Generator | None = None,
    progress: bool = False,
) -> Denoised | list[Denoised]:
    """The likeliest motion, given a noisy one.

    Parameters
    ----------
    motions : on the model's skeleton, at its rate; or a list, which is cleaned side by side.
    model : with a likelihood, on `JointAngles`; None: the shipped lstm-gmm-contacts.
    noise : standard deviations of the root's place in metres and of angles in radians; None: told by
        the clips themselves (see `denoise_seen.levels_of`).
    missing : bool (frames,) or (frames, joints), true where nothing was seen; a list for a list.
    start : smooth motions to begin with, such as a filter made; None: ours (`denoise_seen.smooth`).
    contacts : whether feet that the network says are down are to stand (eq. 19).
    settings : see `Settings`.
    generator : source of chance, of which there is none unless the method is a swarm.
    progress : show a bar.
    """
    alone = isinstance(motions, Motion)
    clips = [motions] if alone else list(motions)
    model = load(MODEL if model is None else model) if not isinstance(model, nn.Module) else model
    how = settings or Settings()
    if not contacts:
        how = replace(how, contact=0.0)
    masks = [missing] * len(clips) if alone or missing is None else list(missing)
    starts = [start] * len(clips) if alone or start is None else list(start)
    begin = time.process_time()
    grads = [p.requires_grad for p in model.parameters()]
    model.requires_grad_(False)
    jobs = [
        _job(model, clip, noise, mask, first)
        for clip, mask, first in zip(clips, masks, starts, strict=True)
    ]
    with tqdm(total=sum(map(len, clips)), unit="frame", disable=not progress, leave=False) as bar:
        found = clean(model, jobs, how, bar.update)
    for p, g in zip(model.parameters(), grads, strict=True):
        p.requires_grad_(g)
    seconds = (time.process_time() - begin) / sum(map(len, clips))
    done = [
        _denoised(model, clip, job, its, noise is None, seconds * len(clip))
        for clip, job, its in zip(clips, jobs, found, strict=True)
    ]
    return done[0] if alone else done


def _job(model, clip, noise, missing, start) -> Job:
    encoding = model.encoding
    rows = rows_of(encoding, clip)
    mask = torch.ones(len(clip), encoding.skeleton.joints, dtype=torch.bool)
    if missing is not None:
        mask &= ~(missing if missing.ndim == 2 else missing[:, None])
    seen = Seen(rows, joints_of(encoding, mask), torch.zeros(len(clip), dtype=torch.bool))
    levels = levels_of(seen) if noise is None else NoiseLevels(*noise)
    seen.outliers = outliers_of(seen, levels)
    smoothed = smooth(seen, levels) if start is None else rows_of(encoding, start)
    toes = label(motion_of(encoding, smoothed, clip, torch.zeros(len(clip), 2)))[:, [1, 3]]
    return Job(seen, levels, smoothed, toes.double())


def _denoised(model, clip, job: Job, found: Cleaned, estimated: bool, seconds: float) -> Denoised:
    motion = motion_of(model.encoding, found.rows, clip, found.contacts)
    record = {
        "noise": {**job.noise._asdict(), "estimated": estimated},
        "outliers": job.seen.outliers.nonzero()[:, 0].tolist(),
        "energy": found.parts,
        "evaluations": found.evaluations,
        "seconds": seconds,
    }
    return Denoised(motion, record)
