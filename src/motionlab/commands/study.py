"""`motionlab study`: people judge motions: a page for them, and what their answers say."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg, subcommand

from ..datasets.report import Report
from ..errors import MotionFileError, MotionLabError, StudyError
from ..io.motion_file import is_motion, read_motion
from ..io.readings import Readings
from .choices import chosen, shown_first
from .clips import files_of
from .folder import Taken, check_there
from .options import as_options

DESIGNS = ("ratings", "pairs")


@shown_first(
    "paths", "out", "design", "title", "contact", "clips", "seconds", "replays", "checks", "reveal",
    "seed", "force",
)  # fmt: skip
@dataclass(kw_only=True)
class Build(Taken):
    """A page on which people judge motions, from disk and offline, and the key to it.

    Of one folder, each folder in it is a method; of several, each is one; a file alone is one, too.
    Folders inside a method's are gaits: METHOD/walk/1.bvh.
    """

    paths: Positional[Annotated[tuple[Path, ...], arg(metavar="FOLDER|FILE ...")]]
    """Motions, in a folder for each method."""
    out: Path
    """Page to write, NAME.html; the key that tells which clip is whose is written beside it as
    NAME.json: keep that to yourself."""
    design: str = "ratings"
    """ratings: one clip at a time, from 1 to 5. pairs: two side by side, or no difference."""
    title: str = "How do these motions look?"
    """Stands at the top of the page."""
    contact: str = ""
    """To whom raters send their file and questions, in words."""
    clips: int | None = None
    """Of each method in each gait; 7 for ratings and 3 for pairs if left out."""
    seconds: float | None = None
    """Length of a clip; that of the shortest if left out."""
    replays: int = 2
    """How often a clip may be seen again."""
    checks: int = 2
    """Items that ask for one answer, and tell who does not look."""
    reveal: bool = False
    """Show raters at the end what their own answers say; then the page's source tells whose clip is
    whose, so not for a study that is to count."""
    seed: int = 0
    """Start of all chance: which clips, and in which orders."""
    force: bool = False
    """Replace files that are there already."""

    def run(self) -> None:
        from ..studies.build import build
        from ..studies.page import study_page

        if self.out.suffix.lower() != ".html":
            raise StudyError(f"--out {self.out}: the name must end in .html.")
        key = self.out.with_suffix(".json")
        for file in (self.out, key):
            if file.exists() and not self.force:
                raise StudyError(
                    f"{file}: is there already; --force overwrites it. Answers to a study that was "
                    "built before count for that one alone."
                )
        made = build(
            list(self._sources()), title=self.title, design=chosen("--design", self.design, DESIGNS),
            clips=self.clips, seconds=self.seconds, replays=self.replays, checks=self.checks,
            contact=self.contact, seed=self.seed,
        )  # fmt: skip
        for note in made.notes:
            print(f"note: {note}")
        page, study = study_page(made, reveal=self.reveal), made.study
        _write(key, study.to_json())
        _write(self.out, page)
        checks = sum(item.asks is not None for item in study.items)
        print(
            f"{self.out}: {len(study.items)} items ({checks} of them checks), {len(study.methods)} methods "
            f"({', '.join(study.methods)}), gaits: {', '.join(study.gaits)}; {study.seconds:g} s each, "
            f"{study.fps:g} fps, {len(study.orders)} orders, {len(page) / 1e6:.1f} MB; give it to raters"
        )
        print(f"{key}: the key; raters must not have it")

    def _sources(self) -> Iterator:
        """All motions by method and gait; raises MotionLabError with all files that can't be read."""
        from ..studies.build import Source

        found = list(_files(self.paths))
        said = self.answers()
        if said and len(self.paths) > 1:
            raise StudyError(
                "--by-file: is of one folder's files; name one that holds all methods."
            )
        how = Readings(self.paths[0], [file for *_, file in found], self.how(), said)
        report, sources = Report(Path("."), len(found)), []
        for method, gait, file in found:
            with report.of(file, file.stem):
                motion, doubts = read_motion(file, how.of(file))
                report.doubt(file, doubts)
                sources.append(Source(motion, method, gait, file.as_posix()))
        for note in report.notes():
            print(f"note: {as_options(note)}")
        if report.faults:
            raise MotionFileError("\n".join(map(as_options, report.faults)))
        return iter(sources)


def _files(paths: tuple[Path, ...]) -> Iterator[tuple[str, str, Path]]:
    """Method, gait and path of each file."""
    for path in paths:
        check_there(path)
    if not paths:
        raise StudyError("name a folder of motions, or several: one for each method.")
    methods = list(paths)
    if len(paths) == 1 and paths[0].is_dir():
        inside = sorted(p for p in paths[0].iterdir() if p.is_dir() and not p.name.startswith("."))
        loose = [p for p in paths[0].iterdir() if p.is_file() and is_motion(p)]
        if inside and loose:
            raise StudyError(
                f"{paths[0]}: holds folders, which are methods, and files beside them, such as "
                f"{loose[0].name}: put these into a folder of their method."
            )
        methods = inside or methods
    names = [m.resolve().name if m.is_dir() else m.stem for m in methods]
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"two methods are called {name}; rename one's folder or file.")
    for name, path in zip(names, methods, strict=True):
        for file in files_of(path) if path.is_dir() else [path]:
            inner = file.relative_to(path).parts[:-1] if path.is_dir() else ()
            yield name, inner[0] if inner else "all", file


