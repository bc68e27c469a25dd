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
