"""Tables of results, as pandas writes them, made to be read.

* A table of more than twenty rows folds, under a line that says how many they are.
* Counts such as updates, which pandas writes as 500000.0 where a number is missing beside them, are
  written as 500000, and so is 5e+05; -0.0 is 0.0; what is missing is a dash, not NaN; True is yes.
* Heads that pandas sets in two rows, one of them all but empty, stand in one.
* A row whose name begins with ▸ is one that matters, and stands out.
"""

import re

from bs4 import BeautifulSoup
from sphinx.application import Sphinx

ROWS = 20  # more than these fold
COUNT = 10  # whole numbers, the largest of them at least this, count something, whatever their unit
FRAME = re.compile(r'<table[^>]*class="dataframe.*?</table>', re.DOTALL)
NUMBER = re.compile(r"-?\d+(\.\d+)?")
POWER = re.compile(r"-?\d(\.\d+)?e\+0\d")
NOTHING = re.compile(r"-0(\.0+)?")
UNIT = re.compile(r"\([^()]+\)")  # in a head: what was measured keeps zeros behind its point
WORDS = {"True": "yes", "False": "no"}


def rewrite(body: str) -> str:
    """The same HTML with its tables made so."""
    return FRAME.sub(lambda found: _table(found[0]), body)


def _table(table: str) -> str:
    soup = BeautifulSoup(table, "html.parser")
    rows = [row.find_all("td") for row in soup.select("tbody tr")]
    for cell in soup.find_all("td", string=POWER.fullmatch):
        cell.string = f"{float(cell.text):.0f}"
    for cell in soup.find_all("td", string=NOTHING.fullmatch):
        cell.string = cell.text[1:]
    _join_heads(soup)
    for cells, heads in _lines(soup, rows):
        _count(cells, measured=any(map(UNIT.search, heads)))
    for cell in soup.find_all("td", string=re.compile("^(True|False)$")):
        cell.string = WORDS[cell.text]
    for cell in soup.find_all("td", string=re.compile(r"^(nan|NaN|NaT|None)$")):
        cell.string = "–"
    for name in soup.find_all("th", string=re.compile("^▸ ")):
        name.parent["class"] = [*name.parent.get("class", []), "matters"]
    if len(rows) <= ROWS:
        return str(soup)
    return f'<details class="long"><summary>A table of {len(rows)} rows</summary>{soup}</details>'


def _join_heads(soup: BeautifulSoup) -> None:
    """Names of the columns at the left stand in a row of their own: put them into the row above."""
    lines = soup.select("thead tr")
    if len(lines) == 2:
        above, below = (line.find_all("th") for line in lines)
        names = [th for th in below if th.text.strip()]
        if below[: len(names)] == names and not any(th.text.strip() for th in above[: len(names)]):
            for empty, name in zip(above, names, strict=False):
                empty.string = name.text
            lines[1].decompose()


def _lines(soup: BeautifulSoup, rows: list) -> list[tuple[list, list[str]]]:
    """Rows and columns that have numbers: their cells, and the heads of those cells that are numbers."""
    beside = [" ".join(th.text for th in row.find_all("th")) for row in soup.select("tbody tr")]
    width = max(map(len, rows), default=0)
    above = [""] * width
    for row in soup.select("thead tr"):
        heads = [th.text for th in row.find_all("th") for _ in range(int(th.get("colspan", 1)))]
        above = [f"{a} {b}" for a, b in zip(above, heads[-width:], strict=False)]
    lines = []
    for head, cells in zip(beside, rows, strict=True):
        lines.append(
            (cells, [head, *(a for a, c in zip(above, cells, strict=False) if _number(c))])
        )
    for head, cells in zip(above, zip(*rows, strict=False), strict=False):
        lines.append(
            (cells, [head, *(b for b, c in zip(beside, cells, strict=True) if _number(c))])
        )
    return lines


def _number(cell) -> bool:
    return NUMBER.fullmatch(cell.text) is not None


def _count(cells, measured: bool) -> None:
    """Take the zeros behind the point off, if all numbers of a row or column are such, and nothing that
    was measured, unless one is large."""
    numbers = [cell for cell in cells if _number(cell)]
    whole = all(float(cell.text).is_integer() for cell in numbers)
    if len(numbers) < 2 or not whole:
        return
    if not measured or max(float(cell.text) for cell in numbers) >= COUNT:
        for cell in numbers:
            cell.string = cell.text.partition(".")[0]


def setup(app: Sphinx) -> dict:
    def process(app, pagename, templatename, context, doctree):
        if "body" in context:
            context["body"] = rewrite(context["body"])

    app.connect("html-page-context", process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
