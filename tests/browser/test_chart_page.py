"""A chart under knobs in a page from disk: its knobs move it, in both themes."""

from __future__ import annotations

import pytest

from motionlab.viewer.live.chart_knobs import Bar, chart_knobs

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>chart</title><body style="margin: 8px">{}</body></html>"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    make = lambda up, on: ([Bar("mocap", 2 + up, 1.5 + up, 2.5 + up, 2.0)], f"up {up:g}, {on}")
    figure = chart_knobs(make, {"up": (0, 1, 2), "on": (False, True)}, ends=(1, 5), unit="rating")
    (tmp_path / "page.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    return tmp_path


def test_its_knobs_move_it(visit):
    one = visit(viewport={"width": 390, "height": 600})
    page = one.page
    place = lambda: float(page.locator("circle").get_attribute("cx"))
    before = place()
    page.get_by_role("slider").press("ArrowRight")
    page.get_by_role("checkbox").check()
    assert place() > before and page.get_by_text("up 1, True").is_visible()
    assert page.get_by_role("img", name="mocap 3.00").is_visible()
    one.check_width()
