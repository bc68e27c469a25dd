"""Motion made ready for training, in one file that can travel to another machine by itself.

The file is an ``.npz`` with, for all clips one after the other: `features` (rows, dim) in float32,
`lengths` in frames, `names`, `splits`; with `mean`, `std`, `kept` of the normaliser fitted on the
training split; with the `encoding`'s settings in JSON; and with the `hash` of all of these.
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from .. import datasets, encodings
from ..datasets.loader import read_folder, stance
from ..datasets.locomotion import bring
from ..datasets.splits import LONG, SMALLEST, SPLITS, by_time
from ..encodings import JointAngles, Normalizer, RootRelative
from ..errors import DataError, TrainingError
from ..feet import contacts
from ..io.bvh_up import doubt_up
from ..motion import Motion
from ..retargeting.flat_feet import Stance
from ..retargeting.stance import stances
from ..skeleton import Skeleton
from .checkpoints import write_whole

FPS = 30.0
# What acLSTM and its rivals learn: clips of a data set by a word in their names, with the points of
# their own skeleton, at up to 60 frames a second.
DANCES = {
    "martial": ("aclstm-cmu", ("martial",)),
    "indian": ("aclstm-cmu", ("indian",)),
    "hybrid": ("aclstm-cmu", ("indian", "salsa")),
    "walking": ("bandai-locomotion", ("walk",)),
}
DANCE_FPS, STATURE = 60.0, 1.54
_ARRAYS = ("features", "lengths", "names", "splits", "mean", "std", "kept", "encoding")


@dataclass(frozen=True, eq=False)
class Prepared:
    """Encoded clips with their splits, the normaliser of the training split, and a hash.

    features : (rows, dim), all clips one after the other; lengths : (clips,) frames of each.
    """

    features: Tensor
    lengths: Tensor
    names: tuple[str, ...]
    splits: tuple[str, ...]
    encoding: encodings.Encoding
    normalizer: Normalizer
    hash: str

    def clips(self, split: str) -> list[Tensor]:
        """Features (frames, dim) of each clip of a split."""
        each = zip(self.features.split(self.lengths.tolist()), self.splits, strict=True)
        return [clip for clip, its in each if its == split]

    def motion(self, features: Tensor) -> Motion:
        """The motion of rows (frames, dim) of `JointAngles`, with contacts of heels, which rows do not
        have, by their rule; those of toes are the rows' own if they have some."""
        motion = self.encoding.to_motion(features)
        down = contacts.label(motion)
        if motion.contacts is not None:
            down[:, [1, 3]] = motion.contacts[:, [1, 3]]
        return replace(motion, contacts=down)

    def without_contacts(self) -> Prepared:
        """The same clips as an encoding without contact channels, which come last, has them."""
        encoding = encodings.from_config({**self.encoding.config(), "contacts": False})
        full, normalizer = self.normalizer, Normalizer(
            encoding.dim, int((self.normalizer.kept < encoding.dim).sum())
        )  # fmt: skip
        normalizer.mean.copy_(full.mean[: encoding.dim])
        normalizer.std.copy_(full.std[: encoding.dim])
        normalizer.kept.copy_(full.kept[full.kept < encoding.dim])
        features = self.features[:, : encoding.dim].contiguous()
        return replace(self, features=features, encoding=encoding, normalizer=normalizer)

    def matching(self, encoding: encodings.Encoding) -> Prepared:
        """These data as an encoding has them: without contacts if it has none.

        Raises
        ------
        TrainingError : they are features of another kind.
        """
        more = "contacts" in self.encoding.slices and "contacts" not in encoding.slices
        data = self.without_contacts() if more else self
        if data.encoding.config() != encoding.config():
            raise TrainingError(
                "The data are features of another kind than the model's: with contacts or without, "
                "as angles or not, of another body or frame rate."
            )
        return data

    def save(self, path: str | os.PathLike) -> None:
        """Write the file; it appears whole or not at all. Raises DataError if it can't be."""
        arrays = _arrays(self.features, self.lengths, self.names, self.splits, self.normalizer,
                         self.encoding)  # fmt: skip
        try:
            write_whole(path, lambda stream: np.savez(stream, hash=np.array(self.hash), **arrays))
        except OSError as error:
            raise DataError(f"{path}: can't be written ({error.strerror}).") from error

    @classmethod
    def load(cls, path: str | os.PathLike) -> Prepared:
        """Read what `save` wrote; raises DataError if it is missing, damaged or something else."""
        try:
            with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as file:
                arrays = {name: file[name] for name in _ARRAYS}
                stored = str(file["hash"])
            if stored != _digest(arrays):
                raise ValueError("its hash does not fit")
            normalizer = Normalizer(len(arrays["mean"]), len(arrays["kept"]))
            normalizer.load_state_dict(
                {k: torch.from_numpy(arrays[k]) for k in ("mean", "std", "kept")}
            )
            return cls(
                torch.from_numpy(arrays["features"]), torch.from_numpy(arrays["lengths"]),
                tuple(arrays["names"].tolist()), tuple(arrays["splits"].tolist()),
                encodings.from_config(json.loads(str(arrays["encoding"]))), normalizer, stored,
            )  # fmt: skip
        except FileNotFoundError as error:
            raise DataError(
                f"{path}: there is no such file; `motionlab prepare` makes it."
            ) from error
        except (
            OSError, EOFError, ValueError, KeyError, TypeError, RuntimeError, zipfile.BadZipFile
        ) as error:  # fmt: skip
            raise DataError(
                f"{path}: is not a whole file of prepared motion ({error}); make it anew with "
                "`motionlab prepare`."
            ) from error

    @classmethod
    def find(cls, source: str | os.PathLike, permissive: bool = False, **reading) -> Prepared:
        """A prepared file; or a data set or folder, made ready now if it was not before.

        What is made is kept in `file_of(source)`. Folders, whose clips may change, are always read.
        permissive, reading : as for `prepare`; a file has what it has.
        """
        if Path(source).suffix == ".npz" or Path(source).is_file():
            _refuse(source, reading)
            return cls.load(source)
        kept = file_of(source, permissive)
        if str(source) in (*datasets.names(), *DANCES) and kept.exists():
            _refuse(source, reading)
            return cls.load(kept)
        made = prepare(source, progress=True, permissive=permissive, **reading)
        made.save(kept)
        return made


