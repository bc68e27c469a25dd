"""Timing of several jobs side by side, so that what else the machine does hits all of them."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

RESULTS = Path(__file__).parents[1] / "results"


def medians(
    jobs: dict[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Median seconds of each job, after one round that does not count.

    clock : `time.process_time` asks the processor, who knows how much of the time was ours. What runs
    in another process tells its seconds itself (`OtherBuild`).
    """
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for count in range(rounds + 1):
        for name, job in jobs.items():
            start = clock()
            told = job()
            if count:
                seconds[name].append(told if isinstance(told, float) else clock() - start)
    return {name: statistics.median(times) for name, times in seconds.items()}


class OtherBuild:
    """Jobs of a script as another build of the library does them, in a process of its own.

    tree : where that build lies, such as a worktree of an older commit. options : of the script, which
    calls `answer` with its jobs if it is told ``--answer``.
    """

    def __init__(self, tree: Path, options: list[str]) -> None:
        paths = [str(tree / "src"), os.environ.get("PYTHONPATH", "")]
        self.process = subprocess.Popen(
            [sys.executable, sys.argv[0], *options, "--answer"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
        )  # fmt: skip

    def job(self, name: str) -> Callable[[], float]:
        """To be called like any job; it tells the seconds."""

        def ask() -> float:
            self.process.stdin.write(f"{name}\n")
            self.process.stdin.flush()
            return float(self.process.stdout.readline())

        return ask

    def close(self) -> None:
        self.process.communicate()


def answer(
    jobs: dict[str, Callable[[], object]], clock: Callable[[], float] = time.perf_counter
) -> None:
    """Do the jobs that an `OtherBuild` asks for, and tell their seconds, until it closes."""
    for line in sys.stdin:
        start = clock()
        jobs[line.strip()]()
        print(clock() - start, flush=True)


def table(title: str, rows: list[tuple[str, str, str]]) -> None:
    print(title)
    for name, value, note in rows:
        print(f"  {name:<44}{value:>12}  {note}")


def verdict(ratio: float, limit: float) -> str:
    return f"{ratio:.2f} x, at most {limit:g}: {'holds' if ratio <= limit else 'MISSED'}"


def save(name: str, numbers: dict) -> None:
    """Write numbers to results/NAME.json."""
    RESULTS.mkdir(exist_ok=True)
    record = {"python": platform.python_version(), "machine": platform.machine(), **numbers}
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
