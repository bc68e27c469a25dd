"""Parsed clips, kept as one npz file a split in the user's cache folder.

Rotations are stored as unit quaternions in float32. Clips go through the same packing whether they
come from the cache or not, so that a second load gives the same numbers as the first, bit by bit.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Sequence

import numpy as np
import roma
import torch

from ..errors import MotionLabError
from ..motion import Motion
from ..skeleton import Skeleton
from .files import cache_folder
from .registry import Clip, sources

# Raise this when reading or packing changes, so that old files are made anew.
FORMAT = 2


def key(clips: Sequence[Clip], process: int = 0) -> str:
    """Hash of everything that decides what the clips look like.

    process : the number of what was done to them after reading, 0 for nothing.
    """
    facts = [
        (c.source, c.where, c.sha256, c.fps, c.skip, sources()[c.source].units,
         *(file.sha256 for file in c.besides))
        for c in clips
    ]  # fmt: skip
    return hashlib.sha256(json.dumps([FORMAT, process, facts]).encode()).hexdigest()


def pack(motions: Sequence[Motion]) -> dict[str, np.ndarray]:
    """Arrays that `unpack` makes the same motions of.

    Skeletons that agree to a micrometre are stored once.
    """
    skeletons: dict[str, int] = {}
    which = [skeletons.setdefault(_to_json(m.skeleton), len(skeletons)) for m in motions]
    quaternions = [roma.rotmat_to_unitquat(m.rotations.double()).float() for m in motions]
    labelled = motions and all(m.contacts is not None for m in motions)
    contacts = torch.cat([m.contacts for m in motions]) if labelled else torch.zeros(0, 4)
    return {
        "skeletons": np.array(list(skeletons)),
        "skeleton": np.array(which, dtype=np.int64),
        "frames": np.array([len(m) for m in motions], dtype=np.int64),
        "fps": np.array([m.fps for m in motions], dtype=np.float64),
        "roots": torch.cat([m.root_positions for m in motions]).numpy(),
        "quaternions": torch.cat([q.reshape(-1, 4) for q in quaternions]).numpy(),
        "contacts": contacts.bool().numpy(),  # empty if a motion has none
    }


def unpack(arrays: dict[str, np.ndarray], names: Sequence[tuple[str, str]]) -> list[Motion]:
    """Motions from what `pack` made; `names` gives (source, name) of each."""
    skeletons = [_from_json(text) for text in arrays["skeletons"]]
    joints = [skeletons[i].joints for i in arrays["skeleton"]]
    frames = arrays["frames"].tolist()
    rotations = roma.unitquat_to_rotmat(torch.from_numpy(arrays["quaternions"]))
    rotations = rotations.split([f * j for f, j in zip(frames, joints, strict=True)])
    roots = torch.from_numpy(arrays["roots"]).split(frames)
    contacts = [None] * len(frames)
    if len(arrays["contacts"]):
        contacts = torch.from_numpy(arrays["contacts"]).split(frames)
    return [
        Motion(
            skeletons[which],
            root,
            rotation.reshape(len(root), -1, 3, 3),
            fps,
            name=name,
            source=source,
            contacts=contact,
        )
        for which, root, rotation, contact, fps, (source, name) in zip(
            arrays["skeleton"].tolist(),
            roots,
            rotations,
            contacts,
            arrays["fps"],
            names,
            strict=True,
        )
    ]


def read(label: str, clips: Sequence[Clip], process: int = 0) -> list[Motion] | None:
    """The parsed clips, None if they are not cached, outdated or damaged."""
    path = cache_folder() / "parsed" / f"{label}.npz"
    try:
        # opened here, as np.load leaves a damaged file open
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            if str(file["key"]) != key(clips, process):
                return None
            arrays = {name: file[name] for name in file.files}
        return unpack(arrays, [(clip.source, clip.name) for clip in clips])
    except (OSError, EOFError, ValueError, KeyError, IndexError, TypeError, RuntimeError,
            MotionLabError, zipfile.BadZipFile, zlib.error):  # fmt: skip
        return None  # whatever is wrong with a cache file: it is made anew


def write(
    label: str, clips: Sequence[Clip], arrays: dict[str, np.ndarray], process: int = 0
) -> None:
    """Keep packed clips; the file appears whole or not at all. Warns if it can't be written."""
    path = cache_folder() / "parsed" / f"{label}.npz"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            whole = os.path.join(folder, "whole.npz")
            np.savez(whole, key=np.array(key(clips, process)), **arrays)
            os.replace(whole, path)
    except OSError as error:
        warnings.warn(
            f"Parsed clips can't be kept in {path.parent} ({error.strerror}), so that every load "
            "reads the files again; let XDG_CACHE_HOME name a folder that can be written to.",
            stacklevel=4,
        )


def _to_json(skeleton: Skeleton) -> str:
    micrometres = lambda t: np.round(t.double().numpy() * 1e6).astype(int).tolist()
    return json.dumps(
        {
            "names": skeleton.names,
            "parents": skeleton.parents,
            "offsets": micrometres(skeleton.offsets),
            "end_parents": skeleton.end_parents,
            "end_offsets": micrometres(skeleton.end_offsets),
            "rotation_orders": skeleton.rotation_orders,
        }
    )


def _from_json(text: str) -> Skeleton:
    content = json.loads(text)
    for name in ("offsets", "end_offsets"):
        content[name] = torch.tensor(content[name], dtype=torch.float64).reshape(-1, 3) / 1e6
    return Skeleton(**content)
