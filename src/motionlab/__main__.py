"""python -m motionlab ...: the command line."""

from __future__ import annotations

import os
import sys
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import DisallowNone, OmitSubcommandPrefixes, Positional, arg, subcommand

from .commands.clean import Clean
from .commands.convert import Convert, Retarget
from .commands.design import Design
from .commands.doctor import Doctor
from .commands.evaluate import Evaluate
from .commands.export import Export
from .commands.info import Info
from .commands.look import Look
from .commands.options import as_options
from .commands.prepare import Prepare
from .commands.reproduce import Reproduce
from .commands.sample import Sample
from .commands.study import StudyCommand
from .commands.train import Train
from .errors import MotionLabError

NO_FILES = "gaits are made on the spot and have no files."


@dataclass
class List:
    """Data sets with size, licence, and whether they are at hand."""

    def run(self) -> None:
        from .datasets import files, info, names, registry

        print(f"{'name':20} {'clips':>5} {'minutes':>7} {'MB':>6}  {'at hand':9} licence")
        for name in names():
            about = info(name)
            if name == registry.GAITS:
                here = "always"
            else:
                wanted = registry.files_of(registry.members(name))
                count = len(wanted) - len(files.missing(wanted))
                here = (
                    "yes" if count == len(wanted) else f"{count}/{len(wanted)}" if count else "no"
                )
            licence = "as the sources" if name in registry.MIXED else about.licence
            print(
                f"{name:20} {about.clips:5} {about.minutes:7.1f} {about.bytes / 1e6:6.1f}  "
                f"{here:9} {licence}"
            )
        print(f"\nfiles are kept in {files.cache_folder()}")
        print(f"MOTIONLAB_DATA: {files.data_folder() or 'not set'}")


@dataclass
class Fetch:
    """Download a data set's files; shows size and licence first."""

    name: Positional[Annotated[str, arg(metavar="NAME")]]
    """Data set, as `data list` names it."""
    yes: bool = False
    """Download without asking."""

    def run(self) -> None:
        from .datasets import files, info, registry

        if self.name == registry.GAITS:
            print(NO_FILES)
            return
        wanted = registry.files_of(registry.members(self.name))
        damaged = {file for file, fault in files.verify(wanted) if fault}
        absent = files.missing(wanted) + [file for file in wanted if file in damaged]
        if not absent:
            print(f"{self.name}: all {len(wanted)} files are at hand.")
            return
        print(info(self.name))
        print(
            f"\n{len(absent)} of {len(wanted)} files, {sum(f.bytes for f in absent) / 1e6:.1f} MB, "
            f"to {files.cache_folder()}"
        )
        if not self.yes:
            _confirm()
        files.fetch(absent, self.name)
        print(f"{self.name}: {len(absent)} files downloaded and checked.")


@dataclass
class Verify:
    """Check every file against its SHA-256. Fails if one is wrong, or absent from a named set."""

    name: Positional[Annotated[str | None, arg(metavar="[NAME]")]] = None
    """Data set; all of them if left out."""

    def run(self) -> None:
        from tqdm import tqdm

        from .datasets import files, registry

        if self.name == registry.GAITS:
            print(NO_FILES)
            return
        clips = registry.members(self.name) if self.name else registry.clips()
        wanted = registry.files_of(clips)
        bar = tqdm(total=len(wanted), desc="checking", unit="file", leave=False, delay=1)
        found = {}
        with bar:
            for file, fault in files.verify(wanted):
                found[file] = fault
                bar.update()
        faults = [fault for fault in found.values() if fault]
        absent = Counter(file.source for file in wanted if file not in found)
        what = self.name or "all data sets"
        print(
            f"{what}: {len(found) - len(faults)} of {len(wanted)} files right, {len(faults)} wrong, "
            f"{absent.total()} absent"
        )
        if absent:
            print("absent: " + ", ".join(f"{count} of {name}" for name, count in absent.items()))
        if absent and (self.name or not found):
            faults.append(
                f"{absent.total()} files are not on this machine; let MOTIONLAB_DATA name the "
                f"folder that holds them, or run `python -m motionlab data fetch "
                f"{self.name or next(iter(absent))}`."
            )
        if faults:
            raise MotionLabError("\n".join(faults))


