"""A figure as a page of its own."""

from __future__ import annotations

import pytest

from motionlab import show
from motionlab.datasets import gaits
from motionlab.viewer.live import whole_page as module
from motionlab.viewer.live.figure import PageFigure
from motionlab.viewer.live.player import Player
from motionlab.viewer.live.whole_page import whole_page


@pytest.mark.parametrize(("variable", "page", "kind"), [
    ("", None, Player), ("page", None, PageFigure), ("", True, PageFigure), ("page", False, Player),
])  # fmt: skip
def test_show_makes_a_page_s_figure_if_it_is_told(monkeypatch, variable, page, kind):
    monkeypatch.setenv("MOTIONLAB_VIEWER", variable)
    monkeypatch.setattr("motionlab.viewer.live.show.still_picture", lambda track: "data:,")
    assert isinstance(show(gaits.make(seconds=0.1), page=page), kind)


def test_nothing_in_it_ends_it_early(tmp_path, monkeypatch):
    script = tmp_path / "player.js"
    script.write_text('const end = "</script>", braces = `{0}`;', encoding="utf-8")
    monkeypatch.setattr(module, "bundle_path", lambda: script)
    page = whole_page(PageFigure("<figure></figure>"), "a <b> & {c}", "30 frames")
    assert page.count("</script>") == 1 and "<title>a &lt;b&gt; &amp; {c}</title>" in page
    assert 'const end = "<\\/script>", braces = `{0}`;' in page
