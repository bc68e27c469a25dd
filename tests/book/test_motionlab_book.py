"""What pages of the book load, and what they do without."""

from types import SimpleNamespace

import pytest


@pytest.mark.parametrize(
    ("body", "loaded"),
    [("<p>no formula costs 5 $</p>", ["player.js"]),
     ('<span class="math notranslate">x</span>', ["mathjax.js", "player.js"])],
)  # fmt: skip
def test_formulas_are_drawn_where_there_are_any(extension, body, loaded):
    scripts = [SimpleNamespace(filename=f"_static/{name}") for name in ("mathjax.js", "player.js")]
    inline = SimpleNamespace(filename=None)
    context = {"body": body, "script_files": [*scripts, inline]}
    extension("motionlab_book").drop_formulas(None, "index", "page.html", context, None)
    kept = [script.filename for script in context["script_files"]]
    assert kept == [*(f"_static/{name}" for name in loaded), None]
