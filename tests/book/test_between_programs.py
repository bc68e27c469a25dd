"""The page of programs shows what is there, and says of what isn't that it isn't."""

import json
from pathlib import Path

import pytest

from experiments.interchange import environments

ROOT = Path(__file__).parents[2]


@pytest.fixture
def page(tool, monkeypatch):
    """Run the page beside a results file; what its cells show."""

    def run(found, folder):
        cells = tool("execute").read_page(ROOT / "book" / "between_programs.md").cells
        first, *others = [cell.source for cell in cells if cell.cell_type == "code"]
        (folder / "experiments").mkdir()
        if found is not None:
            (folder / "results").mkdir()
            (folder / "results" / "interchange.json").write_text(json.dumps(found))
        monkeypatch.chdir(folder)
        names = {}
        exec(first, names)
        return "".join(eval(cell, names).data for cell in others)

    return run


def test_the_page_shows_every_program_and_trap(page, tmp_path):
    found = json.loads((ROOT / "results" / "interchange.json").read_text(encoding="utf-8"))
    shown = page(found, tmp_path)
    programs, _ = environments.registry()
    for program in programs:
        assert not program.ways or f"({program.pin[0]} {program.pin[1]})" in shown
    assert "not installed" not in shown and "no such" not in shown


def test_the_page_builds_without_programs_and_without_results(page, tmp_path):
    programs, traps = environments.registry()
    row = lambda each: {"title": each.title, "pinned": each.pin[1], "installed": False}
    found = {
        "command": "python", "machine": "here", "code_version": "0",
        "programs": {each.name: row(each) for each in programs},
        "traps": {each.name: {"program": each.program, "installed": False} for each in traps},
    }  # fmt: skip
    for name, given in (("none", None), ("absent", found)):
        (tmp_path / name).mkdir()
        assert page(given, tmp_path / name).count("not installed") >= len(traps)
