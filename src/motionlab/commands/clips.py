"""What the commands on one's own clips share: which files are read, where they are written, how.

A command names what it does to one motion; `Clips.work` does it to a file, or to all files of a
folder. A file that can't be read, or fails on the way, stops no other one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tqdm import tqdm
from tyro.conf import Positional, arg

from ..datasets.report import Report
from ..errors import MotionFileError
from ..io import write_bvh, write_gltf
from ..io.bvh import file_names
from ..io.bvh_reading import Reading
from ..io.free_names import alike
from ..io.mjcf import write_mjcf
from ..io.motion_file import ENDINGS, is_motion, read_motion
from ..io.readings import Readings
from ..io.root_motion import NAME, in_place, root_name
from ..io.usd import joint_names, write_usd
from ..motion import Motion
from .folder import Taken, check_there
from .options import as_options
from .programs import ANY, Program


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

    program: ClassVar[Program] = ANY  # that is to open what is written

    def read(self, file: Path, how: Reading) -> tuple[Motion, dict[str, str]]:
        """The motion in a file, and what is doubtful about it."""
        return read_motion(file, how)

    def meet(self, files: list[Path], how: Readings) -> None:
        """Look at all files before anything is done to the first."""

    def notes(self, ending: str) -> list[str]:
        """What to know of files that were written and end so."""
        return []

    def work(
        self, suffix: str, do: Callable[[Motion, Path, Path], str], known: tuple[str, ...]
    ) -> None:
        """Do it to every file: `do` gets a motion, its file and the one to write, and says what it did.

        suffix : of the files that a folder's become; known : all that a single file may end in.

        Raises
        ------
        MotionFileError : nothing can be read, or written where `out` is; at the end, if files are
            there already, or with all faults, unless bad ones are to be skipped.
        """
        pairs = self._pairs(suffix, known)
        files = [file for file, _ in pairs]
        readings = Readings(self.path, files, self.how(), self.answers())
        self.meet(files, readings)
        report, there = Report(self.path, len(pairs)), []
        doubtful, fits = Counter(), {}
        unseen = None if self.path.is_dir() else True  # None: where nobody looks
        with tqdm(total=len(pairs), unit="file", leave=False, disable=unseen) as bar:
            for file, target in pairs:
                with report.of(file, file.stem):
                    if self._is_there(file, target, [other for _, other in pairs]):
                        there.append(target)
                    else:
                        wrong = self._one(file, target, readings.of(file), do, report)
                        doubtful.update(list(wrong))
                        fits |= wrong
                bar.update()
        done = len(pairs) - len(there) - len(report.faults)
        own = self.notes(pairs[0][1].suffix.lower()) if done else []
        for said in [*map(as_options, report.notes()), *own]:
            print(f"note: {said}")
        if doubtful and self.path.is_dir():
            print(f"{self.path}: {done} of {len(pairs)} files are written; perhaps read wrongly: "
                  + ", ".join(f"{count} {what}" for what, count in doubtful.items()))  # fmt: skip
        elif doubtful and done:
            print(f"{pairs[0][1]}: is written, and perhaps wrong: {' and '.join(fits)}. Unless it is "
                  f"meant so, write it again with {' '.join(fits.values())} --force")  # fmt: skip
        self._tell([as_options(fault) for fault in report.faults], there, len(pairs))

    def _one(
        self, file: Path, target: Path, how: Reading, do: Callable, report: Report
    ) -> dict[str, str]:
        """Do it to one file and print what was done; returns in what it was perhaps read wrongly, and
        the option that mends it."""
        motion, said = self.read(file, how)
        report.doubt(file, said)
        wrong = _read_wrongly(said, how.up)
        first = [f"{what}: read with {remedy}?" for what, remedy in wrong.items()]
        tqdm.write(" ".join([f"{target}:", *first, self._done(do, motion, file, target)]))
        return wrong

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
        check_there(self.path)
        target = self.out / f"{self.path.stem}{suffix}" if self.out.is_dir() else self.out
        if target.suffix.lower() not in known:
            check_no_fbx(self.out)
            why = f"ends in none of {', '.join(known)}, so it is not known what to write"
            if self.program.title and self.out.suffix:
                why = f"{self.program.title} opens {', '.join(known)} alone"
            instead = f"{self.out.with_suffix(suffix)}"
            if not self.out.suffix:  # a folder may be meant
                instead += f", or {self.out / self.path.stem}{suffix}: folders are made"
            raise MotionFileError(f"--out {self.out}: {why}; name a file such as {instead}.")
        return [(self.path, target)]

    def _is_there(self, file: Path, target: Path, targets: list[Path]) -> bool:
        """Whether a file is there that must not be replaced; raises MotionFileError if none can be."""
        if targets.count(target) > 1:
            raise MotionFileError(
                f"{file}: would become {target}, as another file would whose name differs in its end "
                "alone; rename one of them."
            )
        if target.is_dir():
            raise MotionFileError(f"{target}: is a folder; name another --out.")
        return target.exists() and not self.force

    def _tell(self, faults: list[str], there: list[Path], count: int) -> None:
        """Raise the faults and what is there already; print faults only that are to be skipped."""
        old = [
            f"{target}: is there already; --force overwrites it, another --out leaves it."
            for target in there
        ]
        if not self.path.is_dir():
            if said := [*old, *faults]:
                raise MotionFileError(said[0])
            return
        listed = lambda head, lines: "\n  ".join(
            [f"{self.path}: {len(lines)} of {count} {head}", *lines]
        )
        said = [listed("files are not written anew:", old)] * bool(old)
        if faults:
            said.append(listed("files failed:", faults))
            if len(faults) == count:
                said.append("None was done; mend them, or name another folder.")
            elif not self.skip_bad:
                again = (
                    f" To write into {self.out} again, pass --force, too, or name another --out."
                )
                said.append(f"Mend or remove them, or pass --skip-bad.{again}")
        if old or (faults and (len(faults) == count or not self.skip_bad)):
            raise MotionFileError("\n".join(said))
        if said:
            print(said[0])


def _read_wrongly(said: dict[str, str], up: str | None) -> dict[str, str]:
    """What a line about a file must not go without, as its body looks as if read wrongly, and the
    option that mends it; up : the axis that was said to point up."""
    wrong = {}
    if fits := getattr(said.get("units"), "fits", ""):
        wrong["of no person's size"] = as_options(fits)
    if fits := getattr(said.get("up"), "fits", ""):
        head_down = fits[-2] == (up or "y")[-1]  # as "up='-y'": the same axis
        wrong["head down throughout" if head_down else "lies throughout"] = as_options(fits)
    return wrong


def files_of(folder: Path) -> list[Path]:
    """All files of a folder and those below that can be read; raises MotionFileError if none is."""
    found = sorted(file for file in folder.rglob("*") if is_motion(file) and file.is_file())
    if not found:
        raise MotionFileError(
            f"{folder}: holds no file that can be read; their names end in {ENDINGS}."
        )
    return found


def check_no_fbx(out: Path) -> None:
    """Raise MotionFileError for a name that asks for FBX."""
    if out.suffix.lower() == ".fbx":
        raise MotionFileError(
            f"--out {out}: FBX is never written, as its format is not open; write "
            f"{out.with_suffix('.glb')}, which Blender, Unity, Unreal and Godot read, and Blender "
            "exports it as FBX if need be."
        )


def write(
    motion: Motion, path: Path, root_motion: str | None = None, program: Program = ANY
) -> list[str]:
    """Write a motion as what its name ends in says, for a program; what to say of how it was written."""
    ending, names = path.suffix.lower(), motion.skeleton.names
    if ending == ".bvh":
        its = {"units": program.units, "up": program.up, "names": program.names}
        write_bvh(motion, path, root_motion=root_motion, **its)
        written = file_names(names, program.names, path)
        metres = ["in metres: motionlab reads it back with --units m"] * (program.units == "m")
        return [*metres, *_renamed(names, written), *about_root(root_motion, written)]
    if ending == ".glb":
        write_gltf(motion, path, root_motion=root_motion)
        return about_root(root_motion, motion.skeleton.point_names)
    if root_motion == "ground":
        raise MotionFileError(
            f"{path}: files in {ending} get no root joint on the floor; leave --root-motion out, or "
            "write .glb or .bvh."
        )
    motion = in_place(motion) if root_motion else motion
    if ending == ".usda":
        write_usd(motion, path)
        renamed = _renamed(motion.skeleton.point_names, joint_names(motion.skeleton))
        return [*renamed, *about_root(root_motion, ())]
    write_mjcf(motion, path)
    return about_root(root_motion, ())


def about_root(root_motion: str | None, names: Sequence[str]) -> list[str]:
    """What became of way and heading; names : of the file's joints, as they are written."""
    if root_motion is None:
        return []
    if root_motion == "in-place":
        return ["in place"]
    # whether the file had one or not: it is none of the joints, as reading folds it into the body
    called = root_name(names)
    why = (
        ""
        if called == NAME
        else f", as there is {next(n for n in names if alike(n, NAME))} already"
    )
    return [f"below a root joint on the floor, called {called}{why}, for way and heading"]


def _renamed(before: Sequence[str], after: Sequence[str]) -> list[str]:
    """How many names a format could not have, and one of them."""
    pairs = [pair for pair in zip(before, after, strict=True) if pair[0] != pair[1]]
    if not pairs:
        return []
    return [f"{len(pairs)} of {len(before)} names changed, as {pairs[0][0]} to {pairs[0][1]}"]
