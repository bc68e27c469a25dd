"""The page of speeds shows every benchmark's result as it is, and nothing that is not there."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BOOK = ROOT / "book"


@pytest.fixture
def page(tool, monkeypatch):
    """Cells of the page, and what its first one defines."""
    cells = tool("execute").read_page(BOOK / "how_fast.md").cells
    first, *others = [cell.source for cell in cells if cell.cell_type == "code"]
    monkeypatch.chdir(ROOT)
    names = {}
    exec(first, names)
    return names, others


def rows_of(shown):
    return re.findall("<tr><td>(.*?)</td></tr>", shown.data)


def test_every_result_of_a_benchmark_is_on_the_page(page):
    shown = "".join(page[1])
    kept = {path.stem for path in (ROOT / "results").glob("bench_*.json")}
    assert kept and {name for name in kept if f'"{name}"' not in shown} == set()


def test_every_row_is_in_its_file(page):
    names, cells = page
    for cell in cells:
        shown = eval(cell, names)
        assert rows_of(shown)
        assert "not measured<" not in shown.data and "is not there" not in shown.data, cell


def test_without_a_result_nothing_is_claimed(page, tmp_path):
    names, cells = page
    names["RESULTS"] = tmp_path
    for cell in cells:
        shown = eval(cell, names)
        assert "is not there yet" in shown.data
        for row in rows_of(shown):
            assert "not measured" in row and not re.search(r"class=.bar|>met|>not met|≤", row), row


@pytest.fixture
def speeds(page, tmp_path):
    """Rows of a result."""
    names, _ = page
    names["RESULTS"] = tmp_path

    def made(numbers, *rows):
        record = {"python": "3.12", "machine": "x86_64", **numbers}
        (tmp_path / "bench_x.json").write_text(json.dumps(record))
        return names["speeds"]("bench_x", *(names[kind](*its, **more) for kind, its, more in rows))

    return made


@pytest.mark.parametrize("took, said", [(0.149, "met"), (0.15, "met"), (0.151, "not met")])
def test_a_limit_is_met_or_not(speeds, took, said):
    numbers = {"a / b": took, "limits": {"a / b": 0.15}}
    (row,) = rows_of(speeds(numbers, ("share", ("how", "a / b", "limits > a / b"), {})))
    assert f">{said}<" in row and "≤ 0.15" in row and f"{took:.3g}" in row


def test_times_as_fast_are_turned_into_a_share(speeds):
    numbers = {"faster": 4.0, "limit": 5.0}
    (row,) = rows_of(speeds(numbers, ("share", ("how", "faster", "limit"), {"faster": True})))
    assert "0.25" in row and "≤ 0.2<" in row and "not met" in row and "width: 25.0%" in row


def test_what_is_only_told_has_no_verdict(speeds):
    shown = speeds({"apart": 0.5}, ("number", ("how", "apart", "mm"), {}))
    assert "0.5 mm" in shown.data and "verdict" not in shown.data and "bar" not in shown.data


def test_what_a_file_does_not_tell_is_not_made_up(speeds):
    shown = speeds({}, ("share", ("how", "a"), {})).data
    assert "not recorded" in shown and "memory not measured" in shown
    numbers = {"processor": "A <fine> one", "cores": 2, "load": 3.1, "date": "2026-11-29",
               "peak memory (MB)": 512, "command": "python benchmarks/bench_x.py"}  # fmt: skip
    shown = speeds(numbers, ("share", ("how", "a"), {})).data
    for words in ("A &lt;fine&gt; one, 2 cores", "3.1 programs", "29 November 2026", "512 MB"):
        assert words in shown
    assert "not recorded" not in shown
