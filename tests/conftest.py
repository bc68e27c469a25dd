"""What tests share: real clips, where there are any."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import pytest

if folder := os.environ.get("MOTIONLAB_DATA"):  # some tests run elsewhere
    os.environ["MOTIONLAB_DATA"] = str(Path(folder).resolve())

# Two processes with two threads each take turns on two cores, and wait for each other: half as fast.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch reads it when it is imported

SOURCES = ("accad", "aclstm-cmu", "bandai-actions", "bandai-locomotion", "cmu")


@pytest.fixture(scope="session")
def real_clips() -> dict[str, dict[str, bytes]]:
    """Three clips of each source, by their path: the first, a middle one, the last.

    Without MOTIONLAB_DATA the test is skipped; with it, a source that is not there is a failure.
    """
    folder = os.environ.get("MOTIONLAB_DATA")
    if not folder:
        pytest.skip("MOTIONLAB_DATA is not set: no real clips")
    return {source: _sample(Path(folder), source) for source in SOURCES}


def _sample(folder: Path, source: str) -> dict[str, bytes]:
    archive = folder / f"{source}.zip"
    if archive.exists():
        with zipfile.ZipFile(archive) as files:
            paths = sorted(name for name in files.namelist() if name.endswith(".bvh"))
            return {path: files.read(path) for path in _pick(paths)}
    paths = sorted((folder / source).rglob("*.bvh"))
    assert paths, f"{folder} holds neither {source}.zip nor BVH files under {source}/"
    return {path.as_posix(): path.read_bytes() for path in _pick(paths)}


def _pick(paths: list) -> list:
    return [paths[0], paths[len(paths) // 2], paths[-1]]
