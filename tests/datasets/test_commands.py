"""The command line."""

import os
import subprocess
import sys

import pytest

from motionlab.__main__ import main

# requests leaves a socket to the garbage collector if the server says 404
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "motionlab", *arguments],
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env={**os.environ, "PYTHONIOENCODING": "utf-8", **environment},
        timeout=120,
    )


def test_list(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    assert main(["data", "list"]) == 0
    rows = {line.split()[0]: line for line in capsys.readouterr().out.splitlines() if line}
    assert "1067" in rows["bandai-locomotion"] and "non-commercial" in rows["bandai-locomotion"]
    assert "always" in rows["gaits"] and " no " in rows["cmu"]
    assert not list(tmp_path.iterdir())  # looking writes nothing


def test_fetch_does_not_download_unconfirmed(tmp_path):
    done = run("data", "fetch", "accad", MOTIONLAB_DATA="", XDG_CACHE_HOME=str(tmp_path))
    assert done.returncode == 1
    assert "CC BY 3.0" in done.stdout and "7.4 MB" in done.stdout
    assert "not a terminal: pass --yes" in done.stderr and "Traceback" not in done.stderr
    assert "confirm with y" not in done.stderr


@pytest.mark.parametrize("arguments", [[], ["data"], ["data", "fetch"], ["dance"]])
def test_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2


def test_unknown_data_set(capsys):
    assert main(["data", "fetch", "amass"]) == 1
    assert "bandai-locomotion" in capsys.readouterr().err


def test_version(capsys):
    assert main(["version"]) == 0
    assert "torch" in capsys.readouterr().out


def test_gaits_have_no_files(capsys):
    assert main(["data", "fetch", "gaits"]) == main(["data", "verify", "gaits"]) == 0
    assert capsys.readouterr().out.count("no files") == 2


def test_fetch_and_verify(toy, capsys):
    toy.serve()
    assert main(["data", "verify", "toy"]) == 1
    printed = capsys.readouterr()
    assert "0 of 3 files right, 0 wrong, 3 absent" in printed.out
    assert "MOTIONLAB_DATA" in printed.err and "data fetch toy" in printed.err
    assert main(["data", "fetch", "toy", "--yes"]) == 0
    assert "CC BY-NC 4.0 (non-commercial)" in capsys.readouterr().out
    assert main(["data", "fetch", "toy"]) == 0
    assert "all 3 files are at hand" in capsys.readouterr().out
    assert main(["data", "verify"]) == 0
    assert "3 of 3 files right" in capsys.readouterr().out


def test_verify_of_everything_bears_absent_clips_unless_all_are(toy, capsys):
    toy.serve()
    assert main(["data", "verify"]) == 1
    assert "absent: 3 of toy" in capsys.readouterr().out
    main(["data", "fetch", "toy", "--yes"])
    wrong = toy.cache / "clips/toy/toy/02.bvh"
    wrong.unlink()
    capsys.readouterr()
    assert main(["data", "verify"]) == 0
    assert "2 of 3 files right, 0 wrong, 1 absent\nabsent: 1 of toy" in capsys.readouterr().out
    assert main(["data", "verify", "toy"]) == 1
    wrong.write_bytes(b"rot")
    assert main(["data", "verify"]) == 1


def test_fetch_mends_what_verify_finds(toy, capsys):
    toy.serve()
    main(["data", "fetch", "toy", "--yes"])
    (toy.cache / "clips/toy/toy/02.bvh").write_bytes(b"rot")
    assert main(["data", "verify", "toy"]) == 1
    assert "02.bvh: is not the file it should be" in capsys.readouterr().err
    assert main(["data", "fetch", "toy", "--yes"]) == 0
    assert main(["data", "verify", "toy"]) == 0


@pytest.mark.parametrize(("answer", "code"), [("y", 0), ("n", 1), ("", 1)])
def test_fetch_asks(toy, monkeypatch, answer, code, capsys):
    toy.serve()
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda _: answer)
    assert main(["data", "fetch", "toy"]) == code
    assert (len(toy.server.requests) == 3) == (code == 0)


def test_fetch_without_network(toy, capsys):
    assert main(["data", "fetch", "toy", "--yes"]) == 1
    assert "404" in capsys.readouterr().err
