"""A program that is not there has a row that says so; one that fails says with what."""

import json
import re
import sys
from pathlib import Path

import pybvh
import pytest

from experiments.interchange import environments, programs
from experiments.interchange.environments import Program, Trap
from motionlab.datasets import gaits

THERE = Program("pybvh", "pybvh", "pybvh_.py", {"bvh": "in and out"}, (f"pybvh=={pybvh.__version__}",))  # fmt: skip


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Ask one program, in this very environment, about a tenth of a second of a walk."""
    walk = gaits.make(seconds=0.1, name="walk")
    monkeypatch.setattr(programs.clips, "known", lambda: walk)
    monkeypatch.setattr(programs.clips, "real", lambda: walk)
    monkeypatch.chdir(tmp_path)

    def ask(program, *traps, python=Path(sys.executable)):
        monkeypatch.setattr(environments, "registry", lambda: ([program], list(traps)))
        monkeypatch.setattr(environments, "interpreter", lambda program, work: python)
        (tmp_path / "work" / program.name).mkdir(parents=True, exist_ok=True)
        programs.main(["--work", "work", "--output", "found.json"])
        return json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))

    return ask


def test_a_program_that_is_there_gives_its_motion_back(asked):
    first, _ = asked(THERE)["programs"]["pybvh"]["rows"]
    assert (
        first["frames"] == [3, 3] and first["end sites"] == [5, 5] and first["joints"] == [21, 21]
    )
    assert first["largest (mm)"] < 0.01 and first["orders kept"] == 21


def test_a_program_that_is_not_there_says_so(asked, tmp_path):
    found = asked(THERE, Trap("one", "pybvh", "one.py"), python=tmp_path / "no-python")
    row = {"title": "pybvh", "package": "pybvh", "pinned": pybvh.__version__, "installed": False}
    assert found["programs"] == {"pybvh": row}
    assert found["traps"]["one"]["installed"] is False


def test_another_version_than_the_pinned_one_is_not_the_program(asked):
    other = Program("pybvh", "pybvh", "pybvh_.py", {"bvh": "in and out"}, ("pybvh==0.0.1",))
    assert asked(other)["programs"]["pybvh"]["installed"] is False


def test_what_a_program_fails_with_is_told(asked, tmp_path, monkeypatch):
    (tmp_path / "inside").mkdir()
    script = (
        "import sys\nprint('warning: odd', file=sys.stderr)\nraise ValueError('no such bone')\n"
    )
    (tmp_path / "inside" / "pybvh_.py").write_text(script)
    monkeypatch.setattr(environments, "HERE", tmp_path)
    rows = asked(THERE)["programs"]["pybvh"]["rows"]
    assert [row["failed"] for row in rows] == 2 * ["ValueError: no such bone"]


def test_the_registry_pins_what_it_lists_and_its_scripts_exist():
    listed, traps = environments.registry()
    for program in listed:
        for pin in (*program.pip, *program.npm):
            assert re.search(r"[=@]\d[\w.-]*$", pin)
    names = {program.name for program in listed}
    assert {trap.program for trap in traps} <= names
    scripts = {each.script for each in (*listed, *traps) if each.script}
    inside = {path.name for path in (environments.HERE / "inside").iterdir() if path.is_file()}
    assert scripts == inside - {"given.py", "given.mjs"}