def file_of(source: str | os.PathLike, permissive: bool = False) -> Path:
    """Where the command line keeps what it prepared of a data set or a folder."""
    name, known = Path(source).resolve().name, (*datasets.names(), *DANCES)
    if name in known and str(source) not in known:
        name += "-folder"  # or it would be taken for the data set from then on
    return Path("runs") / f"{name}{'-permissive' * permissive}.npz"


def prepare(
    source: str | os.PathLike,
    progress: bool = False,
    *,
    permissive: bool = False,
    **reading,
) -> Prepared:
    """Load, bring to the canonical skeleton at 30 frames per second, encode.

    Parameters
    ----------
    source : the name of a data set, a folder of motion files, or one of `DANCES`.
    progress : show how far it is.
    permissive : leave out clips whose licence forbids commercial use (of a data set).
    reading : how to read a folder's files, such as `units`, `up`, `reference` or `skip_bad`; see
        `datasets.from_folder`. Files that can't be retargeted are bad, too.

    Where a folder's clips are too few for a split each, those longer than 30 s are split by time,
    with a warning. Training clips are used twice, the second time mirrored. Rows are those of
    `JointAngles` with contacts; see `Prepared.without_contacts`. Dances keep their skeleton and are
    not mirrored; what was recorded at 120 frames a second is there twice at 60, odd frames and even
    ones. Their rows are those of `RootRelative`, of a body of 1.54 m.

    Raises
    ------
    DataError : no such data set or folder, files missing or bad, or a split without clips.
    """
    from tqdm import tqdm

    encoding = None if source in DANCES else JointAngles(Skeleton.canonical(), FPS, contacts=True)
    features, names, splits = [], [], []
    for split, motions in _load(source, permissive, reading):
        encoding = encoding or RootRelative(motions[0].skeleton, motions[0].fps, STATURE)
        bar = tqdm(motions, f"encoding {split}", leave=False, unit="clip", disable=not progress)
        for motion in bar:
            features.append(encoding.encode(motion))
            names.append(f"{motion.source}/{motion.name}")
            splits.append(split)
    training = [clip for clip, split in zip(features, splits, strict=True) if split == "train"]
    if not training or "val" not in splits:
        raise DataError(
            f"{source}: has {len(training)} clips for training and {splits.count('val')} for "
            "validation; there must be some of both."
        )
    rows, lengths = torch.cat(features), torch.tensor([len(clip) for clip in features])
    normalizer = Normalizer.fit(training)
    digest = _digest(_arrays(rows, lengths, names, splits, normalizer, encoding))
    return Prepared(rows, lengths, tuple(names), tuple(splits), encoding, normalizer, digest)


def _load(
    source: str | os.PathLike, permissive: bool, reading: dict
) -> Iterator[tuple[str, list[Motion]]]:
    """Canonical clips of each split, in training with their mirror images; dances as they are."""
    if source in DANCES:
        _refuse(source, reading)
        for split in SPLITS:
            yield split, _dances(source, split, permissive)
        return
    known = str(source) in datasets.names()
    if known:
        _refuse(source, reading)
    stood = _stood(source, permissive) if known else {}
    own = [] if known else _own(source, permissive, reading)
    for split in SPLITS:
        if known:
            loaded = datasets.load(source, split, permissive=permissive)
            motions = [bring(motion, stood[motion.name]) for motion in loaded]
        else:
            motions = [motion for its, motion in own if its == split]
        if split == "train":
            motions += [replace(m.mirror(), name=f"{m.name}_mirrored") for m in motions]
        yield split, motions


