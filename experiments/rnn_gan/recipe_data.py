"""The data of W2's rows: all clips, one actor's, all others', and clips truly at 120 frames a second.

of("locomotion"), of("actor"), of("others"), of("30"), of("120")
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import cache

import torch

from motionlab import Skeleton, datasets
from motionlab.datasets.registry import choose
from motionlab.encodings import JointAngles, Normalizer
from motionlab.training import Prepared

ACTOR = "accad/"  # one man
SOURCES, RATE = ("aclstm-cmu", "cmu"), 120.0
SPLITS = ("train", "val", "test")
_NAMES: dict[str, str] = {}  # hash of the data: their name


@cache
def of(name: str) -> Prepared:
    """Data without contact channels, as named above."""
    if name in ("30", "120"):
        data = _recorded(float(name))
    else:
        data = Prepared.find("locomotion").without_contacts()
        if name != "locomotion":
            data = _some(data, [n.startswith(ACTOR) == (name == "actor") for n in data.names], name)
    _NAMES[data.hash] = name
    return data


def name_of(data: Prepared) -> str:
    """What `of` was asked for."""
    return _NAMES[data.hash]


def _some(data: Prepared, chosen: list[bool], name: str) -> Prepared:
    """Some of the clips, with the normaliser of all: likelihoods remain comparable."""
    rows = torch.tensor(chosen).repeat_interleave(data.lengths)
    keep = lambda values: tuple(v for v, is_chosen in zip(values, chosen, strict=True) if is_chosen)
    return replace(
        data, features=data.features[rows], lengths=data.lengths[torch.tensor(chosen)],
        names=keep(data.names), splits=keep(data.splits), hash=f"{data.hash}-{name}",
    )  # fmt: skip


def _recorded(fps: float) -> Prepared:
    """Clips recorded at 120 frames a second, at 120 or 30: never made from fewer."""
    encoding = JointAngles(Skeleton.canonical(), fps=fps)
    rows, names, splits = [], [], []
    for split in SPLITS:
        for source in SOURCES:
            at_120 = [c.name for c in choose(source) if c.fps == RATE and c.split == split]
            motions = [
                m.resample(fps).retarget() for m in datasets.load(source, split, clips=at_120)
            ]
            if split == "train":
                motions += [replace(m.mirror(), name=f"{m.name}_mirrored") for m in motions]
            rows += [encoding.encode(m) for m in motions]
            names += [f"{source}/{m.name}" for m in motions]
            splits += [split] * len(motions)
    lengths = torch.tensor([len(clip) for clip in rows])
    normalizer = Normalizer.fit([c for c, s in zip(rows, splits, strict=True) if s == "train"])
    features = torch.cat(rows)
    digest = hashlib.sha256(features.numpy().tobytes()).hexdigest()
    return Prepared(features, lengths, tuple(names), tuple(splits), encoding, normalizer, digest)
