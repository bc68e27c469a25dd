"""How many threads for the chapters of the book, and what executing them side by side is worth.

    MOTIONLAB_DATA=folder python benchmarks/bench_chapters.py [--only 03 05] [--busy 2] [--save]

Each chapter is executed by book/execute.py on one thread and on two, alone and beside other programs
that want all of a core each; then all of them side by side, on one thread each, against one after
another on two, as the book was built until November 2026. Half an hour.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import tyro
from interleaved import save, table

BOOK = Path(__file__).parents[1] / "book"
sys.path.insert(0, str(BOOK))
import chapters  # noqa: E402

CAP = 3  # times what a chapter takes alone, after which it is ended: nobody would wait


@dataclass
class Options:
    only: tuple[str, ...] = ()
    """Beginnings of chapters' names; all if left out."""
    busy: int = 2
    """Other programs."""
    save: bool = False


@contextlib.contextmanager
def beside(programs: int) -> Iterator[None]:
    """While other programs compute."""
    command = [sys.executable, "-c", "while True: pass"]
    others = [subprocess.Popen(command) for _ in range(programs)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def cost(chapter: chapters.Chapter, threads: int, most: float | None) -> dict:
    """Seconds of a chapter by the clock and of processors; `most` if it was ended after so many."""
    with tempfile.TemporaryDirectory() as into:
        command = [sys.executable, str(BOOK / "execute.py"), str(chapter.path), "--into", into]
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
        silent = subprocess.DEVNULL
        process = subprocess.Popen(command, env=environment, stdout=silent, stderr=silent)
        try:
            process.wait(most)
        except subprocess.TimeoutExpired:
            process.terminate()
            process.wait()
            return {"more than": most}
        record = json.loads((Path(into) / "record.json").read_text())
    if record["error"]:
        sys.exit(f"{chapter.shown}: {record['error']['message']}")
    return {key: record[key] for key in ("seconds", "processor_seconds")}


def measured(chapter: chapters.Chapter, busy: int) -> dict[str, dict]:
    """What a chapter costs on one thread and two, alone and beside others; prints it."""
    rows, most = {}, None
    for others in (0, busy):
        with beside(others):
            for threads in (1, 2):
                rows[f"{threads} threads, {others} busy"] = cost(chapter, threads, most)
                most = most or CAP * rows["1 threads, 0 busy"]["seconds"]
    alone = rows["1 threads, 0 busy"]["seconds"]
    lines = []
    for name, row in rows.items():
        seconds, over = row.get("seconds", row.get("more than")), "seconds" not in row
        lines.append(
            (name, f"{'> ' * over}{seconds:.0f} s", f"{'> ' * over}{seconds / alone:.2f} x")
        )
    table(chapter.name, lines)
    return rows


def side_by_side(some: list[chapters.Chapter], jobs: int) -> float:
    """Seconds until all are executed, on one thread each."""
    with tempfile.TemporaryDirectory() as store:
        begin = time.perf_counter()
        fresh = [chapters.Chapter(chapter.path, Path(store)) for chapter in some]
        chapters.execute(fresh, {}, jobs, lambda said: None)
        return time.perf_counter() - begin


def main(options: Options) -> None:
    os.environ.pop("OMP_NUM_THREADS", None)
    some = [c for c in chapters.find() if not options.only or c.name.startswith(options.only)]
    found = {chapter.name: measured(chapter, options.busy) for chapter in some}
    jobs = chapters.cores()
    before = sum(rows["2 threads, 0 busy"]["seconds"] for rows in found.values())
    now = side_by_side(some, jobs)
    with beside(options.busy):
        beside_others = side_by_side(some, jobs)
    ratios = {
        "side by side / one after another": now / before,
        "beside others / alone": beside_others / now,
    }
    table(
        f"all, {jobs} at a time", [(name, f"{ratio:.2f} x", "") for name, ratio in ratios.items()]
    )
    if options.save:
        save("bench_chapters", {"jobs": jobs, "chapters": found, "one after another": before,
                                "side by side": now, "beside others": beside_others, **ratios})  # fmt: skip


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
