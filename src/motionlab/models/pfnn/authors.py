"""The network of the PFNN's authors: numbers that are taken like data, and never kept here.

It is free for academic and non-commercial purposes, with the citation that stands below. It was
published as weights at 50 phases of the stride; the four sets of weights that these were drawn from
are found again by least squares.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ...datasets.files import cache_folder, data_folder
from ...encodings import Normalizer
from ...errors import DataError
from ...skeleton import Skeleton
from .layout import LENGTHS, Layout, join, split
from .network import CONTROLS, Pfnn, shares

LICENCE = "free for academic and non-commercial purposes, with citation"
CITATION = (
    "Holden, D., Komura, T., Saito, J.: Phase-Functioned Neural Networks for Character Control. "
    "SIGGRAPH 2017."
)
HOME = "https://theorangeduck.com/page/phase-functioned-neural-networks-character-control"
FILE = "pfnn-authors.npz"
SHA256 = "85413750ca6d028fb7d60e6b9a155368948a9ededed25e87606df24b55223a2f"
# A public copy of what the authors published.
COPY = "https://github.com/sreyafrancis/PFNN"
COMMIT = "61a50342b693826ca0f07d0c0eaa6366ed4851f6"
# Of the body, in the authors' order.
JOINTS = (
    "Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "RHipJoint",
    "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase", "LowerBack", "Spine", "Spine1", "Neck",
    "Neck1", "Head", "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftFingerBase",
    "LeftHandIndex1", "LThumb", "RightShoulder", "RightArm", "RightForeArm", "RightHand",
    "RightFingerBase", "RightHandIndex1", "RThumb",
)  # fmt: skip
_SEEN, _WIDTH, _SAID = 342, 512, 311
_PHASES = 50  # at which weights were published
_ROUNDING = 1e-4  # by how much these may be off a spline, in parts of the largest
_CM = 0.01  # metres


def load_authors(place: str | os.PathLike | None = None) -> Pfnn:
    """The authors' network, in eval mode: 31 joints, 60 frames a second, in metres.

    Parameters
    ----------
    place : the folder ``demo/network`` of what the authors published. None: the file
        ``pfnn-authors.npz``, in the folder that MOTIONLAB_DATA names or in the user's cache folder.

    Raises
    ------
    DataError : it is not there, damaged, or something else; the message says where to get it.
    """
    arrays = _published(Path(place)) if place is not None else _kept()
    skeleton = _skeleton(arrays)
    layout = Layout(skeleton, fps=60.0, reach=60, stride=10, gaits=6, grounds=3)
    seen = _normalizer(layout.seen, arrays["Xmean"], arrays["Xstd"])
    said = _normalizer(layout.said, arrays["Ymean"], arrays["Ystd"])
    network = Pfnn(layout, _WIDTH, seen=seen, said=said)
    with torch.no_grad():
        for number, layer in enumerate(network.layers):
            layer.weight.copy_(torch.from_numpy(arrays[f"W{number}"]))
            layer.bias.copy_(torch.from_numpy(arrays[f"b{number}"]))
    return network.eval().requires_grad_(False)


def _kept() -> dict[str, np.ndarray]:
    """Arrays of the file by their names, checked."""
    folder = data_folder()
    places = [place / FILE for place in (folder, cache_folder()) if place is not None]
    found = next((path for path in places if path.is_file()), None)
    if found is None:
        raise DataError(_missing(places))
    try:
        data = found.read_bytes()
    except OSError as error:
        raise DataError(f"{found}: can't be read ({error.strerror}); copy it again.") from error
    digest = hashlib.sha256(data).hexdigest()
    if digest != SHA256:
        raise DataError(
            f"{found}: is not the file it should be (SHA-256 {digest}, expected {SHA256}); it is "
            "damaged or edited: copy it again, or remove it and give load_authors the folder "
            f"demo/network of {COPY}."
        )
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        return dict(file)


def _missing(places: list[Path]) -> str:
    return "\n".join(
        [
            f"The network of the PFNN's authors is not on this machine (looked for "
            f"{', '.join(map(str, places))}). It is {LICENCE}. Either of these helps:",
            f"  MOTIONLAB_DATA=folder    with {FILE} in it",
            f"  load_authors('PFNN/demo/network')    after `git clone {COPY}` (commit {COMMIT})",
            f"Cite: {CITATION} {HOME}",
        ]
    )


def _published(folder: Path) -> dict[str, np.ndarray]:
    """The same arrays from the files that the authors published, float32 without a header."""
    sizes = {"Xmean": _SEEN, "Xstd": _SEEN, "Ymean": _SAID, "Ystd": _SAID}
    arrays = {name: _numbers(folder / "pfnn" / f"{name}.bin", n) for name, n in sizes.items()}
    inputs, outputs = (_SEEN, _WIDTH, _WIDTH), (_WIDTH, _WIDTH, _SAID)
    for layer, (n, m) in enumerate(zip(inputs, outputs, strict=True)):
        for name, shape in ((f"W{layer}", (m, n)), (f"b{layer}", (m,))):
            paths = [folder / "pfnn" / f"{name}_{i:03d}.bin" for i in range(_PHASES)]
            rows = np.stack([_numbers(path, int(np.prod(shape))) for path in paths])
            arrays[name] = controls(torch.from_numpy(rows)).reshape(CONTROLS, *shape).numpy()
    joints = len(JOINTS)
    arrays["parents"] = _numbers(folder / "character_parents.bin", joints).astype(np.int32)
    arrays["rest_xforms"] = _numbers(folder / "character_xforms.bin", joints * 16).reshape(-1, 4, 4)
    return arrays


def controls(rows: Tensor) -> Tensor:
    """The four sets of weights (4, n) whose spline comes nearest to weights (phases, n).

    rows : at equal distances of the phase, from 0 on.

    Raises
    ------
    DataError : they lie on no such spline.
    """
    phases = torch.arange(len(rows)) * (2 * np.pi / len(rows))
    basis = shares(phases.double())  # (phases, 4)
    found = torch.linalg.lstsq(basis, rows.double()).solution
    off = (basis @ found - rows).abs().max()
    if not off <= _ROUNDING * rows.abs().max():
        raise DataError(
            f"Weights at {len(rows)} phases are {float(off):.2g} off the nearest spline through "
            f"{CONTROLS} sets of weights: they are damaged, or of another network."
        )
    return found.float()


def _numbers(path: Path, count: int) -> np.ndarray:
    """As many float32 as that from a file of nothing else."""
    try:
        numbers = np.fromfile(path, dtype="<f4")
    except OSError as error:
        raise DataError(
            f"{path}: can't be read ({error.strerror}); give the folder demo/network of {COPY}, "
            f"commit {COMMIT}."
        ) from error
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise DataError(
            f"{path}: holds {len(numbers)} numbers, {count} finite ones are needed; fetch it again."
        )
    return numbers


def _skeleton(arrays: Mapping[str, np.ndarray]) -> Skeleton:
    """The authors' body: bones as they lie in their parents' frames."""
    offsets = _CM * torch.from_numpy(arrays["rest_xforms"][:, :3, 3])
    return Skeleton(JOINTS, arrays["parents"].tolist(), offsets)


def _normalizer(parts: dict, mean: np.ndarray, std: np.ndarray) -> Normalizer:
    """Means and deviations, of lengths in metres; so the network speaks in metres."""
    normalizer = Normalizer(len(mean))
    for kept, numbers in ((normalizer.mean, mean), (normalizer.std, std)):
        values = split(parts, torch.from_numpy(numbers))
        values |= {name: _CM * values[name] for name in LENGTHS if name in values}
        kept.copy_(join(parts, values))
    return normalizer
