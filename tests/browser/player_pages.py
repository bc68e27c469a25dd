"""Pages with players alone, a motion to show, and a window without network to open them in."""

from __future__ import annotations

from contextlib import contextmanager

import pytest
import torch

from motionlab import Motion, Skeleton

check_book = pytest.importorskip("check_book", exc_type=ImportError)

PAGE = """<!doctype html><html lang="en"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>players</title>
<script src="player.js"></script><body style="margin: 8px">{}</body></html>"""


def waving() -> Motion:
    """Ten seconds: the arms swing, the body walks 8 m."""
    skeleton, frames = Skeleton.canonical(), 300
    turns = torch.eye(3).repeat(frames, skeleton.joints, 1, 1)
    angle = torch.sin(torch.arange(frames) / 8)
    for role in ("left_upper_arm", "right_upper_leg"):
        spin = turns[:, skeleton.index(role)]
        spin[:, 1, 1] = spin[:, 2, 2] = angle.cos()
        spin[:, 1, 2], spin[:, 2, 1] = -angle.sin(), angle.sin()
    root = torch.zeros(frames, 3)
    root[:, 1], root[:, 2] = 0.85, torch.linspace(0, 8, frames)
    contacts = torch.rand(frames, 4, generator=torch.Generator().manual_seed(0)) > 0.5
    return Motion(skeleton, root, turns, 30.0, "walk", contacts=contacts)


@contextmanager
def opened(browser, file, flags=(), **settings):
    """The page in a fresh window without network; fails if it logged an error or asked for more."""
    size = {"width": 700, "height": 700}
    window = browser.new_context(**{"viewport": size, "offline": True, **settings})
    visit = check_book.Visit(window, file.as_uri())
    try:
        yield visit.page
        assert visit.troubles == []
        assert {url.rsplit("/", 1)[1] for url in visit.loaded if "data:" not in url} <= {
            file.name,
            "player.js",
        }
    finally:
        window.close()


def first(page):
    return page.locator("figure.motionlab-player").first


def frame(figure) -> int:
    return int(figure.get_attribute("data-frame"))


def picture(page, figure) -> bytes:
    page.wait_for_timeout(500)
    return figure.locator("canvas").screenshot()
