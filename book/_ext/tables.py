"""Tables of results, as pandas writes them, made to be read.

* A table of more than twenty rows folds, under a line that says how many they are.
* Counts such as updates, which pandas writes as 500000.0 where a number is missing beside them, are
  written as 500000, and so is 5e+05; -0.0 is 0.0; what is missing is a dash, not NaN.
* A row whose name begins with ▸ is one that matters, and stands out.
"""

import re

from bs4 import BeautifulSoup
from sphinx.application import Sphinx

ROWS = 20  # more than these fold
COUNT = 10  # a column or row of whole numbers, the largest of them at least this, counts something
FRAME = re.compile(r'<table[^>]*class="dataframe.*?</table>', re.DOTALL)
NUMBER = re.compile(r"-?\d+(\.\d+)?")
POWER = re.compile(r"-?\d(\.\d+)?e\+0\d")
NOTHING = re.compile(r"-0(\.0+)?")


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
    for cells in [*rows, *zip(*rows, strict=False)]:
        _count(cells)
    for cell in soup.find_all("td", string=re.compile(r"^(nan|NaN|NaT|None)$")):
        cell.string = "–"
    for name in soup.find_all("th", string=re.compile("^▸ ")):
        name.parent["class"] = [*name.parent.get("class", []), "matters"]
    if len(rows) <= ROWS:
        return str(soup)
    return f'<details class="long"><summary>A table of {len(rows)} rows</summary>{soup}</details>'


def _count(cells) -> None:
    """Take the zeros behind the point off, if all numbers of a row or column are such, and one large."""
    numbers = [cell for cell in cells if NUMBER.fullmatch(cell.text)]
    whole = all(float(cell.text).is_integer() for cell in numbers)
    if len(numbers) > 1 and whole and max(float(cell.text) for cell in numbers) >= COUNT:
        for cell in numbers:
            cell.string = cell.text.partition(".")[0]


def setup(app: Sphinx) -> dict:
    def process(app, pagename, templatename, context, doctree):
        if "body" in context:
            context["body"] = rewrite(context["body"])

    app.connect("html-page-context", process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
