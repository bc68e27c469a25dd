"""What a reader may skip folds into one line: text, code and pictures of as many cells as lie between.

    :::{aside-start} Four ways that were tried in vain
    :::

    :::{aside-end}
    :::

Both stand in one section, and no heading between them.
"""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective


class begin(nodes.Element):
    """Where an aside begins; `title` is the line that is left of it."""


class end(nodes.Element):
    """Where it ends."""


class Begin(SphinxDirective):
    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        return [begin(title=self.arguments[0])]


class End(SphinxDirective):
    def run(self) -> list[nodes.Node]:
        return [end()]


def fold(document: nodes.document, page: str) -> None:
    """Put what lies between a beginning and its end into a box that opens on a click."""
    for start in list(document.findall(begin)):
        title = start["title"]
        inside = []
        while (node := start.next_node(descend=False, siblings=True)) is not None:
            start.parent.remove(node)
            if isinstance(node, end):
                break
            if isinstance(node, begin | nodes.section):
                raise ExtensionError(
                    f"{page}: the aside {title!r} does not end before what follows"
                )
            inside.append(node)
        else:
            raise ExtensionError(f"{page}: the aside {title!r} has no end in its section")
        box = nodes.admonition("", nodes.title(title, title), classes=["aside", "dropdown"])
        start.replace_self(box)
        box += inside
    for stray in document.findall(end):
        raise ExtensionError(f"{page}: an aside ends that did not begin, at line {stray.line}")


def setup(app: Sphinx) -> dict:
    app.add_directive("aside-start", Begin)
    app.add_directive("aside-end", End)
    app.connect("doctree-read", lambda app, document: fold(document, app.env.docname))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
