"""A claim that is named in the text, W8 or Z1-plain, leads to its row in the ledger, and says what it is.

    :::{verdicts} 4
    :::

is a table of all claims of chapter 4 with their verdicts, as the ledger has them today.
"""

import re
import sys
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).resolve().parents[2]
LEDGER = "book/claims"
NAME = re.compile(r"\b[WZS]\d+(?:-[a-z]+)*\b")
NO_TEXT = (nodes.reference, nodes.title, nodes.literal, nodes.FixedTextElement, nodes.math)
# A row that is led to from elsewhere is open.
OPEN = """
const openClaim = () => {
  const row = document.getElementById(location.hash.slice(1));
  if (row?.matches("details.claim")) row.open = true;
};
addEventListener("hashchange", openClaim);
addEventListener("DOMContentLoaded", openClaim);
"""


def judged() -> list[tuple[dict, str, str, str]]:
    """Each claim with its verdict, the class of its badge, and what must be said with it."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    from experiments.claims import verdicts

    found = []
    for claim in verdicts.claims():
        its = verdicts.judge(claim)
        found.append((claim, its.verdict, verdicts.BADGES[its.verdict], its.remark))
    return found


def told() -> dict[str, tuple[str, str]]:
    """Of each name: the row it leads to, and what it says. W1 leads to the first of W1-variety and others."""
    found = {}
    for claim, ruling, _, remark in judged():
        more = f": {remark}" if remark else ""
        said = claim["id"].lower(), f"{claim['claim']} ({ruling}{more})"
        found[claim["id"]] = said
        found.setdefault(claim["id"].partition("-")[0], said)
    return found


def table(chapter: int) -> list[str]:
    """Lines of a table in Markdown: the claims of a chapter and their verdicts."""
    rows = [
        f"| {claim['id']} | {claim['claim']} [{ruling}]{{.verdict .{badge}}} {remark} |"
        for claim, ruling, badge, remark in judged()
        if claim.get("chapter") == chapter
    ]
    if not rows:
        raise ValueError(f"no claim is told in chapter {chapter}")
    return ["| | what is claimed, and what became of it here |", "|---|---|", *rows]


class Verdicts(SphinxDirective):
    """The table of a chapter's claims."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        try:
            lines = table(int(self.arguments[0]))
        except ValueError as error:
            raise self.error(f"verdicts: {error}") from error
        found = nodes.container(classes=["verdicts"])
        self.state.nested_parse(StringList(lines, source=__file__), 0, found)
        return [found]


def link(document: nodes.document, known: dict[str, tuple[str, str]], ledger: str) -> None:
    """Make links of the names in a document; ledger : where the ledger is, as seen from there."""
    for text in list(document.findall(nodes.Text)):
        if _is_text(text) and NAME.search(text):
            text.parent.replace(text, list(_parts(str(text), known, ledger)))


def _is_text(text: nodes.Text) -> bool:
    node = text.parent
    while node is not None and not isinstance(node, NO_TEXT):
        node = node.parent
    return node is None


def _parts(text: str, known: dict[str, tuple[str, str]], ledger: str):
    at = 0
    for found in NAME.finditer(text):
        if found[0] in known:
            row, said = known[found[0]]
            yield nodes.Text(text[at : found.start()])
            yield nodes.reference(
                "", found[0], refuri=f"{ledger}#{row}", reftitle=said, internal=True
            )
            at = found.end()
    yield nodes.Text(text[at:])


def setup(app: Sphinx) -> dict:
    def process(app, doctree, docname):
        if app.builder.format == "html" and docname != LEDGER:
            link(doctree, known, app.builder.get_relative_uri(docname, LEDGER))

    known = told()
    app.add_directive("verdicts", Verdicts)
    app.connect("doctree-resolved", process)
    app.add_js_file(None, body=OPEN, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
