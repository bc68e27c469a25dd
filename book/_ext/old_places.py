"""Links to a name on the one page that the reference was: book/api.html#motionlab.motion.Motion.

Its index is there now. A small script in it finds the page on which the name stands today.
"""

import json
from collections.abc import Iterable

from docutils import nodes
from sphinx.application import Sphinx

INDEX, PAGES = "book/api", "book/api/"
SCRIPT = """
addEventListener("DOMContentLoaded", () => {
  const pages = PLACES;
  const follow = () => {
    const id = decodeURIComponent(location.hash.slice(1));
    if (!id || document.getElementById(id)) return;
    let name = id.replace(/^module-/, "");
    while (name && !Object.hasOwn(pages, name)) name = name.slice(0, Math.max(0, name.lastIndexOf(".")));
    if (name) location.replace(pages[name] + ".html#" + id);
  };
  follow();
  addEventListener("hashchange", follow);
});
"""


def places(named: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Page by name, for those names alone whose page isn't that of what they are in.

    named : dotted names and their pages.
    """
    found: dict[str, str] = {}
    for name, page in sorted(named):
        around = name
        while around and around not in found:
            around = around.rpartition(".")[0]
        if found.get(around) != page:
            found[name] = page
    return found


def script(pages: dict[str, str]) -> str:
    """What the index runs, with its table of pages."""
    return SCRIPT.replace("PLACES", json.dumps(pages))


def named(env) -> Iterable[tuple[str, str]]:
    """Modules, what stands in them, and headings, of all pages of the reference."""
    for name, entry in env.get_domain("py").objects.items():
        if entry.docname.startswith(PAGES):
            yield name, f"api/{entry.docname.removeprefix(PAGES)}"
    for page in sorted(env.tocs):
        if page.startswith(PAGES):
            for heading in env.tocs[page].findall(nodes.reference):
                if not heading["anchorname"].startswith("#motionlab."):
                    yield nodes.make_id(heading.astext()), f"api/{page.removeprefix(PAGES)}"


def setup(app: Sphinx) -> dict:
    def lead(app, pagename, templatename, context, doctree):
        if pagename == INDEX:
            app.add_js_file(None, body=script(places(named(app.env))))

    app.connect("html-page-context", lead)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
