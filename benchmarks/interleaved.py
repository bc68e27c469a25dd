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
    """Write numbers to results/NAME.json, with the machine, the day and the command that made them.

    load : how many programs wanted a processor in the last minute, this one among them.
    """
    RESULTS.mkdir(exist_ok=True)
    record = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "date": time.strftime("%Y-%m-%d"),
        "command": command(sys.argv),
        **(
            {"load": round(os.getloadavg()[0], 1), "peak memory (MB)": round(peak() / 1e6)}
            if os.name == "posix"
            else {}
        ),
        **numbers,
    }
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def peak() -> int:
    """Greatest memory of this process so far, in bytes: Python, torch and all jobs that it did."""
    import resource  # which Windows does not have

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def processor() -> str:
    """What the processor calls itself; empty if it does not say."""
    told = Path("/proc/cpuinfo")  # elsewhere than on Linux Python knows it
    lines = told.read_text(encoding="utf-8").splitlines() if told.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def command(arguments: list[str]) -> str:
    """How a script was called. A folder with another build is called by its commit, a file or program
    by its name: where it lay on somebody's machine tells nobody anything."""
    words = [f"benchmarks/{Path(arguments[0]).name}"]
    for argument in arguments[1:]:
        option, equals, value = argument.rpartition("=")
        path = Path(value)
        if path.is_dir():
            value = commit(value)
        elif path.is_absolute():
            value = path.name
        words.append(f"{option}{equals}{value}")
    return " ".join(["python", *words])


def commit(tree: Path | str) -> str:
    """The commit of a worktree, abbreviated; "unknown" if it is none."""
    asked = subprocess.run(
        ["git", "-C", str(tree), "rev-parse", "--short=7", "HEAD"],
        capture_output=True, text=True,
    )  # fmt: skip
    return asked.stdout.strip() or "unknown"
