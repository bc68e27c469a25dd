"""`motionlab info`: what is in a motion file, and which joint was understood as what."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from ..datasets.report import Report
from ..errors import MotionFileError, MotionLabError
from ..io.bvh_reading import Reading
from ..io.bvh_units import foot_to_head
from ..io.motion_file import ENDINGS, is_motion, read_motion
from ..io.readings import ByFile, Readings
from ..roles import ALL
from .folder import Taken, check_there
from .options import as_options

if TYPE_CHECKING:
    from ..motion import Motion
    from ..skeleton import Skeleton

_FAULT, _LACKS = (
    "can't be read (FAULT)",
    "lack roles that retargeting needs",
)  # of a folder's last lines


@dataclass(kw_only=True)
class Info(Taken):
    """What is in a motion file and which joint is understood as what; a line a file for a folder."""

    path: Positional[Annotated[Path, arg(metavar="FILE|FOLDER")]]
    """A .bvh, .amc, .glb or .gltf file, or a folder of them."""

    def run(self) -> None:
        check_there(self.path)
        print(_described(self.path, self.how(), self.answers(), as_options))


def describe(path: str | os.PathLike, *, roles: Mapping[str, str] | None = None, **reading) -> str:
    """What is in a motion file: sizes, and each joint with its role.

    Parameters
    ----------
    path : the file, or a folder, of which each file gets one line, faults included.
    roles, reading : as `motionlab.datasets.from_folder` takes them.

    Returns
    -------
    text : of a file a TOML table of its roles, all else in comments. Mended and written to a file
        it can be given back: ``roles=motionlab.roles.read("my_rig.toml")``.

    Raises
    ------
    MotionFileError : the file can't be read, `roles` do not fit it, or a folder has no motion file.
    """
    by_file = reading.pop("by_file", None)
    return _described(Path(path), Reading(roles=roles, **reading), by_file)


def _described(
    path: Path, how: Reading, by_file: ByFile | None, say: Callable[[str], str] = str
) -> str:
    """say : puts what the library says into the words of whom it is told."""
    if not path.is_dir():
        motion, doubts = read_motion(path, Readings(path, [path], how, by_file).of(path))
        return "\n".join(
            [*_sizes(motion, map(say, doubts.values())), "#", *_table(motion.skeleton)]
        )
    files = sorted(file for file in path.rglob("*") if is_motion(file))
    if not files:
        raise MotionFileError(f"{path}: holds no {ENDINGS} file; name one, or a folder of them.")
    report, readings = Report(path, len(files)), Readings(path, files, how, by_file)
    useless: dict[str, list[str]] = {_FAULT: [], _LACKS: []}
    lines = [_line(file, readings.of(file), report, useless) for file in files]
    lines += [
        f"{path}: {len(names)} of {len(files)} files {what}: {', '.join(names)}"
        for what, names in useless.items()
        if names
    ]
    return "\n".join(map(say, [*lines, *report.fitting()]))


def _line(file: Path, how: Reading, report: Report, useless: dict[str, list[str]]) -> str:
    """One file of a folder in one line; it is listed in `useless` if no network can learn from it."""
    name = file.relative_to(report.folder).as_posix()
    try:
        motion, doubts = read_motion(file, how)
    except MotionLabError as error:
        useless[_FAULT].append(name)
        return f"{name}: FAULT {error}"
    report.doubt(file, doubts)
    missing = _missing(motion.skeleton)
    useless[_LACKS] += [name] * bool(missing)
    said = f"lacks {', '.join(missing)}" if missing else "has all roles that retargeting needs"
    doubtful = [doubt.rstrip(".") for doubt in doubts.values()]
    return "; ".join([f"{name}: {_counts(motion)}, {_size(motion)}", *doubtful, said])


def _counts(motion: Motion) -> str:
    return (
        f"{motion.skeleton.joints} joints, {len(motion)} frames, {motion.seconds:.2f} s, "
        f"{motion.fps:g} fps"
    )


def _size(motion: Motion) -> str:
    """How large the body is: along its bones if that can be told, else as it is seen first."""
    if (height := foot_to_head(motion.skeleton)) is not None:
        return f"{height:.2f} m from foot to head"
    heights = motion[:1].positions()[0, :, 1]
    return f"{float(heights.max() - heights.min()):.2f} m high in its first frame"


def _missing(skeleton: Skeleton) -> list[str]:
    """Roles that retargeting needs and that no joint has."""
    from ..retargeting.retarget import NEEDED

    return [role for role in NEEDED if role not in skeleton.roles]


def _sizes(motion: Motion, doubts: Iterable[str]) -> list[str]:
    found = [f"{motion.name}: {_counts(motion)}, {_size(motion)}", *doubts]
    return [f"# {' '.join(line.split())}" for line in found]


def _table(skeleton: Skeleton) -> list[str]:
    """Each joint with its role as a line of TOML; what has none, and what is missing, in comments."""
    role_of = {joint: role for role, joint in skeleton.roles.items()}
    lines = [
        f"{'' if joint in role_of else '# '}{role_of.get(joint, 'ROLE')} = {_quoted(name)}"
        for joint, name in enumerate(skeleton.names)
    ]
    lines += [f'{role} = ""' for role, name in skeleton.roles.given.items() if not name]
    missing = _missing(skeleton)
    lines += [
        "#",
        "# Retargeting has all the roles that it needs."
        if not missing
        else "# Retargeting needs also:",
    ]
    lines += [f'# {role} = "NAME"' for role in missing]
    others = [
        role for role in ALL if role not in {*skeleton.roles, *skeleton.roles.given, *missing}
    ]
    if skeleton.roles.placed:
        lines.append(
            f"# Told by the lengths of bones, not by names: {', '.join(skeleton.roles.placed)}."
        )
    if others:
        lines.append(f"# There may also be: {', '.join(others)}.")
    if skeleton.without_partner:
        alone = ", ".join(_quoted(skeleton.names[joint]) for joint in skeleton.without_partner)
        lines.append(f"# On one side, without a partner on the other: {alone}.")
    return [
        *lines,
        '# To mend this, keep it as my_rig.toml with the lines changed (a role that no joint has is "");',
        "# --roles my_rig.toml, or in Python roles=motionlab.roles.read('my_rig.toml'), reads it.",
    ]


def _quoted(name: str) -> str:
    return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")
