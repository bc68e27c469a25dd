"""The README's commands and example do what it says."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_examples_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for example in blocks("python"):
        exec(compile(example, "README.md", "exec"), names)
    out = capsys.readouterr().out
    assert "300 frames, 10.00 s, 30 fps" in out
    travelled = float(re.search(r"travel ([\d.]+) m", out)[1])
    assert travelled == pytest.approx(14, rel=0.05)  # 10 s at 1.4 m/s
    assert names["features"].shape[:2] == (1, 300) and names["model"].start_names[2]
    import motionlab as ml

    written = ml.read_bvh("mirrored.bvh")
    assert written.fps == 60
    assert (written.positions()[::2] - names["mirrored"].positions()).abs().max() < 1e-4


@pytest.mark.skipif(
    shutil.which("make") is None, reason="no make on this machine: apt-get install make"
)
def test_make_knows_the_commands():
    targets = re.findall(r"^make (\w+)", "\n".join(blocks("sh")), re.MULTILINE)
    assert targets == ["book", "test"]
    for target in targets:
        run = subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr


def test_a_row_tells_what_each_command_needs():
    """One for each target of the Makefile and each command of the command line."""
    from motionlab.__main__ import COMMANDS

    section = README.partition("## What each command needs")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)`[^|]*\|(.*)\|$", section, re.MULTILINE)
    assert all(len(cells.split("|")) == 4 and cells.split("|")[1].strip() for _, cells in rows)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.search(r"^\.PHONY: (.*) active-environment$", makefile, re.MULTILINE)[1].split()
    commands = [command.__metadata__[0].name for command in get_args(COMMANDS)]
    wanted = [f"make {target}" for target in targets] + commands
    assert sorted(name for name, _ in rows) == sorted(wanted)


def test_the_data_commands_run(tmp_path):
    commands = re.findall(r"^python -m (motionlab .*?)(?:\s+#.*)?$", README, re.MULTILINE)
    assert commands == ["motionlab data list", "motionlab data fetch accad"]
    env = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    listing = subprocess.run(
        [sys.executable, "-m", *commands[0].split()], env=env, capture_output=True, text=True
    )
    assert listing.returncode == 0, listing.stderr
    assert "accad" in listing.stdout and "CC BY 3.0" in listing.stdout
    # fetching needs a network; without a terminal it asks for --yes and fetches nothing
    fetch = subprocess.run(
        [sys.executable, "-m", *commands[1].split()],
        env={k: v for k, v in env.items() if k != "MOTIONLAB_DATA"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert "CC BY 3.0" in fetch.stdout + fetch.stderr
    assert "Traceback" not in fetch.stderr


def test_the_network_s_commands_run(tmp_path, monkeypatch):
    """Those that need no data, as they stand there; the training shortened to one update."""
    pytest.importorskip("lightning_fabric")
    from motionlab import read_bvh, write_bvh
    from motionlab.__main__ import main
    from motionlab.datasets import gaits

    section = README.partition("## A trained network")[2]
    commands = re.findall(r"^motionlab (.*?)(?:\s+#.*)?$", section, re.MULTILINE)
    sample, still, walk, dance, export, prepare, train, *more = map(str.split, commands)
    tune, again, rival, manifold, dancer, game, mended = more
    # these need data, and minutes or hours
    assert prepare == ["prepare", "locomotion"]
    assert train[0] == dancer[0] == rival[0] == manifold[0] == "train"
    assert rival[1] == "pfnn" and manifold[1] == "strnn"
    assert game[:2] == ["train", "refiner-contacts"] and mended[3] == f"{game[-1]}/best.safetensors"
    monkeypatch.chdir(tmp_path)
    assert main(sample) == 0
    assert read_bvh("walk.bvh").seconds == 30
    assert main(still) == 0
    assert read_bvh("still_feet.bvh").seconds == 10
    Path("path.csv").write_text("x,z\n0,0\n0,1\n1,2\n", encoding="utf-8")
    assert main(walk) == 0
    assert read_bvh("round.bvh").seconds > 1.5
    assert main(dance) == 0
    assert read_bvh("dance.bvh").seconds == 30
    (tmp_path / "my_clips").mkdir()
    for speed in range(20):
        write_bvh(gaits.make(seconds=3, speed=1 + speed / 20), f"my_clips/walk_{speed}.bvh")
    assert main([*tune, "--updates", "1", "--accelerator", "cpu"]) == 0
    assert main(again) == 0
    assert read_bvh("mine.bvh").seconds == 10
    assert main([*mended[:3], "refiner-contacts", *mended[4:]]) == 0  # its own needs the data
    assert read_bvh("refined.bvh").seconds == 10
    pytest.importorskip("onnx")
    assert main(export) == 0 and Path("lstm-gmm-permissive.onnx").stat().st_size > 1e6


def test_the_commands_for_your_own_clips_run(tmp_path, monkeypatch, capsys):
    from motionlab import read_bvh, write_bvh
    from motionlab.__main__ import main
    from motionlab.datasets import gaits

    section = README.partition("## Your own clips")[2].partition("\n## ")[0]
    commands = re.findall(r"^motionlab (.*?)(?:\s+#.*)?$", section, re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    walk = gaits.make(seconds=1, speed=1.2)
    (tmp_path / "my_clips").mkdir()
    for name in ("my.bvh", "my_clips/a.bvh", "my_clips/b.bvh"):
        write_bvh(walk, name)
    larger = replace(walk.skeleton, offsets=1.2 * walk.skeleton.offsets)
    write_bvh(replace(walk[:1], skeleton=larger), "rig.bvh")
    for command in commands:
        assert main(command.split()) == 0, command
    assert len(commands) == 9 and "Traceback" not in capsys.readouterr().err
    assert read_bvh("on_rig.bvh").skeleton.matches(larger, 1e-3)
    made = {
        "my.html",
        "for_blender.glb",
        "my.glb",
        "on_rig.bvh",
        "clean.bvh",
        "calm.bvh",
        "calm.html",
        "dream.glb",
    }
    assert made <= {path.name for path in tmp_path.iterdir()}
    assert {path.name for path in (tmp_path / "for_the_engine").iterdir()} == {"a.glb", "b.glb"}


def test_the_commands_of_a_study_run(tmp_path, monkeypatch, capsys):
    pytest.importorskip("statsmodels")
    from motionlab import write_bvh
    from motionlab.__main__ import main
    from motionlab.datasets import gaits

    section = README.partition("## People judge")[2].partition("\n## ")[0]
    commands = re.findall(r"^motionlab (.*?)(?:\s+#.*)?$", section, re.MULTILINE)
    assert [command.split()[1] for command in commands] == ["build", "simulate", "analyse"]
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate(("mocap/walk", "RNN/walk")):
        (tmp_path / "my_study" / name).mkdir(parents=True)
        write_bvh(gaits.make(seconds=1, seed=seed), f"my_study/{name}/1.bvh")
    for command in commands:
        assert main(command.split()) == 0, command
    assert "To tell two methods 0.3 points apart" in capsys.readouterr().out


def test_what_the_readme_links_to_is_there():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target
