"""`motionlab study`: from a folder of clips to a page, and from raters' files to what they say."""

from __future__ import annotations

import json

import pytest

from motionlab import write_bvh
from motionlab.__main__ import main
from motionlab.datasets import gaits


@pytest.fixture
def clips(tmp_path, monkeypatch):
    """Two methods, in two gaits, two clips each."""
    monkeypatch.chdir(tmp_path)
    for m, method in enumerate(("mocap", "RNN")):
        for gait, speed in (("walk", 1.2), ("run", 3.0)):
            for c in range(2):
                file = tmp_path / "clips" / method / gait / f"{c}.bvh"
                file.parent.mkdir(parents=True, exist_ok=True)
                write_bvh(gaits.make(seconds=1.2, speed=speed, seed=2 * m + c), file)
    return tmp_path


def test_a_study_from_clips_to_a_report(clips, capsys):
    pytest.importorskip("statsmodels")
    assert main(["study", "build", "clips", "--out", "study.html"]) == 0
    said = capsys.readouterr().out
    assert "10 items (2 of them checks), 2 methods (RNN, mocap), gaits: run, walk" in said
    assert "note: 2 clips of each method in each gait, not 7" in said
    assert "study.json: the key" in said
    assert main(["study", "simulate", "study.json", "--out", "answers", "--raters", "8"]) == 0
    assert "no person has judged anything" in capsys.readouterr().out
    (clips / "answers" / "cut.json").write_text('{"format": "motion')
    command = [
        "study",
        "analyse",
        "answers",
        "--simulated",
        "--difference",
        "0.5",
        "--out",
        "all.json",
    ]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert said.startswith("SIMULATED") and "cut.json: is cut or damaged" in said
    assert "To tell two methods 0.5 points apart in walk" in said
    whole = json.loads((clips / "all.json").read_text())
    assert whole["who"] == "simulated" and whole["left_out"][0]["file"] == "cut.json"


def test_people_are_asked_for_and_there_are_none(clips, capsys):
    main(["study", "build", "clips", "--out", "study.html"])
    main(["study", "simulate", "study.json", "--out", "answers", "--raters", "2"])
    assert main(["study", "analyse", "answers"]) == 1
    said = capsys.readouterr().err
    assert "no answers of people that count" in said and "--simulated analyses those" in said
    assert "simulated_00001.json: was made by a program" in said


def test_files_and_folders_are_methods(clips, capsys):
    command = ["study", "build", "clips/mocap/walk", "clips/RNN/walk/0.bvh", "--design", "pairs"]
    assert main([*command, "--out", "two.html"]) == 0
    assert "3 items (2 of them checks), 2 methods (0, walk), gaits: all" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["build", "clips", "--out", "study.txt"], "must end in .html"),
        (["build", "nowhere", "--out", "s.html"], "there is no such file or folder"),
        (["build", "clips", "--design", "stars", "--out", "s.html"], "There are ratings, pairs"),
        (["build", "clips/RNN/walk", "clips/mocap/walk", "--out", "s.html"], "two methods are called walk"),
        (["build", "clips/RNN", "--seconds", "9", "--out", "s.html"], "seconds is 9, but"),
        (["analyse", "clips"], "no study is in it or beside it"),
        (["analyse", "nowhere"], "there is no such file or folder"),
        (["analyse", "clips", "--study", "clips/x.html"], "page that raters see"),
        (["simulate", "nowhere.json", "--out", "x"], "can't be read"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_said_in_a_line(clips, capsys, words, said):
    assert main(["study", *words]) == 1
    err = capsys.readouterr().err
    assert said in err and "Traceback" not in err
    assert not list(clips.glob("*.html"))


def test_bad_and_loose_files_are_named(clips, capsys):
    (clips / "clips" / "RNN" / "walk" / "bad.bvh").write_text("HIERARCHY\nROOT")
    assert main(["study", "build", "clips", "--out", "s.html"]) == 1
    assert "bad.bvh" in capsys.readouterr().err
    (clips / "clips" / "loose.bvh").write_text("")
    assert main(["study", "build", "clips", "--out", "s.html"]) == 1
    assert "such as loose.bvh" in capsys.readouterr().err


def test_some_files_are_read_otherwise(clips, capsys):
    (clips / "how.toml").write_text('["RNN/*"]\nfps = 15\n')
    build = ["study", "build", "clips", "--by-file", "how.toml", "--out", "s.html"]
    assert main(build) == 0
    assert "rates differ (15, 30 fps)" in capsys.readouterr().out
    assert main(["study", "build", "clips/RNN", "clips/mocap", *build[3:], "--force"]) == 1
    assert "--by-file: is of one folder's files" in capsys.readouterr().err


def test_a_study_that_was_given_out_is_not_overwritten(clips, capsys):
    build = ["study", "build", "clips", "--out", "study.html"]
    assert main(build) == 0
    before = (clips / "study.json").read_text()
    assert main([*build, "--seed", "1"]) == 1
    assert "is there already" in capsys.readouterr().err
    assert (clips / "study.json").read_text() == before
    assert main([*build, "--seed", "1", "--force"]) == 0
    assert (clips / "study.json").read_text() != before
    main(["study", "build", "clips", "--out", "other.html"])
    (clips / "answers").mkdir()
    capsys.readouterr()
    assert main(["study", "analyse", "answers"]) == 1
    assert "holds 2 studies" in capsys.readouterr().err
