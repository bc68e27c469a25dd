"""What there is: sources, their licences, and a table of all clips. Needs no data."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from urllib.parse import quote

from ..errors import DataError
from .about import Info
from .splits import SPLITS

if TYPE_CHECKING:
    import pandas as pd

GAITS, EXAMPLES, LOCOMOTION, EVERYTHING = "gaits", "examples", "locomotion", "everything"
MIXED = (EXAMPLES, LOCOMOTION, EVERYTHING)  # of clips of several sources
ON_ONE_BODY = (LOCOMOTION, EVERYTHING)
ONE_BODY_FPS = 30
# Not in `everything`: a frame that is no motion, and a clip that another source has a namesake of.
LEFT_OUT = {("virvig-jl", "JL_mm_tpose"), ("cmu-amc", "02_01")}
# of `table`
COLUMNS = [
    "source",
    "name",
    "action",
    "style",
    "split",
    "frames",
    "fps",
    "seconds",
    "bytes",
    "licence",
    "performance",
    "path",
    "url",
]


@dataclass(frozen=True)
class Source:
    """Where a set of clips comes from and what may be done with it."""

    name: str
    title: str
    url: str  # what the clips' paths are relative to
    home: str
    units: float  # metres per unit of length in the files
    licence: str
    commercial: bool
    citation: str
    quirks: tuple[str, ...]
    besides: Mapping[str, File]  # what clips need besides their own file, by how these begin
    published: tuple[tuple[str, str], ...]  # pattern of a path, and where such a file is published

    def address(self, path: str) -> str:
        """Where a file is published."""
        for pattern, place in self.published:
            if found := re.fullmatch(pattern, path):
                path = found.expand(place)
                break
        return self.url + quote(path)


@dataclass(frozen=True)
class File:
    """A published file of a source."""

    source: str
    path: str
    sha256: str
    bytes: int

    @property
    def url(self) -> str:
        return sources()[self.source].address(self.path)


@dataclass(frozen=True)
class Clip(File):
    """One row of clips.tsv: a file, or a part of one."""

    frames: int  # after leaving out `skip`
    fps: float  # the true rate, whatever the header says
    skip: int  # frames in front that are calibration, not motion
    action: str
    style: str
    performance: str  # clips with the same one share frames or the stage; parts of a take do not
    split: str
    part: str = ""  # which frames of the file, if other rows are of the same one

    @property
    def name(self) -> str:
        return f"{clip_name(self.path)}_{self.part}" if self.part else clip_name(self.path)

    @property
    def where(self) -> str:
        """The path and, of a part, which frames of the file."""
        return f"{self.path}#{self.part}" if self.part else self.path

    @property
    def besides(self) -> tuple[File, ...]:
        """Files that it needs, such as the skeleton of its subject."""
        besides = sources()[self.source].besides.items()
        return tuple(file for start, file in besides if self.path.startswith(start))

    @property
    def seconds(self) -> float:
        return self.frames / self.fps

    @property
    def licence(self) -> str:
        return _licence(sources()[self.source])

    @property
    def commercial(self) -> bool:
        """Whether the licence allows commercial use."""
        return sources()[self.source].commercial


def clip_name(path: str) -> str:
    """The file's name without its ending; a bare number takes its folder's name in front."""
    path = PurePosixPath(path)
    return f"{path.parent.name}_{path.stem}" if path.stem.isdigit() else path.stem


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


@cache
def _toml() -> dict:
    return tomllib.loads(_text("sources.toml"))


@cache
def sources() -> dict[str, Source]:
    """All sources by name."""
    tables = {name: table for name, table in _toml().items() if name != EXAMPLES}
    return {name: _source(name, table) for name, table in tables.items()}


def _source(name: str, table: dict) -> Source:
    besides = table.get("besides", {}).items()
    return Source(
        **{
            **table,
            "name": name,
            "quirks": tuple(table["quirks"]),
            "besides": {start: File(source=name, **facts) for start, facts in besides},
            "published": tuple(map(tuple, table.get("published", ()))),
        }
    )


@cache
def clips() -> tuple[Clip, ...]:
    """All clips of all sources, by source and path; parts of a take by time."""
    header, *lines = _text("clips.tsv").splitlines()
    kinds = {field.name: field.type for field in fields(Clip)}
    convert = [{"int": int, "float": float, "str": str}[kinds[name]] for name in header.split("\t")]
    rows = (line.split("\t") for line in lines)
    found = [Clip(*(to(cell) for to, cell in zip(convert, row, strict=True))) for row in rows]
    rows_of = Counter((clip.source, clip.path) for clip in found)
    found = [
        replace(clip, part=f"{clip.skip:04d}-{clip.skip + clip.frames:04d}")
        if rows_of[clip.source, clip.path] > 1
        else clip
        for clip in found
    ]
    return tuple(
        clip if clip.performance else replace(clip, performance=clip.name) for clip in found
    )


def files_of(clips: Iterable[Clip]) -> list[File]:
    """The files that clips are read from, each once."""
    every = (file for clip in clips for file in (clip, *clip.besides))
    return list({(file.source, file.path): file for file in every}.values())


def names() -> list[str]:
    """Names that `load`, `info` and `table` know."""
    return [GAITS, EXAMPLES, LOCOMOTION, EVERYTHING, *sources()]


def check_name(name: str) -> None:
    if name not in names():
        raise DataError(f"There is no data set {name!r}; there are {', '.join(names())}.")


def check_split(split: str | None) -> None:
    if split is not None and split not in SPLITS:
        raise DataError(f"There is no split {split!r}; use one of {', '.join(SPLITS)}, or None.")


def members(name: str) -> list[Clip]:
    """The clips of a named data set (not of the gaits, which have no files)."""
    check_name(name)
    if name == EXAMPLES:
        by_name = {f"{clip.source}/{clip.name}": clip for clip in clips()}
        return [by_name[key] for key in _toml()[EXAMPLES]["clips"]]
    if name == LOCOMOTION:
        listed = set(_text("locomotion.tsv").splitlines()[1:])
        return [clip for clip in clips() if f"{clip.source}\t{clip.where}" in listed]
    if name == EVERYTHING:
        return [clip for clip in clips() if (clip.source, clip.name) not in LEFT_OUT]
    return [clip for clip in clips() if clip.source == name]


def choose(
    name: str,
    split: str | None = None,
    wanted: Sequence[str] | None = None,
    permissive: bool = False,
) -> list[Clip]:
    """Members of a data set, of one split, those wanted by name, those free for commercial use.

    Raises
    ------
    DataError : the data set, the split or a wanted clip does not exist.
    """
    check_split(split)
    found = members(name)
    if wanted is not None:
        chosen = check_wanted(wanted, [clip.name for clip in found], name)
        found = [clip for clip in found if clip.name in chosen]
    return [
        clip
        for clip in found
        if split in (None, clip.split) and (clip.commercial or not permissive)
    ]


def check_wanted(wanted: Iterable[str], known: Iterable[str], name: str) -> set[str]:
    """The wanted names as a set, all of them known."""
    if isinstance(wanted, str):
        raise DataError(f"clips={wanted!r} must be a list of names: clips=[{wanted!r}].")
    listed = list(wanted) if isinstance(wanted, Iterable) else [wanted]
    if not isinstance(wanted, Iterable) or not all(isinstance(clip, str) for clip in listed):
        raise DataError(
            f"clips={wanted!r} must be a list of names, such as those in "
            f"motionlab.datasets.table({name!r})."
        )
    wanted, known = set(listed), list(known)
    for clip in sorted(wanted):
        if clip not in known:
            near = get_close_matches(clip, known, 3, 0.3) or known[:3]
            raise DataError(
                f"Data set {name!r} has no clip {clip!r}; did you mean {', '.join(near)}? "
                f"motionlab.datasets.table({name!r}) lists all {len(known)}."
            )
    return wanted


def info(name: str) -> Info:
    """Title, size, licence, citation and quirks of a data set. Needs no data.

    Raises
    ------
    DataError : there is no such data set.
    """
    check_name(name)
    rows = table(name)
    about: dict = {
        "name": name,
        "clips": len(rows),
        "minutes": rows.seconds.sum() / 60,
        "bytes": 0 if name == GAITS else sum(file.bytes for file in files_of(members(name))),
        "splits": {split: int((rows.split == split).sum()) for split in SPLITS},
    }
    if name == GAITS:
        return Info(
            **about,
            title="Procedural walking and running with exact contact labels",
            licence="MIT, as motionlab",
            commercial=True,
            citation="Curves fitted to clips of the ACCAD Motion Lab, The Ohio State University.",
            home="",
            quirks=("Made by motionlab.datasets.gaits; needs no file and no network.",),
        )
    if name in MIXED:
        used = [sources()[source] for source in dict.fromkeys(c.source for c in members(name))]
        return Info(
            **about,
            title=_toml()[EXAMPLES]["title"] if name == EXAMPLES else _TITLES[name],
            licence="; ".join(f"{s.name}: {_licence(s)}" for s in used),
            commercial=all(s.commercial for s in used),
            citation="as the sources: " + ", ".join(s.name for s in used),
            home="",
            quirks=_QUIRKS.get(name, ()),
        )
    source = sources()[name]
    return Info(
        **about,
        title=source.title,
        licence=_licence(source),
        commercial=source.commercial,
        citation=source.citation,
        home=source.home,
        quirks=source.quirks,
    )


_TITLES = {
    LOCOMOTION: "Walking, running, turning, starting, stopping on the canonical skeleton",
    EVERYTHING: "All clips of all sources on the canonical skeleton: locomotion, dances, fights, gestures",
}
_ON_ONE_BODY_QUIRKS = (
    "Retargeted and resampled to 30 frames per second when first loaded, which takes a minute or two.",
    "Speeds are scaled as the legs are: by 0.87 for accad, 0.89 for o3de-motionmatching.",
)
_QUIRKS = {
    LOCOMOTION: _ON_ONE_BODY_QUIRKS,
    EVERYTHING: (
        *_ON_ONE_BODY_QUIRKS,
        "Clips of locomotion are the same here, in the same splits, and cached once for both.",
        "Wrong rotations of single frames in clips of aclstm-cmu and cmu are left as they are.",
    ),
}


def _licence(source: Source) -> str:
    return source.licence + ("" if source.commercial else " (non-commercial)")


def table(name: str | None = None) -> pd.DataFrame:
    """Clips as a pandas DataFrame, one row each; of all sources, or of one data set.

    Columns: source, name, action, style, split, frames, fps, seconds, bytes, licence, performance,
    path, url. Needs no data.

    Raises
    ------
    DataError : there is no such data set.
    """
    import pandas as pd

    if name == GAITS:
        return pd.DataFrame(_gait_rows(), columns=COLUMNS)
    found = clips() if name is None else members(name)
    if name in ON_ONE_BODY:
        found = [_resampled(clip) for clip in found]
    rows = [[getattr(clip, column) for column in COLUMNS] for clip in found]
    return pd.DataFrame(rows, columns=COLUMNS)


def _resampled(clip: Clip) -> Clip:
    """A clip as data sets on one body have it."""
    frames = -(-clip.frames * ONE_BODY_FPS // round(clip.fps))
    return replace(clip, frames=frames, fps=float(ONE_BODY_FPS))


def _gait_rows() -> list[dict]:
    from . import gaits

    return [
        {
            "source": GAITS,
            "name": motion.name,
            "action": motion.name.split("_")[0],
            "style": "",
            "split": split,
            "frames": len(motion),
            "fps": motion.fps,
            "seconds": motion.seconds,
            "bytes": 0,
            "licence": "MIT",
            "performance": motion.name,
            "path": "",
            "url": "",
        }
        for motion, split in zip(gaits.load(), gaits.splits(), strict=True)
    ]
