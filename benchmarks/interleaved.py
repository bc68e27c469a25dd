"""Timing of several jobs side by side, so that what else the machine does hits all of them."""

from __future__ import annotations

import json
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

RESULTS = Path(__file__).parents[1] / "results"


def medians(jobs: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Median seconds of each job, after one round that does not count."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for count in range(rounds + 1):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            if count:
                seconds[name].append(time.perf_counter() - start)
    return {name: statistics.median(times) for name, times in seconds.items()}


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
