"""Chapters are executed side by side, once, and what stops one is told."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from queue import Empty
from types import SimpleNamespace

import nbformat
import pytest

BOOK = Path(__file__).parents[2] / "book"
MARKDOWN = """---
jupytext:
  text_representation:
    format_name: myst
kernelspec:
  name: python3
---

# A page

```{code-cell} python
print("four", 2 + 2)
```
"""

# build.py, but of the pages that it is given
HERE = {"library": "as it is"}
BUILD_OF = """
import sys
sys.path.insert(0, {book!r})
import build, chapters
paths = list(map(chapters.Path, sys.argv[1:]))
pages = [chapters.Chapter(path, path.parent / "executed") for path in paths]
build.build = lambda again, jobs: chapters.execute(pages, {{"library": "as it is"}}, 2, print)
sys.argv = ["build.py"]
build.main()
"""


@pytest.fixture
def chapters(tool):
    return tool("chapters")


@pytest.fixture
def write(tmp_path, chapters):
    """Write a notebook of code cells; gives the chapter, kept in a folder of the test's."""

    def notebook(name, *cells):
        page = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in cells])
        page.metadata["kernelspec"] = {"name": "python3", "display_name": "Python"}
        nbformat.write(page, tmp_path / f"{name}.ipynb")
        return chapters.Chapter(tmp_path / f"{name}.ipynb", tmp_path / "executed")

    return notebook


@pytest.fixture
def keep(chapters):
    """Put down what would have been kept of a chapter that ran well, without running it."""

    def as_if_run(chapter, around=HERE):
        page = chapters.read_page(chapter.path)
        chapter.folder.mkdir(parents=True, exist_ok=True)
        nbformat.write(page, chapter.folder / "page.ipynb")
        record = {"format": chapters.FORMAT, "error": None, "cells": 1, "begun": time.time(),
                  "of": chapters.fingerprint(chapter), "around": around}  # fmt: skip
        (chapter.folder / "record.json").write_text(json.dumps(record))

    return as_if_run


@pytest.fixture
def run(chapters):
    """Execute chapters, two at a time; gives what was said."""

    def execute(*some, around=HERE):
        said = []
        chapters.execute(some, around, 2, said.append)
        return said

    return execute


def outputs(chapter):
    cells = [cell for cell in chapter.executed().cells if cell.cell_type == "code"]
    return ["".join(output.get("text", "") for output in cell.outputs) for cell in cells]


def test_what_cells_print_is_kept_with_what_it_cost(write, run, chapters):
    one, two = write("one", "a = 20", "print(a + 1)"), write("two", "print('two')")
    said = run(one, two)
    assert outputs(one) == ["", "21\n"] and outputs(two) == ["two\n"]
    assert one.record["cells"] == 2 and one.record["error"] is None
    assert 0 < one.record["processor_seconds"] < 60 and one.record["threads"] == "1"
    assert sorted(line.split()[2] for line in said) == ["one:", "two:"] and "0 left" in said[-1]


def test_a_page_in_markdown_is_a_chapter_if_it_holds_code(tmp_path, run, chapters):
    (tmp_path / "page.md").write_text(MARKDOWN)
    chapter = chapters.Chapter(tmp_path / "page.md", tmp_path / "executed")
    run(chapter)
    assert outputs(chapter)[-1] == "four 4\n"
    (tmp_path / "plain.md").write_text("# Words alone\n")
    assert chapters.read_page(tmp_path / "plain.md") is None
    names = [chapter.name for chapter in chapters.find()]
    assert names[0] == "index" and "claims" in names and "01_motion_data" in names
    assert "notation" not in names


def test_pages_know_that_they_are_pages(write, run, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTIONLAB_DATA", "clips")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    one = write(
        "one",
        "import os, pathlib",
        "print(os.environ['MOTIONLAB_VIEWER'], os.environ['OMP_NUM_THREADS'])",
        "print(os.environ['MOTIONLAB_DATA'], os.getcwd())",
        "pathlib.Path(os.environ['MOTIONLAB_SCRIPTS'], 'a.js').write_text('1');",
    )
    run(one)
    assert outputs(one)[1:3] == ["page 1\n", f"{tmp_path / 'clips'} {tmp_path}\n"]
    assert (one.folder / "scripts" / "a.js").read_text() == "1"


