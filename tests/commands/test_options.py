"""The library's words for its arguments, as the command line has them: in every command, of all it says."""

from __future__ import annotations

import re
import sys
import warnings

import pytest
import rig_names

from motionlab import write_bvh
from motionlab.__main__ import main
from motionlab.commands.options import as_options
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")
PYTHON = re.compile(r"(?<![-\w])(units|up|rigid|root|fps|skip_bad|reference|tpose_first)=")


@pytest.mark.parametrize(
    ("said", "typed"),
    [
        ("read it with up='-z'", "read it with --up=-z"),
        ("pass another unit: units='in'", "pass another unit: --units=in"),
        ("about units=0.064.", "about --units=0.064."),
        ("as root='two words'", "as --root='two words'"),
        ("by name, as animation='Walk'", "by name, as --animation=Walk"),
        ("by number, as animation=3.", "by number, as --animation=3."),
        ("pass fps= to say so", "pass --file-fps to say so"),
        ("with fps=30 or fps=33", "with --file-fps=30 or --file-fps=33"),
        ("pass skip_bad=True.", "pass --skip-bad."),
        ("with tpose_first=False, drop_zeros=False.", "with --no-tpose-first, --no-drop-zeros."),
        ("pass reference=, a motion", "pass --reference, a motion"),
        ("by_file= of 'lab/*'", "--by-file of 'lab/*'"),
        ("roles=motionlab.roles.read('x')", "roles=motionlab.roles.read('x')"),
        ("clips/fps=30/up='z'.bvh: fps=9", "clips/fps=30/up='z'.bvh: --file-fps=9"),
    ],
)
def test_one_word_for_the_other(said, typed):
    assert as_options(said) == typed
    assert as_options(typed) == typed


def test_a_table_is_a_file():
    said = as_options("Say which with read_bvh(path, roles={'hips': 'NAME'}).")
    assert said == 'Say which with --roles=rig.toml (a file with lines such as hips = "NAME").'
    told = "The target skeleton has no joint for hips. Say it with roles={'hips': 'NAME'}."
    assert " with --rig-roles=rig.toml (" in as_options(told)  # which is told of a rig


@pytest.fixture
def heard(monkeypatch):
    """Warnings are printed, as outside of tests."""
    show = lambda *about: sys.stderr.write(warnings.formatwarning(*about[:4]))
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        monkeypatch.setattr(warnings, "showwarning", show)
        yield


def test_no_command_speaks_python(here, capsys, heard):
    """Doubts and faults of files that are read wrongly in every way that is looked for."""
    (here / "odd").mkdir()
    write_bvh(WALK, "odd/inches.bvh", units="in")
    write_bvh(WALK, "odd/lies.bvh", up="z")
    text = (here / "walk.bvh").read_text().replace("Frame Time: 0.03333333333", "Frame Time: 30")
    (here / "odd" / "rate.bvh").write_text(text)
    rate = {"prepare": "--fps=30"}
    for command in ("info", "look", "convert", "retarget", "clean", "prepare"):
        out = [] if command == "info" else ["--out", f"x{command}"]
        main([command, "odd", *out])
        said = "".join(capsys.readouterr())
        assert not PYTHON.search(said) and "Motion(" not in said, said
        for option in ("--units=in", "--up=z", rate.get(command, "--file-fps=30")):
            assert option in said, (command, option)
    assert main(["info", "odd/rate.bvh"]) == 1
    assert "--file-fps=30" in capsys.readouterr().err
    assert main(["info", "odd/rate.bvh", "--file-fps=30", "--tpose-first"]) == 0
    assert "29 frames, 0.97 s, 30 fps" in capsys.readouterr().out


def test_a_clip_is_called_by_its_name(here, capsys, heard):
    """Not as Python shows it; and what to do comes first."""
    write_bvh(WALK, "lies.bvh", up="z")
    assert main(["retarget", "lies.bvh", "--out", "x.bvh"]) == 0
    said = "".join(capsys.readouterr())
    (guess,) = [line for line in said.splitlines() if "is a guess" in line]
    assert guess.startswith("note: lies: read it with another --up if")
    assert guess.index("pass --reference, a") < guess.index("As it is")
    for reference, why in (("lies.bvh", "can't tell how"), ("other.bvh", "is of another rig")):
        if reference == "other.bvh":
            names = [f"its{name}" for name in WALK.skeleton.names]
            write_bvh(rig_names.renamed(WALK, names), reference)
        command = ["retarget", "lies.bvh", "--reference", reference, "--out", "y.bvh"]
        assert main(command) == 1
        said = capsys.readouterr().err
        assert f"The reference {reference[:-4]} {why}" in said and "Motion(" not in said
