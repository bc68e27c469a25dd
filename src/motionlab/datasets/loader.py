"""Clips by the name of their data set, or from a folder of one's own."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PurePosixPath

import torch
from tqdm import tqdm

from ..errors import DataError
from ..io.acclaim import parse_amc
from ..io.bvh import parse_bvh
from ..io.bvh_reading import Reading
from ..io.motion_file import ENDINGS, is_motion, read_motion
from ..io.readings import ByFile, Readings
from ..motion import Motion
from ..retargeting.flat_feet import Stance
from ..retargeting.stance import stances
from ..skeleton import Skeleton
from . import cache, files, locomotion
from .o3de import parse_take
from .registry import (
    EXAMPLES,
    GAITS,
    LOCOMOTION,
    ON_ONE_BODY,
    Clip,
    check_name,
    check_split,
    check_wanted,
    choose,
    members,
    sources,
)
from .report import Report
from .splits import assign

_lock = threading.Lock()
_threads_before: list[int] = []  # of loads under way; what to go back to is what the first found


@contextmanager
def _one_thread():
    """Let torch use one thread: a clip is too small to share, and threads that wait for each other
    cost several times more than they do."""
    with _lock:
        _threads_before.append(torch.get_num_threads())
        torch.set_num_threads(1)
    try:
        yield
    finally:
        with _lock:
            first = _threads_before[0]
            _threads_before.pop()
            if not _threads_before:
                torch.set_num_threads(first)


@_one_thread()
def load(
    name: str,
    split: str | None = None,
    *,
    clips: Sequence[str] | None = None,
    mirrored: bool = False,
    permissive: bool = False,
    download: bool | None = None,
) -> list[Motion]:
    """Clips of a named data set.

    Parameters
    ----------
    name : one of `names()`. "gaits" is made on the spot and needs neither files nor network.
    split : "train", "val" or "test"; None for all.
    clips : names of the clips wanted, as `table(name)` lists them; None for all.
    mirrored : after the clips, their mirrored copies as well, with "_mirrored" after their names.
        They are of the same split as the clips.
    permissive : leave out clips whose licence forbids commercial use.
    download : None downloads what is missing if it is at most 10 MB, True any size, False nothing.

    Files are looked for in the folder that the environment variable MOTIONLAB_DATA names, then in
    the user's cache folder. Parsed clips are cached, so that the next load is fast.

    Returns
    -------
    list of Motion, by path (examples: as listed). `motion.source` names the source.

    Raises
    ------
    DataError : unknown name, split or clip; files that are missing or damaged.
    """
    check_name(name)
    if name == GAITS:
        motions = _gaits(split, clips)
    else:
        motions = _from_files(name, choose(name, split, clips, permissive), download)
    if mirrored:
        motions += [replace(m.mirror(), name=f"{m.name}_mirrored") for m in motions]
    return motions


def _from_files(name: str, wanted: Sequence[Clip], download: bool | None) -> list[Motion]:
    files.data_folder()  # complain of a wrong MOTIONLAB_DATA even if nothing is read from it
    process, prepare = _process(name, download)
    motions: dict[Clip, Motion] = {}
    to_parse: dict[str, list[Clip]] = {}
    for label, together in _cached_together(name).items():
        some = set(wanted).intersection(together)
        cached = cache.read(label, together, process) if some else None
        if cached is not None:
            motions.update(zip(together, cached, strict=True))
        elif some:
            to_parse[label] = [clip for clip in together if clip in some]
    files.get(name, [clip for some in to_parse.values() for clip in some], download)
    with _progress(f"reading {name}", sum(map(len, to_parse.values()))) as bar:
        for label, some in to_parse.items():
            parsed = []
            for clip, data in files.read(some):
                parsed.append(prepare(parse(clip, *data)))
                bar.update()
            arrays = cache.pack(parsed)
            if some == _cached_together(name)[label]:
                cache.write(label, some, arrays, process)
            names = [(clip.source, clip.name) for clip in some]
            motions.update(zip(some, cache.unpack(arrays, names), strict=True))
    return [motions[clip] for clip in wanted]


def _process(name: str, download: bool | None) -> tuple[int, Callable[[Motion], Motion]]:
    """What is done to clips after reading: its number, for the cache, and a function."""
    if name not in ON_ONE_BODY:
        return 0, lambda motion: motion
    return locomotion.FORMAT, lambda motion: locomotion.bring(
        motion, stance(motion.source, download)
    )


@functools.cache
def stance(source: str, download: bool | None = None) -> Motion | Stance | None:
    """That by which `locomotion` knows how a source's rig stands; None if its rest pose does."""
    source = locomotion.SAME_RIG.get(source, source)
    if source in locomotion.LEARNED:
        together = load(source, clips=locomotion.LEARNED[source], download=download)
        return stances(together, Skeleton.canonical()).references[0]
    if source not in locomotion.STANCES:
        return None
    name, frames = locomotion.STANCES[source]
    return load(source, clips=[name], download=download)[0][:frames]


