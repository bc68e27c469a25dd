"""The page that `motionlab look` writes, opened from disk without a network."""

from __future__ import annotations

import pytest

from motionlab import write_bvh
from motionlab.__main__ import main
from motionlab.datasets import gaits

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_it_plays_and_asks_for_nothing(browser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_bvh(gaits.make(seconds=3), "walk.bvh")
    assert main(["look", "walk.bvh"]) == 0
    window = browser.new_context(viewport={"width": 700, "height": 800}, offline=True)
    visit = check_book.Visit(window, (tmp_path / "walk.html").as_uri())
    figure = visit.page.locator("figure.motionlab-player")
    figure.get_by_role("button", name="Pause").click()
    pictures = []
    for frame in (0, 60):
        figure.get_by_label("Frame").fill(str(frame))
        visit.page.wait_for_timeout(500)
        pictures.append(figure.locator("canvas").screenshot())
    assert pictures[0] != pictures[1]
    assert visit.troubles == []
    assert [url for url in visit.loaded if "data:" not in url and "walk.html" not in url] == []
    window.close()