@dataclass
class Data:
    """Named data sets: list, fetch, verify."""

    command: (
        Annotated[List, subcommand("list")]
        | Annotated[Fetch, subcommand("fetch")]
        | Annotated[Verify, subcommand("verify")]
    )

    def run(self) -> None:
        self.command.run()


@dataclass
class Version:
    """Versions of motionlab and of what it stands on, for a report of a fault."""

    def run(self) -> None:
        import platform

        import torch

        from .version import __version__

        print(f"motionlab {__version__}, torch {torch.__version__}, Python {sys.version.split()[0]}, "
              f"{platform.platform()}")  # fmt: skip


COMMANDS = (
    Annotated[Data, subcommand("data")]
    | Annotated[Info, subcommand("info")]
    | Annotated[Look, subcommand("look")]
    | Annotated[Convert, subcommand("convert")]
    | Annotated[Retarget, subcommand("retarget")]
    | Annotated[Clean, subcommand("clean")]
    | Annotated[Prepare, subcommand("prepare")]
    | Annotated[Train, subcommand("train")]
    | Annotated[Evaluate, subcommand("evaluate")]
    | Annotated[Sample, subcommand("sample")]
    | Annotated[Design, subcommand("design")]
    | Annotated[Export, subcommand("export")]
    | Annotated[Reproduce, subcommand("reproduce")]
    | Annotated[StudyCommand, subcommand("study")]
    | Annotated[Doctor, subcommand("doctor")]
    | Annotated[Version, subcommand("version")]
)


def _confirm() -> None:
    if sys.stdin is None or not sys.stdin.isatty():
        raise MotionLabError("Nothing was downloaded; not a terminal: pass --yes.")
    if input("Download? [y/N] ").strip().lower() not in ("y", "yes"):
        raise MotionLabError("Nothing was downloaded; confirm with y, or pass --yes.")


def _downward(arguments: Sequence[str]) -> list[str]:
    """Arguments in which `--up -z` is one word: by itself, -z would be taken for an option."""
    joined: list[str] = []
    for word in arguments:
        if joined and joined[-1] in ("--up", "--rig-up") and word in ("-x", "-y", "-z"):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


@contextmanager
def _plain_warnings(rate: str) -> Iterator[None]:
    """Warnings as a line for the person who typed the command, in its options, without the line of
    code they came from; rate : as `as_options` takes it."""
    before = warnings.formatwarning
    warnings.formatwarning = lambda message, *_, **__: f"note: {as_options(str(message), rate)}\n"
    try:
        yield
    finally:
        warnings.formatwarning = before


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; 0 if it went well, 1 if not, 2 for a command line that makes no sense."""
    # Windows consoles may not know every character of a path or an author's name.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    words = _downward(sys.argv[1:] if arguments is None else arguments)
    read = partial(
        tyro.cli,
        OmitSubcommandPrefixes[DisallowNone[COMMANDS]],
        prog="motionlab",
        args=words,
        description="Motion data and models.",
    )
    command, others = read(return_unknown_args=True)
    files = [word for word in others if Path(word).exists()]
    if others and not (hasattr(command, "path") and files == others):
        read()  # which says what is wrong, and exits
    rate = "--fps" if hasattr(command, "folder") else "--file-fps"  # that of files which are read
    try:
        if files:
            raise MotionLabError(
                f"{words[0]} {command.path} {' '.join(files)}: takes one file, or one folder of files; "
                "put these into a folder and name that."
            )
        with _plain_warnings(rate):
            command.run()
        sys.stdout.flush()
    except MotionLabError as error:
        print(f"motionlab: {as_options(str(error), rate)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of our words has enough, as `head` has
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
