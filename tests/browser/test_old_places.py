"""Links to the one page that the reference was lead to the page where a name stands now."""

import pytest

NAMED = [
    ("motionlab.motion", "api/motion"),
    ("motionlab.motion.Motion", "api/motion"),
    ("motionlab.metrics", "api/metrics"),
    ("motionlab.metrics.feet", "api/metrics"),
    ("motionlab.metrics.loops", "api/methods"),
    ("motionlab.metrics.loops.loop", "api/methods"),
    ("motionlab.design", "api/solvers"),
    ("retargeting", "api/retargeting"),
]


@pytest.fixture(scope="module")
def old_places(extension):
    return extension("old_places")


def test_a_name_that_stands_with_its_module_needs_no_entry(old_places):
    assert old_places.places(reversed(NAMED)) == {
        "motionlab.design": "api/solvers",
        "motionlab.metrics": "api/metrics",
        "motionlab.metrics.loops": "api/methods",
        "motionlab.motion": "api/motion",
        "retargeting": "api/retargeting",
    }


@pytest.fixture(scope="module")
def folder(old_places, tmp_path_factory):
    folder = tmp_path_factory.mktemp("book")
    (folder / "api").mkdir()
    for page in ("motion", "metrics", "methods", "solvers", "retargeting"):
        (folder / "api" / f"{page}.html").write_text("<h1>here</h1>", encoding="utf-8")
    script = old_places.script(old_places.places(NAMED))
    index = f"<script>{script}</script><h2 id='solvers'>Solvers</h2>"
    (folder / "api.html").write_text(index, encoding="utf-8")
    return folder


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "leads"),
    [
        ("motionlab.motion.Motion.mirror", "api/motion.html"),
        ("module-motionlab.metrics.feet", "api/metrics.html"),
        ("motionlab.metrics.loops.Loop.frames", "api/methods.html"),
        ("motionlab.design", "api/solvers.html"),
        ("retargeting", "api/retargeting.html"),
        ("solvers", "api.html"),  # a heading of the index itself
        ("constructor", "api.html"),  # nowhere: a reader sees the index
    ],
)
def test_an_old_link_leads_to_the_page(browser, folder, asked, leads):
    page = browser.new_page()
    page.goto(f"{(folder / 'api.html').as_uri()}#{asked}")
    page.wait_for_url(f"{(folder / leads).as_uri()}#{asked}")
    page.close()
