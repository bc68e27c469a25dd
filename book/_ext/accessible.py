"""What Sphinx and its themes write that a screen reader can't make sense of, written anew.

* "Show the code" is named "Toggle hidden content" to those who listen: they are to hear what is seen.
* References are a list whose entries are no list items: no list.
* A picture without a name is called by its file's.
* The search button is named "Search" and says "Search Ctrl+K"; the names of the colour button's
  pictures would do as well as its own.
* What folds the pages of a subject in the sidebar has no name.
* All exercises of a page, and their solutions, have one and the same id.
* A table, a formula or a line of code that is wider than the page scrolls, but not by keys.

What is left is seen by tests/browser/check_access.py.
"""

import re
from pathlib import Path

from sphinx.application import Sphinx

EXERCISE = re.compile(r'<section id="(exercise|solution)-content">')
UNNAMED = re.compile(r'alt="(\.\./)*_images/[0-9a-f]{32,}\.\w+"')
REACHED = """
addEventListener("DOMContentLoaded", () => {
  const reach = () => {
    for (const box of document.querySelectorAll(".bd-article :is(table, pre, mjx-container[display])")) {
      if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
    }
  };
  reach();
  addEventListener("toggle", reach, true); // what was folded has no width before
  addEventListener("click", () => setTimeout(reach));
  addEventListener("resize", reach);
  addEventListener("load", () => window.MathJax?.startup?.promise.then(reach));
});
"""


# Of the theme's buttons, which are in no page's body. A script would do it too late now and then: another
# one draws the pictures, names and all.
BUTTONS = (
    re.compile(r'(<button class="btn search-button-field[^>]*?)\s+aria-label="Search"'),
    re.compile(r'(<i class="theme-switch [^>]*?)\s+title="[^"]*"'),
)


FOLD = '<summary><span class="toctree-toggle"'


def buttons(page: str) -> str:
    """A whole page whose buttons are named as they are seen."""
    for names in BUTTONS:
        page = names.sub(r"\1", page)
    return page.replace(
        FOLD, FOLD.replace("<summary>", '<summary aria-label="Pages of this subject">')
    )


def rewrite(body: str) -> str:
    """The same HTML without these faults."""
    body = body.replace('<summary aria-label="Toggle hidden content">', "<summary>")
    body = body.replace('<div role="list" class="citation-list">', '<div class="citation-list">')
    body = EXERCISE.sub("<section>", body)
    return UNNAMED.sub('alt="A picture that the code above draws"', body)


def setup(app: Sphinx) -> dict:
    def process(app, pagename, templatename, context, doctree):
        if "body" in context:
            context["body"] = rewrite(context["body"])

    def finish(app, exception):
        if exception is None and app.builder.format == "html":
            for path in Path(app.outdir).rglob("*.html"):
                if "_static" not in path.parts:
                    path.write_text(buttons(path.read_text(encoding="utf-8")), encoding="utf-8")

    app.connect("html-page-context", process)
    app.connect("build-finished", finish)
    app.add_js_file(None, body=REACHED, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
