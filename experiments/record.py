"""What every result says about itself, and how it is written."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import sys
import time
from pathlib import Path

import torch

import motionlab
from motionlab import metrics
from motionlab.training import Prepared


def provenance(begin: float, seed: int, data: Prepared, **more) -> dict:
    """Where numbers come from; `begin` is the `time.perf_counter` at which the work began."""
    return {
        "command": " ".join(["python", *sys.argv]),
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
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "preset": model.about.get("preset"),
        "update": model.about.get("update"),
        "sampling": model.sampling,
    }


def write(result: dict, path: str | os.PathLike) -> None:
    """One JSON file; numbers to four digits, what is not finite as null."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(rounded(result), indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
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
