"""Boxes with a paper's own words stand before the code that they are about, and are short."""

import re
from pathlib import Path

import nbformat
import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
BOX = re.compile(r"^:::\{admonition\} (.+)\n:class: paper\n(.+?)\n:::$", re.MULTILINE | re.DOTALL)
WORDS = 40  # of one quotation
NEAR = 3  # cells of code after a box


def boxes(path: Path) -> list[tuple[str, str, str]]:
    """Title and text of each box of a chapter, and the code that follows."""
    cells = nbformat.read(path, as_version=4).cells
    code = lambda i: [c.source for c in cells[i:] if c.cell_type == "code"][:NEAR]
    return [
        (*found, "\n".join(code(i)))
        for i, cell in enumerate(cells)
        for found in BOX.findall(cell.source)
    ]


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda p: p.stem[:2])
def test_a_box_quotes_little_and_names_code_that_follows(path):
    marked = sum(c.source.count(":class: paper") for c in nbformat.read(path, as_version=4).cells)
    found = boxes(path)
    assert len(found) == marked  # none that the pattern overlooks
    for title, text, code in found:
        assert re.fullmatch(r"The paper, section \d(\.\d)*", title), title
        quotes = re.findall(r"“(.+?)”", text)
        assert quotes and all(len(quote.split()) <= WORDS for quote in quotes), title
        (name,) = re.findall(r"^In code, `([\w.]+)", text, re.MULTILINE)
        assert name.rpartition(".")[2] in code, f"{title}: {name} is not in the code below"


def test_chapters_about_a_paper_have_its_words():
    for path in NOTEBOOKS.glob("*.ipynb"):
        if path.stem[:2] in ("03", "04", "05", "06"):
            assert len(boxes(path)) >= 2, path.name
