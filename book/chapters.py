"""The pages that hold code: executed side by side, and not again while nothing they stand on changed.

What a page made is kept in book/_build/executed/NAME: the executed page, the scripts that it leaves
for the book, and a record with a fingerprint of all that decides what comes out. A folder appears
whole or not at all, so that a build may be interrupted at any time.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path

import nbformat
import yaml
from execute import ROOT, read_page

BOOK = ROOT / "book"
EXECUTED = BOOK / "_build" / "executed"
FORMAT = 1  # raise it when what is kept changes
TELL_EVERY = 30  # seconds
# What pages may read besides themselves: the library, results, and what verdicts are computed by.
READS = ("src/motionlab", "results", "experiments", "examples")
NOT_READ = {"__pycache__", ".ipynb_checkpoints"}


@dataclass
class Chapter:
    """A page that holds code."""

    path: Path
    store: Path = EXECUTED
    at: str = ""  # how far it is, while it is executed

    @property
    def name(self) -> str:
        return self.path.stem

    @property
    def folder(self) -> Path:
        return self.store / self.name

    @property
    def record(self) -> dict:
        """What is known of the last time it was executed; empty if that is not known for sure."""
        try:
            record = json.loads((self.folder / "record.json").read_text(encoding="utf-8"))
            return record if record["format"] == FORMAT else {}
        except (OSError, ValueError, KeyError, TypeError):
            return {}

    def executed(self) -> nbformat.NotebookNode | None:
        """The page with what its cells gave; None if it is not there, damaged or another's."""
        try:
            text = (self.folder / "page.ipynb").read_text(encoding="utf-8")
            page = nbformat.reads(text, as_version=4)
        except (OSError, ValueError, AttributeError, nbformat.ValidationError):
            return None
        return page if sources(page) == sources(read_page(self.path)) else None

    @property
    def shown(self) -> str:
        return _shown(self.path)


def _shown(path: Path) -> str:
    """A path as one would write it in the repository's root."""
    return path.relative_to(ROOT).as_posix() if ROOT in path.parents else str(path)


def sources(page: nbformat.NotebookNode) -> list[str]:
    return [cell.source for cell in page.cells if cell.cell_type == "code"]


def find() -> list[Chapter]:
    """All pages of the table of contents that hold code, in its order."""
    toc = yaml.safe_load((BOOK / "_toc.yml").read_text(encoding="utf-8"))
    pages = [toc["root"], *(c["file"] for part in toc["parts"] for c in part["chapters"])]
    paths = [ROOT / f"{page}{end}" for page in pages for end in (".ipynb", ".md")]
    return [Chapter(path) for path in paths if path.is_file() and read_page(path) is not None]


# -- what decides what comes out ------------------------------------------------------------------


def surroundings() -> dict[str, str]:
    """Hashes of what all pages stand on, by what it is."""
    packages = {(d.name, d.version) for d in importlib.metadata.distributions()}
    settings = {(k, v) for k, v in os.environ.items() if k.startswith("MOTIONLAB_")}
    found = {
        "installed packages": [sys.version, *sorted(packages)],
        "MOTIONLAB_ settings": sorted(settings),
        "data at hand": data_at_hand(),
    }
    for folder in READS:
        paths = sorted(files_below([ROOT / folder]))
        read = lambda path: hashlib.sha256(path.read_bytes()).hexdigest()
        found[folder] = [(str(path.relative_to(ROOT)), read(path)) for path in paths]
    return {what: hashlib.sha256(repr(facts).encode()).hexdigest() for what, facts in found.items()}


def files_below(folders: Iterable[Path]) -> Iterable[Path]:
    for folder in folders:
        for path in folder.rglob("*"):
            if path.is_file() and not NOT_READ.intersection(path.parts):
                yield path


def data_at_hand() -> list[tuple[str, int, int]]:
    """Files of recorded motion that pages could find, with size and date."""
    from motionlab.datasets.files import cache_folder

    named = os.environ.get("MOTIONLAB_DATA")
    folders = [cache_folder() / "clips", *([Path(named).resolve()] if named else [])]
    facts = ((path, path.stat()) for path in files_below(folders))
    return sorted((str(path), fact.st_size, fact.st_mtime_ns) for path, fact in facts)


def fingerprint(chapter: Chapter) -> str:
    """Of a page's code; its words decide nothing."""
    page = read_page(chapter.path)
    code = [(c.source, c.metadata) for c in page.cells if c.cell_type == "code"]
    facts = json.dumps([code, page.metadata.get("kernelspec")], sort_keys=True)
    return hashlib.sha256(facts.encode()).hexdigest()


def why(chapter: Chapter, around: dict[str, str]) -> str:
    """Why it is to be executed; empty if it ran well on what there is now."""
    record = chapter.record
    if not record:
        return "was not executed yet"
    if record["error"]:
        return "failed last time"
    if record["of"] != fingerprint(chapter) or chapter.executed() is None:
        return "its code changed"
    was = record["around"]
    changed = [what for what in around if was.get(what) != around[what]]
    return f"changed: {', '.join(changed)}" if changed or len(was) != len(around) else ""


