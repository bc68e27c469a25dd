"""What every result says about itself, how it is written, and how a script is run."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import torch

import motionlab
from motionlab import metrics
from motionlab.training import Prepared
from motionlab.training.checkpoints import write_whole


def run(main: Callable[[], None]) -> None:
    """Run a script's main; what motionlab refuses is a sentence then, not a traceback."""
    try:
        main()
    except motionlab.MotionLabError as error:
        sys.exit(f"{script()[-1]}: {error}")


def script() -> list[str]:
    """What python was given to run: -m and the name of a module, or else a file."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    return ["-m", spec.name] if spec else [sys.argv[0]]


def command() -> list[str]:
    """The command line that was given, word by word."""
    return ["python", *script(), *sys.argv[1:]]


def provenance(begin: float, seed: int, data: Prepared, **more) -> dict:
    """Where numbers come from; `begin` is the `time.perf_counter` at which the work began."""
    return {
        "command": " ".join(command()),
        "code_version": motionlab.__version__,
        "data_hash": data.hash,
        "seed": seed,
        **more,
        "machine": platform.platform(),
        "torch": torch.__version__,
        "seconds": round(time.perf_counter() - begin, 1),
    }


def about_weights(model: torch.nn.Module, path: Path) -> dict:
    """What tells these weights from others."""
    return {
        "file": path.name,
        "sha256": model.hash,
        "preset": model.about.get("preset"),
        "update": model.about.get("update"),
        "sampling": model.sampling,
    }


def write(result: dict, path: str | os.PathLike) -> None:
    """One JSON file; numbers to four digits, what is not finite as null."""
    text = json.dumps(rounded(result), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    write_whole(path, lambda stream: stream.write(text.encode()))
    print(path)


def rounded(value):
    """Fit for JSON."""
    if isinstance(value, metrics.Interval):
        return rounded(value._asdict())
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.4g}") if math.isfinite(value) else None
    return value
