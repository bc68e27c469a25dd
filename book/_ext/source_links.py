"""The way back from the source of a name to where the reference explains it.

Sphinx writes it from the module's first name alone: where the reference calls others of that module
by another path (motionlab.scene, from motionlab/viewer/live), their links lead nowhere. Here they
lead to the name of that page that ends alike.
"""

import re
from collections.abc import Mapping

from sphinx.application import Sphinx
from sphinx.domains.python import ObjectEntry

BACK = re.compile(r'(<a class="viewcode-back" href="[^"#]*?)([\w/]+)(\.html#)([\w.]+)"')


def rewrite(body: str, pages: Mapping[str, str]) -> str:
    """The same HTML with these links led right.

    pages : names that the reference explains, without modules, and their pages.
    """

    def led(found: re.Match) -> str:
        before, page, between, name = found.groups()
        end = "." + name.rpartition(".")[2]
        alike = [n for n, at in pages.items() if n.endswith(end) and page.endswith(at)]
        if name in pages or len(alike) != 1:
            return found[0]
        return f'{before}{page}{between}{alike[0]}"'

    return BACK.sub(led, body)


def explained(objects: Mapping[str, ObjectEntry]) -> dict[str, str]:
    """Names that have a place in the reference, and their pages: no modules, no second names."""
    return {
        name: its.docname
        for name, its in objects.items()
        if its.objtype != "module" and not its.aliased
    }


def setup(app: Sphinx) -> dict:
    def process(app, pagename, templatename, context, doctree):
        if pagename.startswith("_modules/") and "body" in context:
            pages = explained(app.env.get_domain("py").objects)
            context["body"] = rewrite(context["body"], pages)

    app.connect("html-page-context", process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
