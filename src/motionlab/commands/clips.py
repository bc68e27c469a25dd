"""What the commands on one's own clips share: which files are read, where they are written, how.

A command names what it does to one motion; `Clips.work` does it to a file, or to all files of a
folder. A file that can't be read, or fails on the way, stops no other one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tqdm import tqdm
from tyro.conf import Positional, arg

from ..datasets.report import Report
from ..errors import MotionFileError
from ..io import write_bvh, write_gltf
from ..io.bvh_reading import Reading
from ..io.motion_file import ENDINGS, is_motion, read_motion
from ..io.readings import Readings
from ..motion import Motion
from .folder import Taken
from .options import as_options

WRITERS = {".bvh": write_bvh, ".glb": write_gltf}


@dataclass(kw_only=True)
class Clips(Taken):
    """A file or a folder of files, and where what becomes of them is written."""

    path: Positional[Annotated[Path, arg(metavar="FILE|FOLDER")]]
    """What to read; of a folder all files in it and below that can be read."""
    out: Path
    """File to write, or a folder for many; of a file the name's end says what is written."""
    force: bool = False
    """Replace files that are there already."""
    skip_bad: bool = False
    """Do as if files that can't be read or worked on were not there; they are listed all the same."""

    def read(self, file: Path, how: Reading) -> tuple[Motion, dict[str, str]]:
        """The motion in a file, and what is doubtful about it."""
        return read_motion(file, how)

    def meet(self, files: list[Path], how: Readings) -> None:
        """Look at all files before anything is done to the first."""

    def work(
        self, suffix: str, do: Callable[[Motion, Path, Path], str], known: tuple[str, ...]
    ) -> None:
        """Do it to every file: `do` gets a motion, its file and the one to write, and says what it did.

        suffix : of the files that a folder's become; known : all that a single file may end in.

        Raises
        ------
        MotionFileError : nothing can be read, or written where `out` is; at the end, with all
            faults, unless bad ones are to be skipped.
        """
        pairs = self._pairs(suffix, known)
        files = [file for file, _ in pairs]
        readings = Readings(self.path, files, self.how(), self.answers())
        self.meet(files, readings)
        report = Report(self.path, len(pairs))
        unseen = None if self.path.is_dir() else True  # None: where nobody looks
        with tqdm(total=len(pairs), unit="file", leave=False, disable=unseen) as bar:
            for file, target in pairs:
                with report.of(file, file.stem):
                    self._check_target(file, target, [other for _, other in pairs])
                    motion, said = self.read(file, readings.of(file))
                    report.doubt(file, said)
                    tqdm.write(f"{target}: {self._done(do, motion, file, target)}")
                bar.update()
        for said in report.notes():
            print(f"note: {as_options(said)}")
        self._tell([as_options(fault) for fault in report.faults], len(pairs))

    @staticmethod
    def _done(do: Callable, motion: Motion, file: Path, target: Path) -> str:
        """What `do` says; raises MotionFileError if the disk does not let it."""
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            return do(motion, file, target)
        except OSError as error:
            raise MotionFileError(
                f"{target}: can't be written ({error.strerror}); check folder and rights, or name "
                "another --out."
            ) from error

    def _pairs(self, suffix: str, known: tuple[str, ...]) -> list[tuple[Path, Path]]:
        """Each file with what it is to become."""
        if self.path.is_dir():
            if self.out.is_file() or self.out.suffix.lower() in known:
                raise MotionFileError(
                    f"--out {self.out}: {self.path} is a folder, so this must name one, too."
                )
            below = self.out.resolve()
            inside = below.is_relative_to(self.path.resolve()) and below != self.path.resolve()
            files = [file for file in files_of(self.path)
                     if not (inside and file.resolve().is_relative_to(below))]  # fmt: skip
            return [(f, self.out / f.relative_to(self.path).with_suffix(suffix)) for f in files]
        if not self.path.exists():
            raise MotionFileError(f"{self.path}: there is no such file or folder.")
        target = self.out / f"{self.path.stem}{suffix}" if self.out.is_dir() else self.out
        if target.suffix.lower() not in known:
            raise MotionFileError(
                f"--out {self.out}: ends in none of {', '.join(known)}, so it is not known what to "
                f"write; name a file such as {self.out.with_suffix(suffix)}, or a folder that is there."
            )
        if not target.parent.is_dir():
            raise MotionFileError(
                f"--out {self.out}: there is no folder {target.parent}; make it, or name another."
            )
        return [(self.path, target)]

    def _check_target(self, file: Path, target: Path, targets: list[Path]) -> None:
        if targets.count(target) > 1:
            raise MotionFileError(
                f"{file}: would become {target}, as another file would whose name differs in its end "
                "alone; rename one of them."
            )
        if target.is_dir():
            raise MotionFileError(f"{target}: is a folder; remove it, or name another --out.")
        if target.exists() and not self.force:
            raise MotionFileError(
                f"{target}: is there already; --force replaces it, another --out leaves it."
            )

    def _tell(self, faults: list[str], count: int) -> None:
        """Raise the faults, or only print them."""
        if not faults:
            return
        if count == 1 and not self.path.is_dir():
            raise MotionFileError(faults[0])
        message = f"{self.path}: {len(faults)} of {count} files failed:\n  "
        message += "\n  ".join(faults)
        if len(faults) == count:
            raise MotionFileError(f"{message}\nNone was done; mend them, or name another folder.")
        if not self.skip_bad:
            raise MotionFileError(f"{message}\nMend or remove them, or pass --skip-bad.")
        print(message)


def files_of(folder: Path) -> list[Path]:
    """All files of a folder and those below that can be read; raises MotionFileError if none is."""
    found = sorted(file for file in folder.rglob("*") if is_motion(file) and file.is_file())
    if not found:
        raise MotionFileError(
            f"{folder}: holds no file that can be read; their names end in {ENDINGS}."
        )
    return found


def write(motion: Motion, path: Path, root_motion: str | None = None) -> None:
    """Write a motion as what its name ends in says."""
    WRITERS[path.suffix.lower()](motion, path, root_motion=root_motion)
