"""The commands on one's own clips: what is refused, in a sentence that says what to do, leaving nothing."""

from __future__ import annotations

import pytest

from motionlab.__main__ import main

COMMANDS = ("convert", "retarget", "clean")


@pytest.mark.parametrize("command", [*COMMANDS, "look"])
def test_nothing_is_overwritten_unasked(here, capsys, command):
    target = "x.html" if command == "look" else "x.bvh"
    (here / target).write_text("mine")
    assert main([command, "walk.bvh", "--out", target]) == 1
    assert f"{target}: is there already; --force" in capsys.readouterr().err
    assert (here / target).read_text() == "mine"
    assert main([command, "walk.bvh", "--out", target, "--force"]) == 0
    assert (here / target).read_text() != "mine"


BAD = {
    "no such file": (["none.bvh", "--out", "x.bvh"], "none.bvh: there is no such file"),
    "no suffix": (["walk.bvh", "--out", "x"], "x: ends in none of .bvh, .glb"),
    "no suffix, a folder": (
        ["walk.bvh", "--out", "o/x"],
        "such as o/x.bvh, or o/x/walk.bvh: folders",
    ),
    "another suffix": (["walk.bvh", "--out", "x.csv"], "name a file such as x.bvh"),
    "fbx": (
        ["walk.bvh", "--out", "x.fbx"],
        "FBX is never written, as its format is not open; write x.glb",
    ),
    "empty folder": (["empty", "--out", "x"], "empty: holds no file that can be read"),
    "a folder onto a file": (["clips", "--out", "walk.bvh"], "is a folder, so this must name one"),
    "a folder onto a name": (["clips", "--out", "x.glb"], "is a folder, so this must name one"),
    "not a motion": (
        ["clips/notes.txt", "--out", "x.bvh"],
        "notes.txt: .txt files are not read, but",
    ),
    "several": (
        ["walk.bvh", "clips/a.bvh", "--out", "x"],
        "takes one file, or one folder of files",
    ),
    "to": (
        ["walk.bvh", "--out", "x", "--to", "gbl"],
        "--to gbl: did you mean glb? There are bvh, glb",
    ),
    "root motion": (
        ["walk.bvh", "--out", "x.bvh", "--root-motion", "floor"],
        "--root-motion floor: There are ground, in-place, none.",
    ),
    "fps 0": (["walk.bvh", "--out", "x.bvh", "--fps", "0"], "--fps 0: must be a number above 0"),
    "fps nan": (["walk.bvh", "--out", "x.bvh", "--fps", "nan"], "must be a number above 0"),
    "fps beyond all": (["walk.bvh", "--out", "x.bvh", "--fps", "1e9"], "above 0, 1000 at most"),
    "file fps": (["walk.bvh", "--out", "x.bvh", "--file-fps", "-1"], "not a positive number"),
    "up": (["walk.bvh", "--out", "x.bvh", "--up", "w"], "--up=w is no axis"),
    "units": (["walk.bvh", "--out", "x.bvh", "--units", "ells"], "Unknown unit 'ells'"),
    "root": (["walk.bvh", "--out", "x.bvh", "--root", "ground"], "--root-motion ground"),
    "roles": (
        ["walk.bvh", "--out", "x.bvh", "--roles", "wrong.toml"],
        "walk.bvh: `roles` says that left_foot is 'Huf', but there is no such joint",
    ),
    "no roles": (["walk.bvh", "--out", "x.bvh", "--roles", "no.toml"], "no.toml: can't be opened"),
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(("arguments", "said"), BAD.values(), ids=BAD)
def test_bad_input_is_a_sentence_and_leaves_nothing(here, capsys, command, arguments, said):
    (here / "empty").mkdir()
    (here / "wrong.toml").write_text('left_foot = "Huf"\n')
    before = sorted(here.rglob("*"))
    assert main([command, *arguments]) == 1
    err = capsys.readouterr().err
    assert said in err and "Traceback" not in err and err.startswith("motionlab: ")
    assert sorted(here.rglob("*")) == before


def test_formats_that_are_known_to_be_others_are_named(here, capsys):
    (here / "walk.fbx").write_bytes(b"Kaydara FBX Binary")
    assert main(["info", "walk.fbx"]) == 1
    assert "walk.fbx: .fbx files are not read, but .bvh, .amc, .glb or" in capsys.readouterr().err
    for name, what in (("a.zip", "Unpack it"), ("a.xml", "not read back"), ("README.md", "")):
        (here / name).write_text("<mujoco/>")
        for command in (["info", name], ["convert", name, "--out", "x.bvh"]):
            assert main(command) == 1
            said = capsys.readouterr().err
            assert f"{name}: .{name.split('.')[1]} files are not read, but" in said and what in said
            assert "HIERARCHY" not in said
    (here / "walk.bvh.bak").write_bytes((here / "walk.bvh").read_bytes())
    assert main(["info", "walk.bvh.bak"]) == 0  # its name is odd, and it is one


def test_a_missing_file_is_told_in_one_way(here, capsys):
    for command in ("info none.bvh", "look none.bvh", "convert none.bvh --out x.bvh"):
        assert main(command.split()) == 1
        assert "none.bvh: there is no such file or folder." in capsys.readouterr().err
