"""What tests share: real clips, where there are any, the book's extensions; and what was not tested and why."""

from __future__ import annotations

import importlib.util
import os
import zipfile
from collections import Counter
from pathlib import Path

import hypothesis
import pytest

hypothesis.settings.register_profile("motionlab", deadline=None)  # a busy machine is no fault
hypothesis.settings.load_profile("motionlab")

DATA = os.environ.get("MOTIONLAB_DATA")
if DATA:  # some tests run elsewhere
    os.environ["MOTIONLAB_DATA"] = DATA = str(Path(DATA).resolve())

# Two processes with two threads each take turns on two cores, and wait for each other: half as fast.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch reads it when it is imported

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # a test run is nobody's business

SOURCES = ("accad", "aclstm-cmu", "bandai-actions", "bandai-locomotion", "cmu")


@pytest.fixture(scope="session")
def recorded_clips() -> Path:
    """The folder of recorded clips; without MOTIONLAB_DATA the test is skipped."""
    if not DATA:
        pytest.skip("no recorded clips: let MOTIONLAB_DATA name their folder (README.md, Data)")
    return Path(DATA)


@pytest.fixture(scope="session")
def real_clips(recorded_clips) -> dict[str, dict[str, bytes]]:
    """Three clips of each source, by their path: the first, a middle one, the last.

    A source that is not there is a failure.
    """
    return {source: _sample(recorded_clips, source) for source in SOURCES}


def pytest_terminal_summary(terminalreporter) -> None:
    """Say what was skipped and how to have it: a skip that nobody sees is a test that nobody has."""
    reasons: Counter[str] = Counter()
    for report in terminalreporter.stats.get("skipped", []):
        reason = report.longrepr[2].removeprefix("Skipped: ")
        if reason.startswith("could not import"):
            reason = f"{reason.split(':')[0]}: pip install -r requirements-lock.txt"
        reasons[reason] += 1
    if reasons:
        terminalreporter.section("not tested here, and how to have it")
    for reason, count in reasons.most_common():
        terminalreporter.write_line(f"{count:4} x  {reason}")


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


@pytest.fixture(scope="session")
def extension():
    """An extension of Sphinx in book/_ext by its name, which may be that of another module."""

    def load(name):
        for package in ("sphinx", "bs4"):
            pytest.importorskip(package)
        path = Path(__file__).parents[1] / "book" / "_ext" / f"{name}.py"
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return load
