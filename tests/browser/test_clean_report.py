"""The report of `motionlab clean`, opened from disk: it plays, marks what was not believed, fits a phone."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from motionlab import corrupt
from motionlab.commands.clean_report import write_report
from motionlab.datasets import gaits

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    walk = gaits.make(seconds=2, speed=1.2, name="walk")
    seen = corrupt.tremble(walk, 0.01, 0.04, generator=torch.Generator().manual_seed(0))
    places = seen.root_positions.clone()
    places[[20, 41]] += torch.tensor([0.6, 0.0, 0.4])
    wild = replace(seen, root_positions=places)
    write_report(wild, walk, ["noise 1.0 cm"], folder / "page.html", [20, 41])
    return folder


@pytest.mark.parametrize("width", [1280, 390])
def test_a_report_plays_and_marks_what_was_not_believed(visit, width):
    seen = visit(viewport={"width": width, "height": 900})
    page = seen.page
    assert page.locator("canvas").first.is_visible()
    first = page.locator(".curve svg").first
    assert first.locator(".wild").count() == 2
    box = first.bounding_box()
    for line in first.locator("polyline").all():
        inside = line.bounding_box()
        stroke = 2  # which a bounding box counts in
        assert box["y"] - stroke <= inside["y"] and inside["height"] <= box["height"] + stroke
        assert inside["height"] > box["height"] / 4  # not pressed flat by what is wild
    assert page.locator("table tr").count() == 22
    seen.check_width()
    assert seen.troubles == []
