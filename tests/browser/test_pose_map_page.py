"""The map of poses in a page: a click, a drag and a key show the poses that were found beforehand."""

from __future__ import annotations

import pytest
import torch

from motionlab import Skeleton
from motionlab.viewer import pose_map

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAGE = """<!doctype html><html lang="en"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>map</title>
<body style="margin: 8px">{}</body></html>"""
ROWS, COLUMNS = 3, 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Poses whose every x is their column in metres, every y their row, every z 0."""
    folder = tmp_path_factory.mktemp("map")
    row, column = torch.meshgrid(torch.arange(ROWS), torch.arange(COLUMNS), indexing="ij")
    pose = torch.stack([column, row, 0 * row], -1).float()
    body = Skeleton.canonical()
    figure = pose_map(pose[:, :, None].expand(-1, -1, body.joints, 3), body)
    (folder / "page.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    return folder


def shown(page):
    """x and y in metres of the first joint."""
    numbers = page.locator("figure").get_attribute("data-pose").split(",")
    return float(numbers[0]) / 1000, float(numbers[1]) / 1000


@pytest.mark.parametrize("width", [900, 390])
def test_a_click_a_drag_and_a_key(visit, width):
    page = visit(viewport={"width": width, "height": 900}).page
    assert shown(page) == pytest.approx((2.0, 1.0), abs=0.01)
    box = page.locator("canvas.map").bounding_box()
    assert box["x"] + box["width"] <= width
    where = lambda x, y: (box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"])
    page.mouse.click(*where(0.25, 0.75))
    assert shown(page) == pytest.approx((1.0, 1.5), abs=0.05)
    page.mouse.move(*where(0.5, 0.5))
    assert shown(page) == pytest.approx((1.0, 1.5), abs=0.05), "no button is down"
    page.mouse.down()
    page.mouse.move(*where(0.75, 0.25))
    page.mouse.up()
    assert shown(page) == pytest.approx((3.0, 0.5), abs=0.05)
    page.locator("canvas.map").focus()
    page.keyboard.press("ArrowLeft")
    assert shown(page)[0] == pytest.approx(3.0 - 4 / 40, abs=0.05)
    page.mouse.move(*where(0.5, 0.5))
    page.mouse.down()
    page.mouse.move(0, 0)  # beyond the map
    page.mouse.up()
    assert shown(page) == pytest.approx((0.0, 2.0), abs=0.01)
