"""How each file of a folder is read, where not all are read alike."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from fnmatch import fnmatch
from pathlib import Path

from .. import roles
from ..errors import MotionFileError, SkeletonError
from .bvh_reading import Reading

ByFile = Mapping[
    str, Mapping
]  # arguments of reading by a pattern of files, as {"lab/*": {"up": "z"}}
_KNOWN = [each.name for each in fields(Reading)]


class Readings:
    """The `Reading` of each file.

    folder, files : a folder, and the files of it that are read.
    how : how they are read, but for what `by_file` says of some. A pattern is compared with a file's
        path below the folder, and "*" stands for any letters, "/" included; of two that fit the later
        one wins.

    Raises
    ------
    MotionFileError : `by_file` is no such table, or of no folder, an argument in it makes no sense, or
        a pattern fits no file.
    """

    def __init__(
        self, folder: Path, files: Sequence[Path], how: Reading, by_file: ByFile | None = None
    ) -> None:
        self.how, self._own = how, {}
        if by_file and not folder.is_dir():
            raise MotionFileError(f"{folder}: is one file; by_file= is for those of a folder.")
        for pattern, said in (by_file or {}).items():
            more = _checked(pattern, said)
            fit = [f for f in files if fnmatch(f.relative_to(folder).as_posix(), pattern)]
            if not fit:
                raise MotionFileError(
                    f"{folder}: by_file= has the pattern {pattern!r}, which fits none of its "
                    f"{len(files)} files; write one as 'lab/*' or '*_01.bvh'."
                )
            for file in fit:
                try:
                    self._own[file] = replace(self.of(file), **more)
                except MotionFileError as error:
                    raise MotionFileError(f"by_file= of {pattern!r}: {error}") from error

    def of(self, file: str | os.PathLike) -> Reading:
        """How a file is read, of the folder or not; what is no path is for its reader to refuse."""
        return self._own.get(Path(file) if isinstance(file, str) else file, self.how)


def _checked(pattern: str, said: Mapping) -> Mapping:
    if not isinstance(said, Mapping) or (unknown := [key for key in said if key not in _KNOWN]):
        wrong = f"no {unknown[0]!r}" if isinstance(said, Mapping) else "nothing but tables"
        raise MotionFileError(
            f"by_file= of {pattern!r}: there is {wrong}; say of files {', '.join(_KNOWN)}, as in "
            "{'lab/*': {'units': 'm', 'up': 'z'}}."
        )
    return said


def read_by_file(path: str | os.PathLike) -> dict[str, dict]:
    """`by_file` out of a TOML or JSON file: of each pattern a table, ``["lab/*"]`` and below it lines
    as ``units = "m"``; ``roles = "rig.toml"`` is a file beside it.

    Raises
    ------
    SkeletonError : no such file, its syntax is wrong, or it holds no tables.
    """
    example = 'a line there looks like ["lab/*"], and below it units = "m"'
    tables = roles.table(path, example)
    if not isinstance(tables, dict):
        raise SkeletonError(f"{path}: must hold tables; {example}.")
    for said in tables.values():
        if isinstance(said, dict) and isinstance(said.get("roles"), str):
            said["roles"] = roles.read(Path(path).parent / said["roles"])
    return tables
