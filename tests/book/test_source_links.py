"""The way back from a name's source to the reference."""

import pytest

PAGES = {
    "motionlab.solvers.design.finished": "book/api/solvers_path",
    "motionlab.viewer.scene": "book/api/viewer_live",
    "motionlab.one.twice": "book/api/two",
    "motionlab.other.twice": "book/api/two",
}


@pytest.fixture(scope="module")
def rewrite(extension):
    return lambda body: extension("source_links").rewrite(body, PAGES)


def back(page, name):
    return f'<a class="viewcode-back" href="../../../{page}.html#{name}">[docs]</a>'


@pytest.mark.parametrize(
    ("page", "written", "led"),
    [
        ("solvers_path", "motionlab.finished", "motionlab.solvers.design.finished"),
        ("viewer_live", "motionlab.viewer.live.scene3d.scene", "motionlab.viewer.scene"),
        ("viewer_live", "motionlab.viewer.scene", "motionlab.viewer.scene"),  # was right
        ("solvers_path", "motionlab.scene", "motionlab.scene"),  # is explained elsewhere
        ("two", "motionlab.twice", "motionlab.twice"),  # nobody knows which
    ],
)
def test_a_link_leads_to_the_name_that_the_reference_has(rewrite, page, written, led):
    page = f"book/api/{page}"
    assert rewrite(back(page, written)) == back(page, led)


def test_other_links_stay(rewrite):
    other = '<a href="book/api/solvers_path.html#motionlab.finished">finished</a>'
    assert rewrite(other) == other


def test_second_names_and_modules_have_no_place_in_the_reference(extension):
    from sphinx.domains.python import ObjectEntry

    objects = {
        "motionlab.solvers.design.finished": ObjectEntry("api", "x", "function", False),
        "motionlab.finished": ObjectEntry("api", "x", "function", True),
        "motionlab.solvers": ObjectEntry("api", "y", "module", False),
    }
    assert extension("source_links").explained(objects) == {
        "motionlab.solvers.design.finished": "api"
    }
