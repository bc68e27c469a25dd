"""A browser for pages; machines without one skip what needs it."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module")
def browser():
    check_book = pytest.importorskip("check_book", exc_type=ImportError)
    sync_api = pytest.importorskip("playwright.sync_api")
    try:
        path = check_book.chromium()
    except SystemExit as missing:
        pytest.skip(str(missing))
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=check_book.FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def size():
    """Of the windows that `visit` opens; a module may have its own."""
    return {"width": 900, "height": 900}


@pytest.fixture
def visit(browser, folder, size):
    """Opens a page of a module's folder without network; at the end, nothing may have gone wrong."""
    import check_book

    opened = []

    def visit(name: str = "page.html", **settings) -> check_book.Visit:
        window = browser.new_context(**{"viewport": size, "offline": True, **settings})
        opened.append(check_book.Visit(window, (folder / name).as_uri()))
        return opened[-1]

    yield visit
    for one in opened:
        assert one.troubles == []
        one.page.context.close()