def _cached_together(name: str) -> dict[str, list[Clip]]:
    """The clips of a data set by the cache file that they are in: one a split, for speed.

    What is in `locomotion`, too, is kept there.
    """
    shared = set(members(LOCOMOTION)) if name in ON_ONE_BODY else set()
    groups: dict[str, list[Clip]] = {}
    for clip in choose(name):
        label = f"{LOCOMOTION if clip in shared else name}-{clip.split}"
        if name in ON_ONE_BODY:
            label += f"-{clip.source}"
        groups.setdefault(name if name == EXAMPLES else label, []).append(clip)
    return groups


def parse(clip: Clip, data: bytes, *besides: bytes) -> Motion:
    """A clip from the bytes of its file and of those besides it."""
    names = {"where": clip.path, "source": clip.source}
    how = {"units": sources()[clip.source].units, "up": "y", "fps": clip.fps}
    how["tpose_first"] = clip.skip > 0  # as the table knows; a take's later parts skip more
    first = clip.skip - how["tpose_first"]
    match PurePosixPath(clip.path).suffix:
        case ".res":
            motion, first = parse_take(data, **names), clip.skip
        case ".amc":
            motion = parse_amc(data, *besides, **names, **how)
        case _:
            motion = parse_bvh(data, **names, **how)
    return replace(motion[first : first + clip.frames], name=clip.name)


def _gaits(split: str | None, clips: Sequence[str] | None) -> list[Motion]:
    from . import gaits

    check_split(split)
    motions = gaits.load(split)
    if clips is None:
        return motions
    wanted = check_wanted(clips, [motion.name for motion in gaits.load()], GAITS)
    return [motion for motion in motions if motion.name in wanted]


def from_folder(
    path: str | os.PathLike,
    *,
    units: str | float | None = None,
    up: str | None = None,
    fps: float | None = None,
    root: str | None = None,
    rigid: str | None = None,
    roles: Mapping[str, str] | None = None,
    animation: str | int | None = None,
    by_file: ByFile | None = None,
    pattern: str | None = None,
    tpose_first: bool = False,
    drop_zeros: bool = False,
    split: str | None = None,
    skip_bad: bool = False,
    skeleton: Skeleton | None = None,
    reference: Motion | str | os.PathLike | None = None,
) -> list[Motion]:
    """All motion files of a folder and its subfolders, BVH, Acclaim, glTF: a reader's own clips.

    Parameters
    ----------
    path : the folder.
    units, up, fps, root, rigid, roles, animation, tpose_first, drop_zeros : as for
        `motionlab.read_bvh`, `read_amc` and `read_gltf`, for all files alike; units None is
        centimetres for BVH, metres for glTF, for Acclaim what its skeleton says. What is doubtful
        about files, such as their units, is said once, with their number.
    by_file : the same arguments for some files only, by a pattern of their paths below the folder, as
        ``{"lab/*": {"units": "m", "up": "z"}}``.
    pattern : which files, as for `pathlib.Path.glob`; None takes all that end in .bvh, .amc, .glb
        or .gltf.
    split : only the files of this split; which are in it depends on the files' names alone.
    skip_bad : leave out files that can't be read, or retargeted, with a warning, instead of raising.
    skeleton : retarget all clips to it, such as `Skeleton.canonical()`; None leaves them as they are.
    reference : a clip, or its file, of the rig in which a person stands, for retargeting. Clips of one
        rig whose rest pose does not stand get one set of joint axes by it; without it they are learned
        from these clips together (`retargeting.stance`), which is said in a warning.

    Returns
    -------
    list of Motion, by path, named by it without its ending; `motion.source` is the folder's name.

    Raises
    ------
    DataError : there is no such folder or no such file in it, or files that can't be read; the
        message names all of them. With `skip_bad`: there is no other.
    MotionFileError : an argument makes no sense, or `reference` can't be read.
    RetargetError : nobody stands in `reference`, or it is of another rig than all clips.
    """
    found = read_folder(
        path, pattern=pattern, split=split, skip_bad=skip_bad, skeleton=skeleton,
        reference=reference, units=units, up=up, fps=fps, root=root, rigid=rigid, roles=roles,
        animation=animation, by_file=by_file, tpose_first=tpose_first, drop_zeros=drop_zeros,
    )  # fmt: skip
    return [motion for _, motion in found]


