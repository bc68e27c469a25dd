"""Hidden cells that show nothing fold with the next one."""

from docutils import nodes


def cell(code, output="", hidden=True):
    """As myst-nb makes it."""
    made = nodes.container(nb_element="cell_code", classes=["cell"])
    if hidden:
        made["hide_mode"] = "input"
    source = nodes.container("", nodes.literal_block(code, code), nb_element="cell_code_source")
    made += source
    if output:
        told = nodes.container("", nodes.paragraph(output, output), nb_element="cell_code_output")
        made += told
    return made


def test_silent_cells_fold_with_the_hidden_cell_after_them_and_others_stay(extension):
    from docutils.utils import new_document

    page = new_document("page")
    page += [
        cell("import a"), cell("b = 1"), cell("show(b)", "a player"),  # one
        cell("c = 2"), nodes.paragraph("text", "text"), cell("show(c)", "a picture"),
        cell("print(d)", "told first"), cell("e = 3"), cell("seen(e)", "seen", hidden=False),
    ]  # fmt: skip
    extension("folded").fold(page)
    cells = [part for part in page if isinstance(part, nodes.container)]
    codes = [[block.astext() for block in part[0]] for part in cells]
    assert codes == [
        ["import a", "b = 1", "show(b)"], ["c = 2"], ["show(c)"], ["print(d)"], ["e = 3"], ["seen(e)"],
    ]  # fmt: skip
    assert cells[0][-1].astext() == "a player"