def test_what_did_not_change_is_not_executed_again(write, keep, chapters):
    one = write("one", "print(1)")
    assert not chapters.good(one, HERE)
    keep(one)
    assert chapters.good(one, HERE)
    assert not chapters.good(one, {**HERE, "library": "another"})
    page = nbformat.read(one.path, as_version=4)
    page.cells.insert(0, nbformat.v4.new_markdown_cell("Words alone change nothing."))
    nbformat.write(page, one.path)
    assert chapters.good(one, HERE)
    page.cells[1].metadata["tags"] = ["hide-input"]  # it goes with what is kept
    nbformat.write(page, one.path)
    assert not chapters.good(one, HERE)
    write("one", "print(2)")
    assert not chapters.good(one, HERE) and one.executed() is None  # another page's outputs


def test_it_is_said_why_a_chapter_is_executed_again(write, keep, chapters):
    one = write("one", "print(1)")
    assert chapters.why(one, HERE) == "was not executed yet"
    keep(one)
    assert chapters.why(one, HERE) == ""
    assert chapters.why(one, {"library": "another"}) == "changed: library"
    assert chapters.why(one, HERE | {"data at hand": "some"}) == "changed: data at hand"
    write("one", "print(2)")
    assert chapters.why(one, HERE) == "its code changed"
    now = chapters.surroundings()
    assert now == chapters.surroundings()
    assert {"src/motionlab", "results", "experiments", "examples", "data at hand"} < {*now}