@_one_thread()
def read_folder(
    path: str | os.PathLike,
    *,
    then: Callable[[Motion], Motion] = lambda motion: motion,
    pattern: str | None = None,
    split: str | None = None,
    skip_bad: bool = False,
    skeleton: Skeleton | None = None,
    reference: Motion | str | os.PathLike | None = None,
    by_file: ByFile | None = None,
    **reading,
) -> list[tuple[str, Motion]]:
    """`from_folder`, each clip with its split before it, and with something done to each.

    then : what is done after reading, before retargeting; an error that it raises is a fault of the
        file, as one in reading is.
    """
    check_split(split)
    how = Reading(**reading)
    if reference is not None and skeleton is None:
        raise DataError("reference= tells how to retarget; say with skeleton= to which body, too.")
    # what axes a rig has must not depend on the split that is asked for
    folder, there = _find(path, pattern)
    chosen = [row for row in there if skeleton or split in (None, row[2])]
    readings = Readings(folder, [file for file, *_ in there], how, by_file)
    stance = _standing(reference, readings)
    report, found = Report(folder, len(chosen)), []
    with _progress(f"reading {folder.name}", len(chosen)) as bar:
        for file, name, its in chosen:
            with report.of(file, name):
                motion, doubts = read_motion(file, readings.of(file), folder.resolve().name)
                report.doubt(file, doubts)
                found.append((file, its, then(replace(motion, name=name))))
            bar.update()
    if skeleton is not None and found:
        found = _retargeted(found, skeleton, stance, split, report)
    report.tell(skip_bad, stacklevel=5)
    return [(its, motion) for _, its, motion in found]


def _standing(reference: Motion | str | os.PathLike | None, how: Readings) -> Motion | None:
    """The reference, read as the clips are; its first frame is no worse for being a T-pose."""
    if reference is None or isinstance(reference, Motion):
        return reference
    return read_motion(reference, replace(how.of(reference), tpose_first=False))[0]


def _retargeted(
    found: list[tuple[Path, str, Motion]],
    skeleton: Skeleton,
    reference: Motion | None,
    split: str | None,
    report: Report,
) -> list[tuple[Path, str, Motion]]:
    """The clips of a split on a skeleton, those of one rig by the same axes."""
    stood = stances([motion for *_, motion in found], skeleton, reference)
    report.said += stood.said
    brought = []
    with _progress("retargeting", len(found)) as bar:
        for (file, its, motion), stance in zip(found, stood.references, strict=True):
            if split in (None, its):
                with report.of(file, motion.name):
                    brought.append((file, its, motion.retarget(skeleton, reference=stance)))
            bar.update()
    return brought


def _find(path: str | os.PathLike, pattern: str | None) -> tuple[Path, list[tuple[Path, str, str]]]:
    """The folder, and of each of its files: path, name of the clip, split."""
    if not isinstance(path, str | os.PathLike):
        raise DataError(
            f"from_folder: {path!r} is not a path; give the folder of the motion files."
        )
    folder = Path(path).expanduser()
    if not folder.is_dir():
        raise DataError(f"{folder}: is not a folder; give the folder that holds the motion files.")
    try:
        found = sorted(
            file
            for file in folder.glob(pattern or "**/*")
            if (pattern or is_motion(file)) and file.is_file()
        )
    except (ValueError, NotImplementedError) as error:
        raise DataError(
            f"{folder}: {pattern!r} is no pattern below the folder; write one like '**/*.bvh'."
        ) from error
    if not found:
        sought = f"matches {pattern!r}" if pattern else f"ends in {ENDINGS}"
        raise DataError(
            f"{folder}: no file {sought}; put motion files there, or give another pattern."
        )
    names = [file.relative_to(folder).with_suffix("").as_posix() for file in found]
    first: dict[str, Path] = {}
    for file, name in zip(found, names, strict=True):
        if (other := first.setdefault(name, file)) is not file:
            raise DataError(
                f"{folder}: {name!r} is there twice, as {other.name} and {file.name}; keep one of "
                f"them, or give a pattern such as '**/*{other.suffix}'."
            )
    splits = assign([("", name, "", "") for name in names])
    return folder, list(zip(found, names, splits, strict=True))


def _progress(what: str, total: int) -> tqdm:
    return tqdm(total=total, desc=what, unit="clip", leave=False, delay=2)
