"""What is to be said of a folder's files: faults by file, and each doubt once, with a count."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import DataError, MotionFileError, MotionLabError


class Report:
    """Gathers what goes wrong with the files of a folder while all of them are tried."""

    def __init__(self, folder: Path, files: int) -> None:
        self.folder, self.files = folder, files
        self.said: list[str] = []  # of the folder as a whole
        self.faults: list[str] = []
        self._doubts: dict[
            tuple[str, str], dict[Path, str]
        ] = {}  # by what it is about, and what fits

    @contextmanager
    def of(self, file: Path, name: str) -> Iterator[None]:
        """What is done to one file here: its errors are faults, its warnings doubts.

        name : of its clip, by which warnings of several files would differ.
        """
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                yield
            except MotionFileError as error:  # names the file
                self.faults.append(str(error))
            except MotionLabError as error:
                self.faults.append(f"{file}: {self._first(file)}{error}")
        for warning in told:
            said = str(warning.message)
            said = said.removeprefix(f"{name}: ")  # as its file stands there
            self.doubt(file, {said.replace(repr(name), ""): said})

    def doubt(self, file: Path, doubts: dict[str, str]) -> None:
        """Something to be said of a file, by what it is about."""
        for about, said in doubts.items():
            which = (about, getattr(said, "fits", ""))
            self._doubts.setdefault(which, {})[file] = f"{file}: {said}"

    def _first(self, file: Path) -> str:
        """What to do about a file before any fault of its body is worth a look."""
        fits = [fits for (_, fits), files in self._doubts.items() if fits and file in files]
        if not fits:
            return ""
        return f"looks as if read wrongly; read it with {' and '.join(fits)}. As it is now: "

    def notes(self) -> list[str]:
        """All doubts, those about the same in one, with a count."""
        notes = []
        for (_, fits), files in self._doubts.items():
            note = next(iter(files.values()))
            if len(files) > 1:
                note = f"{self.folder}, {len(files)} of {self.files} files, first {note}"
            if self._some(fits, files):
                note += f" What looks like {fits}: {self._names(files)}."
            notes.append(note)
        return [*notes, *(f"{self.folder}: {said}" for said in self.said)]

    def fitting(self) -> list[str]:
        """Which files another way of reading fits."""
        return [
            f"{self.folder}: {len(files)} of {self.files} files look like {fits}: {self._names(files)}"
            for (_, fits), files in self._doubts.items()
            if fits
        ]

    def _some(self, fits: str, files: dict[Path, str]) -> bool:
        return bool(fits) and 1 < len(files) < self.files

    def _names(self, files: dict[Path, str]) -> str:
        return ", ".join(file.relative_to(self.folder).as_posix() for file in files)

    def tell(self, skip_bad: bool, stacklevel: int) -> None:
        """Warn of all doubts, and of the faults if they may be; raise DataError if they may not, or
        if no file is left."""
        for said in self.notes():
            warnings.warn(said, stacklevel=stacklevel)
        if not self.faults:
            return
        message = f"{self.folder}: {len(self.faults)} of {self.files} files can't be used:\n  "
        message += "\n  ".join(self.faults)
        if len(self.faults) == self.files:
            raise DataError(f"{message}\nNone is left; mend them, or name another folder.")
        if not skip_bad:
            raise DataError(f"{message}\nMend or remove them, or pass skip_bad=True.")
        warnings.warn(message, stacklevel=stacklevel)