def test_what_is_kept_is_not_trusted_if_damaged_or_of_another_version(write, keep, chapters):
    one = write("one", "print(1)")
    keep(one)
    for path in (one.folder / "page.ipynb", one.folder / "record.json"):
        whole = path.read_text()
        for content in ("", "{", "[1]", "{}", whole[: len(whole) // 2]):
            path.write_text(content)
            assert not chapters.good(one, HERE), (path.name, content)
        path.unlink()
        assert not chapters.good(one, HERE)
        path.write_text(whole)
        assert chapters.good(one, HERE)
    path.write_text(whole.replace('"format": 1', '"format": 0'))
    assert not chapters.good(one, HERE)


def test_an_error_names_chapter_cell_and_remedy_and_leaves_the_others(write, run, chapters):
    bad = write(
        "bad", "x = 1", "y = [\n    1,\n    2,\n    3,\n]\nraise ValueError('no feet')", "print(x)"
    )
    fine = write("fine", "print('fine')")
    said = run(bad, fine)
    assert chapters.good(fine, HERE) and not chapters.good(bad, HERE)
    assert any("bad: FAILED at cell 2 of 3" in line for line in said)
    told = chapters.told(bad)
    assert "bad.ipynb, cell 2 of 3:" in told and "ValueError: no feet" in told
    python = Path(sys.executable)  # as one writes it in the repository's root
    python = python.relative_to(chapters.ROOT) if chapters.ROOT in python.parents else python
    assert "y = [" in told and f"{python} book/execute.py {bad.path}" in told
    assert bad.executed().cells[1].outputs[0].ename == "ValueError"  # the page shows it
    assert not bad.executed().cells[2].outputs


def test_a_python_that_ends_is_told(write, run, chapters):
    gone = write("gone", "import os", "os._exit(3)")
    run(gone)
    assert "cell 2 of 2" in chapters.told(gone) and "its Python ended" in chapters.told(gone)


def test_a_page_that_can_not_be_executed_is_told(write, run, chapters):
    odd = write("odd", "print(1)")
    odd.path.write_text(odd.path.read_text().replace("python3", "a_kernel_that_nobody_has"))
    run(odd)
    assert "could not be executed" in chapters.told(odd)
    assert "a_kernel_that_nobody_has" in chapters.told(odd)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are another matter on Windows")
def test_an_interrupted_build_keeps_what_is_done_and_ends_what_is_not(write, chapters, tmp_path):
    done = write("done", "print(1)")
    slow = write(
        "slow",
        f"import os, pathlib\npathlib.Path(r'{tmp_path}', 'pid').write_text(str(os.getpid()))",
        "import time\ntime.sleep(600)",
    )
    process = subprocess.Popen(
        [sys.executable, "-c", BUILD_OF.format(book=str(chapters.BOOK)), str(done.path), str(slow.path)],
        stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    wait_for(lambda: (tmp_path / "pid").exists() and chapters.good(done, HERE))
    os.killpg(process.pid, signal.SIGTERM)  # build.py takes it for a Ctrl-C
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 130 and "is kept" in said
    kernel = int((tmp_path / "pid").read_text())
    wait_for(lambda: not alive(kernel))
    assert chapters.good(done, HERE) and not slow.record
    assert [path.name for path in (tmp_path / "executed").iterdir()] == ["done"]


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(what, seconds=60):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.1)


# -- the build ------------------------------------------------------------------------------------


@pytest.fixture
def build(tool, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["build.py"])
    return tool("build")


def test_chapters_can_be_asked_for(build, write, keep):
    one, two = write("01_one", "print(1)"), write("02_two", "print(2)")
    keep(one)
    keep(two)
    assert build.outdated([one, two], HERE, None) == []
    assert build.outdated([one, two], HERE, []) == [one, two]
    assert build.outdated([one, two], HERE, ["02"]) == [two]
    assert build.outdated([one, two], {"library": "there"}, ["02"]) == [one, two]
    with pytest.raises(SystemExit, match="07.*01_one, 02_two"):
        build.outdated([one, two], HERE, ["07"])


def test_a_full_disk_is_a_sentence(build, monkeypatch, write, run):
    def full(*_):
        raise OSError(build.errno.ENOSPC, "No space left on device", "some/file")

    monkeypatch.setattr(build, "build", full)
    with pytest.raises(SystemExit, match="disk is full: some/file.*make book"):
        build.main()
    monkeypatch.setattr(build.chapters.os, "replace", full)
    one = write("one", "print(1)")
    with pytest.raises(OSError, match="one.ipynb"):  # the page's name, not that of a scratch file
        run(one)


def test_pages_know_all_that_they_are_made_of(build, write, keep):
    one = write("one", "print(1)")
    keep(one)
    made = build.made_of([one], HERE)
    assert build.made_of([one], HERE) == made != build.made_of([one], {"library": "there"})
    keep(one)
    assert build.made_of([one], HERE) != made  # executed anew


# -- the budget -----------------------------------------------------------------------------------


def test_the_budget_is_of_processors_and_names_who_is_over_it(tool, monkeypatch, capsys):
    budget = tool("budget")
    made = lambda name, used, clock: SimpleNamespace(
        shown=name, record={"processor_seconds": used, "seconds": clock}
    )
    monkeypatch.setattr(budget.chapters, "find", lambda: [made("slow machine", 140, 9000)])
    budget.main()
    assert "140.0 s of 150 s  slow machine" in capsys.readouterr().out
    monkeypatch.setattr(
        budget.chapters, "find", lambda: [made("heavy", 151, 80), made("small", 1, 1)]
    )
    with pytest.raises(SystemExit, match="heavy") as over:
        budget.main()
    assert "small" not in str(over.value)


def test_the_book_s_own_pages_are_read_as_the_pages_are_made(chapters):
    """MyST-NB finds outputs by what it reads: the same code, in the same order."""
    for chapter in chapters.find():
        page = chapters.read_page(chapter.path)
        assert page.cells and page.metadata["kernelspec"]["name"] == "python3"
        if chapter.path.suffix == ".ipynb":
            stored = json.loads(chapter.path.read_text(encoding="utf-8"))["cells"]
            code = ["".join(c["source"]) for c in stored if c["cell_type"] == "code"]
            assert chapters.sources(page) == code


# -- one chapter ----------------------------------------------------------------------------------


def test_it_does_not_sleep_through_the_end_of_a_cell(tool, monkeypatch):
    """A message that came while the channel was asleep is found by whoever asks again."""
    execute, asked = tool("execute"), []

    async def sleeps_through_the_first(timeout):
        asked.append(timeout)
        await asyncio.sleep(min(timeout, 0.1))
        if len(asked) == 1:
            raise Empty
        return {"the end": True}

    async def start(self):
        return SimpleNamespace(shell_channel=SimpleNamespace(get_msg=sleeps_through_the_first))

    monkeypatch.setattr(execute.NotebookClient, "async_start_new_kernel_client", start)

    async def wait(seconds):
        client = await execute.Client(nbformat.v4.new_notebook()).async_start_new_kernel_client()
        return await client.shell_channel.get_msg(timeout=seconds)

    assert asyncio.run(wait(3600)) == {"the end": True} and len(asked) == 2
    assert max(asked) <= 1
    asked[:] = []
    with pytest.raises(Empty):
        asyncio.run(wait(0))


def test_a_reader_can_execute_one_chapter_alone(write, tmp_path):
    chapter = write("alone", "print(1)", "raise ValueError('no feet')")
    run = lambda *what: subprocess.run(
        [sys.executable, str(BOOK / "execute.py"), *what], capture_output=True, text=True
    )
    found = run(str(chapter.path))
    assert found.returncode == 1 and "cell 2 of 2" in found.stdout
    assert "cell 2: ValueError: no feet" in found.stderr and "Traceback (most" in found.stderr
    assert "no such page" in run("07_nothing.ipynb").stderr
    (tmp_path / "plain.md").write_text("# Words alone\n")
    assert "holds no code" in run(str(tmp_path / "plain.md")).stderr