@dataclass(kw_only=True)
class Analyse:
    """What raters' files say: means, tests, agreement; files that don't count are named."""

    folder: Positional[Annotated[Path, arg(metavar="FOLDER")]]
    """That holds the files which raters saved."""
    study: Path | None = None
    """The key, NAME.json, that was written with the page; if left out, it is looked for in the folder
    and beside it."""
    difference: float | None = None
    """That is to be told: how many raters would it take? In points; for pairs, beyond half, as 0.1."""
    out: Path | None = None
    """JSON file to write, of all numbers and all files left out."""
    simulated: bool = False
    """Analyse answers that a program made, instead of people's."""
    seed: int = 0
    """Start of the bootstrap."""

    def run(self) -> None:
        import json

        from ..studies.analysis import analyse
        from ..studies.answers import read_answers
        from ..studies.report import in_words, left_out
        from ..studies.study import read_study

        study = read_study(self._key() if self.study is None else self.study)
        answers, out = read_answers(self.folder, study, simulated=self.simulated)
        if not answers:
            said = "\n".join(left_out(out)).strip()
            kind = "simulated answers" if self.simulated else "answers of people"
            hint = ""
            if not self.simulated and any("made by a program" in left.why for left in out):
                hint = " --simulated analyses those that a program made."
            raise StudyError(f"{self.folder}: no {kind} that count.{hint}\n{said}".strip())
        found = analyse(study, answers, difference=self.difference, seed=self.seed)
        print(in_words(found, out))
        if self.out is not None:
            files = [{"file": o.file.name, "why": o.why, "by_rule": o.rule} for o in out]
            _write(
                self.out, json.dumps({**json.loads(found.to_json()), "left_out": files}, indent=1)
            )
            print(f"\n{self.out}: all numbers, and all {len(out)} files left out")

    def _key(self) -> Path:
        """The one study in the folder or beside it."""
        from ..studies.study import FORMAT

        check_there(self.folder)
        for place in (self.folder, self.folder.resolve().parent):
            if not place.is_dir():
                continue
            keys = [file for file in sorted(place.glob("*.json")) if _begins(file, FORMAT)]
            if len(keys) == 1:
                return keys[0]
            if keys:
                raise StudyError(
                    f"{place}: holds {len(keys)} studies; name one with --study, such as {keys[0]}."
                )
        raise StudyError(
            f"{self.folder}: no study is in it or beside it; name the key that was written with the "
            "page: --study NAME.json."
        )


def _begins(file: Path, name: str) -> bool:
    try:
        with file.open("rb") as stream:
            return name.encode() in stream.read(200)
    except OSError:
        return False


@dataclass(kw_only=True)
class Simulate:
    """Answers made by a program, of a known truth, to try an analysis before anybody is asked."""

    study: Positional[Annotated[Path, arg(metavar="NAME.json")]]
    """The key that was written with the page."""
    out: Path
    """Folder for the files of answers."""
    raters: int = 25
    """How many."""
    careless: float = 0.1
    """Share of them who answer anything."""
    seed: int = 0
    """Start of all chance."""

    def run(self) -> None:
        from ..studies import simulate
        from ..studies.study import read_study

        study = read_study(self.study)
        felt = simulate.spaced(study)
        write = lambda: simulate.write_answers(
            study, self.out, felt, raters=self.raters, careless=self.careless, seed=self.seed
        )
        files = _on_disk(self.out, write)
        print(f"{self.out}: {len(files)} files of simulated answers; no person has judged anything")
        if study.design == "pairs":
            told = {name: f"strength {value:+.2f}" for name, value in felt.items()}
        else:
            told = {name: f"mean {simulate.expected(value):.2f}" for name, value in felt.items()}
        print("the truth: " + ", ".join(f"{name} {value}" for name, value in told.items()))


def _write(path: Path, text: str) -> None:
    from ..training.checkpoints import write_whole

    _on_disk(path, lambda: write_whole(path, lambda stream: stream.write(text.encode())))


def _on_disk(path: Path, write: Callable):
    try:
        return write()
    except OSError as error:
        raise MotionLabError(
            f"{path}: can't be written ({error.strerror}); check folder and rights."
        ) from error


@dataclass
class StudyCommand:
    """People judge motions: a page for them, and what their answers say."""

    command: (
        Annotated[Build, subcommand("build")]
        | Annotated[Analyse, subcommand("analyse")]
        | Annotated[Simulate, subcommand("simulate")]
    )

    def run(self) -> None:
        self.command.run()