def good(chapter: Chapter, around: dict[str, str]) -> bool:
    """Was it executed without an error, on what there is now?"""
    return not why(chapter, around)


# -- executing them -------------------------------------------------------------------------------


@dataclass
class Workers:
    """Processes that execute pages, so that they can be stopped."""

    say: Callable[[str], None]
    begin: float = field(default_factory=time.monotonic)
    processes: set[subprocess.Popen] = field(default_factory=set)
    stopped: bool = False

    @property
    def minutes(self) -> str:
        return f"{(time.monotonic() - self.begin) / 60:5.1f} min"

    def execute(self, chapter: Chapter, around: dict[str, str]) -> None:
        """Execute a page; its folder is replaced when all of it is there."""
        if self.stopped:
            return
        chapter.store.mkdir(parents=True, exist_ok=True)
        of, begun = fingerprint(chapter), time.time()
        with tempfile.TemporaryDirectory(
            dir=chapter.store, prefix=".", ignore_cleanup_errors=True
        ) as new:
            said = self._run(chapter, Path(new))
            record = _read(Path(new) / "record.json") or {"error": said, "cells": 0}
            record |= {"format": FORMAT, "of": of, "around": around, "begun": begun}
            (Path(new) / "record.json").write_text(json.dumps(record), encoding="utf-8")
            if self.stopped:
                return
            shutil.rmtree(chapter.folder, ignore_errors=True)
            os.replace(new, chapter.folder)

    def _run(self, chapter: Chapter, new: Path) -> dict | None:
        """Run execute.py; what it ended with, if it left no record."""
        command = [sys.executable, str(BOOK / "execute.py"), str(chapter.path), "--into", str(new)]
        with (new / "log.txt").open("w+", encoding="utf-8", errors="replace") as log:
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=log, text=True, start_new_session=True
            ) as process:  # a session of its own: Ctrl-C reaches it by `stop` alone
                self.processes.add(process)
                for line in process.stdout:
                    cell, of = json.loads(line)
                    chapter.at = f"cell {cell} of {of}"
            self.processes.discard(process)
            log.seek(0)
            end = "\n".join(log.read().strip().splitlines()[-5:])
        return {"cell": 0, "of": 0, "source": "", "traceback": "",
                "message": f"it could not be executed (exit status {process.returncode}).\n{end}"}  # fmt: skip

    def stop(self) -> None:
        """End what is under way; its kernels end with it."""
        self.stopped = True
        for process in list(self.processes):
            process.send_signal(signal.SIGTERM)
        for process in list(self.processes):
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()


def execute(
    chapters: Sequence[Chapter], around: dict[str, str], jobs: int, say: Callable[[str], None]
) -> None:
    """Execute pages, `jobs` at a time, those that took longest last time first; tells how it goes.

    An error in one leaves the others alone, and is in its record. Interrupted, it ends what is under
    way and keeps what is done.
    """
    workers, left = Workers(say), set()
    usual = lambda c: (c.record.get("processor_seconds", 0), c.path.stat().st_size)
    with ThreadPoolExecutor(jobs) as pool:
        try:
            by_future = {}
            for chapter in sorted(chapters, key=usual, reverse=True):
                by_future[pool.submit(workers.execute, chapter, around)] = chapter
            left = set(by_future)
            while left:
                done, left = wait(left, TELL_EVERY, FIRST_COMPLETED)
                for future in done:
                    _finish(future, by_future[future])
                    _tell_end(by_future[future], len(left), workers)
                if not done:
                    _tell_stand([by_future[f] for f in left], workers)
        except BaseException:
            workers.stopped = True
            pool.shutdown(wait=False, cancel_futures=True)
            workers.stop()
            raise


def _finish(future: Future, chapter: Chapter) -> None:
    """Raise what kept a page from being kept, such as a full disk, with the page's name."""
    try:
        future.result()
    except OSError as error:
        raise OSError(error.errno, error.strerror, chapter.shown) from error


def _tell_end(chapter: Chapter, left: int, workers: Workers) -> None:
    record = chapter.record
    error = record["error"]
    how = f"FAILED at cell {error['cell']} of {error['of']}" if error else "done"
    took = f" in {record['seconds'] / 60:.1f} min" if "seconds" in record else ""
    workers.say(f"{workers.minutes}  {chapter.name}: {how}{took}; {left} left")


def _tell_stand(chapters: Sequence[Chapter], workers: Workers) -> None:
    under_way = [f"{c.name} ({c.at})" for c in chapters if c.at]
    workers.say(f"{workers.minutes}  at work: {', '.join(under_way)}; {len(chapters)} left")


def _read(path: Path) -> dict | None:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def told(chapter: Chapter) -> str:
    """What stopped a page, where, and what to do, for a person."""
    error = chapter.record["error"]
    where = f", cell {error['cell']} of {error['of']}:" if error["cell"] else ":"
    source = "".join(f"\n    {line}" for line in error["source"].splitlines())
    return (
        f"{chapter.shown}{where}{source}\n  {error['message']}\n"
        f"  alone, with all it says: {_shown(Path(sys.executable))} book/execute.py {chapter.shown}"
    )


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
