"""A folder of files that are not all read alike: what is said of some, by pattern."""

from __future__ import annotations

import warnings

import pytest

from motionlab import datasets, write_bvh
from motionlab.__main__ import main
from motionlab.datasets import gaits
from motionlab.errors import MotionFileError, SkeletonError
from motionlab.io.readings import read_by_file

WALK = gaits.make(seconds=2, speed=1.2)
ANSWERS = """
["lab/*"]
units = "m"
up = "z"

["lab/*_inches.bvh"]
units = "in"
roles = "rig.toml"
"""


@pytest.fixture
def mixed(tmp_path, monkeypatch):
    """clips/ with files of three kinds, and what is to be said of them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clips" / "lab").mkdir(parents=True)
    write_bvh(WALK, "clips/plain.bvh")
    write_bvh(WALK, "clips/lab/a.bvh", units="m", up="z")
    write_bvh(WALK, "clips/lab/b_inches.bvh", units="in", up="z")
    (tmp_path / "answers.toml").write_text(ANSWERS)
    (tmp_path / "rig.toml").write_text('chest = "Spine"\nspine = ""\n')
    return tmp_path


def test_each_is_read_as_it_is_said(mixed):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = datasets.from_folder("clips", by_file=read_by_file("answers.toml"))
    assert [motion.name for motion in found] == ["lab/a", "lab/b_inches", "plain"]
    for motion in found:
        assert (motion.positions() - WALK.positions()).abs().max() < 1e-4
    assert [motion.skeleton.names[motion.skeleton.role("chest")] for motion in found] == [
        "Chest", "Spine", "Chest",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "command", ["info clips", "convert clips --out x", "retarget clips --out x"]
)
def test_by_the_commands(mixed, capsys, command):
    main(command.split())
    assert "pass another unit" in capsys.readouterr().out
    again = ["--force"] * ("--out" in command)
    assert main([*command.split(), "--by-file", "answers.toml", *again]) == 0
    said = capsys.readouterr().out
    assert "pass another unit" not in said and "looks like" not in said and "--up=" not in said


def test_prepare_has_it_too(mixed, capsys):
    for i in range(7):
        write_bvh(gaits.make(seconds=1.5, speed=1 + i / 9, seed=i), f"clips/{i}.bvh")
    assert main(["prepare", "clips", "--by-file", "answers.toml", "--out", "mine.npz"]) == 0
    assert "mine.npz: " in capsys.readouterr().out


def test_a_split_leaves_patterns_what_they_fit(mixed):
    for split in ("train", "val", "test"):
        datasets.from_folder("clips", split=split, by_file=read_by_file("answers.toml"))


@pytest.mark.parametrize(
    ("by_file", "said"),
    [
        ({"labor/*": {"up": "z"}}, r"clips: by_file= has the pattern 'labor/\*', which fits none"),
        (
            {"lab/*": {"ups": "z"}},
            r"by_file= of 'lab/\*': there is no 'ups'; say of files units, fps",
        ),
        ({"units": "m"}, "by_file= of 'units': there is nothing but tables"),
        ({"lab/*": {"up": "w"}}, r"by_file= of 'lab/\*': up='w' is no axis"),
        ({"lab/*": {"units": ["m"]}}, r"by_file= of 'lab/\*': Unknown unit"),
    ],
)
def test_what_is_no_answer(mixed, by_file, said):
    with pytest.raises(MotionFileError, match=said):
        datasets.from_folder("clips", by_file=by_file)


def test_files_that_are_no_answers(mixed, capsys):
    (mixed / "bad.toml").write_text("[lab/*\n")
    with pytest.raises(SkeletonError, match=r'bad.toml: is no TOML: .*looks like \["lab/\*"\]'):
        read_by_file("bad.toml")
    with pytest.raises(SkeletonError, match="none.toml: can't be opened"):
        read_by_file("none.toml")
    (mixed / "list.json").write_text('["lab"]')
    with pytest.raises(SkeletonError, match="list.json: must hold tables"):
        read_by_file("list.json")
    assert main(["info", "clips/plain.bvh", "--by-file", "answers.toml"]) == 1
    assert "is for those of a folder" in capsys.readouterr().err