def _stood(source: str, permissive: bool) -> dict[str, Motion | Stance | None]:
    """How the rig of each clip of a data set stands, by its name, and its flat feet.

    These are learned from all splits together, where the rest pose stands.
    """
    motions = datasets.load(source, permissive=permissive)
    found = {motion.name: stance(motion.source) for motion in motions}
    body = Skeleton.canonical()
    left = [m for m in motions if found[m.name] is None and not m.skeleton.matches(body)]
    learned = stances(left, body).references
    return found | {motion.name: its for motion, its in zip(left, learned, strict=True)}


def _refuse(source: str | os.PathLike, reading: dict) -> None:
    if reading:
        raise DataError(
            f"{source}: how its files are read is known; leave out {', '.join(reading)}."
        )


def _dances(source: str, split: str, permissive: bool) -> list[Motion]:
    name, words = DANCES[source]
    motions = datasets.load(name, split, permissive=permissive)
    motions = [m for m in motions if any(word in m.name for word in words)]
    if name != "aclstm-cmu":  # bodies of several sizes, in files whose rest pose lies down
        motions = [motion.retarget(reference=stance(motion.source)) for motion in motions]
    return [half for motion in motions for half in _halves(motion)]


def _own(source: str | os.PathLike, permissive: bool, reading: dict) -> list[tuple[str, Motion]]:
    """Canonical clips of a folder, with their splits; all are read, so that all faults are told."""
    if permissive:
        raise DataError(
            f"{source}: licences are known of named data sets only, not of a folder's clips."
        )
    found = read_folder(
        source, then=lambda motion: motion.resample(FPS), skeleton=Skeleton.canonical(), **reading
    )
    if reading.get("up") is not None:  # what nobody said was told while it was read
        _warn_of_lying(source, [motion for _, motion in found])
    if {"train", "val"} <= {split for split, _ in found}:
        return found
    return _by_time(source, [motion for _, motion in found])


def _warn_of_lying(source: str | os.PathLike, motions: list[Motion]) -> None:
    """A network learns what lies as it learns what walks, so that a wrong `up` must not go unheard."""
    lying = [motion.name for motion in motions if doubt_up(motion)]
    if lying:
        warnings.warn(
            f"{source}: in {len(lying)} of {len(motions)} clips, read with the up that was said, the "
            f"trunk is upright in hardly any frame: {', '.join(lying)}. Unless people lie or crawl "
            "there, another axis is up; a network would learn to lie.",
            stacklevel=2,
        )


def _by_time(source: str | os.PathLike, motions: list[Motion]) -> list[tuple[str, Motion]]:
    """Parts of long clips with their splits; short ones are for training."""
    parts = []
    for motion in motions:
        if motion.seconds <= LONG:
            parts.append(("train", motion))
            continue
        for start, stop, split in by_time(len(motion), motion.fps, motion.name):
            name = f"{motion.name}, {start / motion.fps:.0f} to {stop / motion.fps:.0f} s"
            parts.append((split, replace(motion[start:stop], name=name)))
    long = sum(motion.seconds > LONG for motion in motions)
    if not long:
        longest = max(motion.seconds for motion in motions)
        raise DataError(
            f"{source}: has {len(motions)} clips, the longest of {longest:.1f} s, too little to keep "
            f"some for validation. Give more: {SMALLEST} clips at the least, or one longer than "
            f"{LONG:.0f} s, which is split by time."
        )
    seconds = {split: sum(m.seconds for its, m in parts if its == split) for split in SPLITS}
    warnings.warn(
        f"{source}: {len(motions)} clips are too few for a split each, so {long} are split by time: "
        + ", ".join(f"{split} {its:.0f} s" for split, its in seconds.items()) + ".",
        stacklevel=2,
    )  # fmt: skip
    return parts


def _halves(motion: Motion) -> list[Motion]:
    """Every frame of a motion, in motions of at most 60 frames a second."""
    stride = max(1, round(motion.fps / DANCE_FPS))
    if stride == 1:
        return [motion]
    return [
        replace(motion[i::stride], name=f"{motion.name}_{i + 1}/{stride}") for i in range(stride)
    ]


def _arrays(
    features: Tensor, lengths: Tensor, names: Sequence[str], splits: Sequence[str],
    normalizer: Normalizer, encoding: encodings.Encoding,
) -> dict[str, np.ndarray]:  # fmt: skip
    return {
        "features": features.numpy(),
        "lengths": lengths.numpy(),
        "names": np.array(names),
        "splits": np.array(splits),
        **{name: tensor.numpy() for name, tensor in normalizer.state_dict().items()},
        "encoding": np.array(json.dumps(encoding.config())),
    }


def _digest(arrays: dict[str, np.ndarray]) -> str:
    digest = hashlib.sha256()
    for name in _ARRAYS:
        digest.update(name.encode() + str(arrays[name].shape).encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
