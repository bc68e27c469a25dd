"""Hidden cells that show nothing fold with the hidden cell after them: "Show the code" once, not four times.

A chapter begins with a player, and before it come imports and small helpers. Each of them would be a
line to pass before anything moves.
"""

from docutils import nodes
from sphinx.application import Sphinx


def fold(document: nodes.document) -> None:
    """Put the code of each silent cell whose code is hidden before that of its neighbour."""
    for cell in list(document.findall(nodes.container)):
        after = cell.next_node(nodes.container, descend=False, siblings=True)
        if _hidden(cell) and _silent(cell) and after is not None and _hidden(after):
            if cell.parent.index(after) == cell.parent.index(cell) + 1:
                after[0][:0] = cell[0].children
                cell.parent.remove(cell)


def _hidden(cell: nodes.container) -> bool:
    begins = bool(len(cell)) and cell[0].get("nb_element") == "cell_code_source"
    return begins and cell.get("nb_element") == "cell_code" and cell.get("hide_mode") == "input"


def _silent(cell: nodes.container) -> bool:
    return all(not part.children for part in cell[1:])


def setup(app: Sphinx) -> dict:
    app.connect("doctree-read", lambda app, document: fold(document))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
