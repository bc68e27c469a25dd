"""A page holds no widgets: what they showed stands there in their place."""

import copy

import nbformat
import pytest

BARS = """
from tqdm.auto import tqdm
import ipywidgets
for step in tqdm(range(3), disable=False): pass
for step in tqdm(range(3), disable=False, leave=False): pass
print("trained")
"""
SLIDERS = """
def score(threshold, width):
    print(f"precision {threshold + width:.2f}")

ipywidgets.interactive(
    score, threshold=ipywidgets.FloatSlider(0.25, min=0, max=2), width=ipywidgets.IntSlider(3)
)
"""
ALONE = "import ipywidgets\nipywidgets.IntSlider(3)"


@pytest.fixture(scope="module")
def executed(tool, tmp_path_factory):
    """Execute cells as the build does."""

    def page(*cells):
        path = tmp_path_factory.mktemp("page") / "page.ipynb"
        nbformat.write(
            nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in cells]), path
        )
        run = tool("execute").Run(path, lambda at, of: None)
        run.execute()
        assert run.error is None
        return run.notebook

    return page


@pytest.fixture(scope="module")
def page(executed):
    return executed(BARS, SLIDERS, "'no widget'")


@pytest.mark.slow
def test_bars_go_and_sliders_become_what_they_gave(tool, page):
    shown = tool("without_kernel").without_widgets(copy.deepcopy(page))
    assert "widget" in str(page) and "widget" in str(page.metadata)
    assert "vnd.jupyter" not in str(shown)
    bars, sliders, plain = (cell.outputs for cell in shown.cells)
    assert [output.get("text") for output in bars if output.get("name") != "stderr"] == [
        "trained\n"
    ]
    line, given = sliders
    assert "threshold 0.25, width 3" in line.data["text/html"]
    assert given.text == "precision 3.25\n"
    assert plain == page.cells[2].outputs
    nbformat.validate(shown)


@pytest.mark.slow
def test_it_is_found_as_the_page_that_it_was(tool, page, tmp_path):
    """Else MyST-NB would execute the page anew, and not as the book does."""
    from jupyter_cache import get_cache
    from jupyter_cache.base import CacheBundleIn

    cache = get_cache(tmp_path / "cache")
    shown = tool("without_kernel").without_widgets(copy.deepcopy(page))
    kept = cache.cache_notebook_bundle(CacheBundleIn(shown, "page.ipynb"), check_validity=False)
    for cell in page.cells:
        cell.outputs = []
    assert cache.match_cache_notebook(page).pk == kept.pk


@pytest.mark.slow
def test_a_widget_that_a_page_can_t_move_stops_the_build(tool, executed):
    with pytest.raises(ValueError, match="code cell 2: .*viewer.knobs"):
        tool("without_kernel").without_widgets(executed("1", ALONE))
