"""Where a player's camera stands at first, and the lines below its picture."""

from __future__ import annotations

import shutil

import pytest

from motionlab.viewer.live.player import bundle_path
from motionlab.viewer.live.show import show

pytest.importorskip("check_book", exc_type=ImportError)
from player_pages import PAGE, first, opened, waving  # noqa: E402

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def page_file(tmp_path):
    shutil.copy(bundle_path(), tmp_path / "player.js")
    return tmp_path / "page.html"


def test_a_camera_that_looks_at_the_feet_stands_near_them(browser, page_file):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figures = [show(waving(), focus=focus, height=240) for focus in ("body", "feet")]
    file = page_file.with_name("focus.html")
    file.write_text(PAGE.format("".join(figure.html for figure in figures)), encoding="utf-8")
    orbits = "[...document.querySelectorAll('figure')].map((f) => f.motionlab.orbit)"
    stands = f"{orbits}.map((o) => [o.distance, o.controls.target.y])"
    with opened(browser, file) as page:
        page.wait_for_selector("canvas")
        (far, hips), (near, ankles) = page.evaluate(stands)
        assert 0 < near < 0.6 * far and 0 < ankles < hips / 2
        page.locator("canvas").nth(1).press("+")
        assert page.evaluate(stands)[1][0] < near
        page.locator("canvas").nth(1).press("r")  # back to where it stood at first
        assert page.evaluate(stands)[1] == pytest.approx([near, ankles], rel=1e-3)


def test_a_cursor_in_the_chart_follows_the_player_and_leads_it(browser, page_file):
    height = [frame if frame < 200 else float("nan") for frame in range(300)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figure = show(waving(), chart={"toe": height}, chart_label="height (cm)", height=240)
    file = page_file.with_name("chart.html")
    file.write_text(PAGE.format(figure.html), encoding="utf-8")
    with opened(browser, file, reduced_motion="reduce") as page:
        page.wait_for_selector(".ml-overtime")
        player = "document.querySelector('figure').motionlab"
        cursor, told = page.locator(".ml-overtime-now"), page.locator(".ml-overtime output")
        page.evaluate(f"{player}.setFrame(150)")
        assert float(cursor.get_attribute("x1")) == pytest.approx(1000 * 150 / 299)
        assert told.inner_text() == "150"
        assert cursor.evaluate("line => getComputedStyle(line).visibility") == "visible"
        page.evaluate(f"{player}.setFrame(250)")
        assert told.inner_text() == ""
        box = page.locator(".ml-overtime-plot").bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
        assert abs(page.evaluate(f"{player}.frame") - 149) <= 2
        assert page.get_by_role("img", name="height (cm), over time: toe").count() == 1
        page.set_viewport_size({"width": 390, "height": 700})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_line_that_is_clicked_is_the_motion_that_plays(browser, page_file):
    high, low, gone = [9.0] * 300, [1.0] * 300, [5.0] * 100 + [float("nan")] * 200
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        made = show([waving(), waving().mirror(), waving()[:100]], labels=["a", "b", "c"], choose="walk",
                    chart={"a": high, "b": low, "c": gone}, chart_label="speed (m/s)", height=240)  # fmt: skip
    file = page_file.with_name("picks.html")
    file.write_text(PAGE.format(made.html), encoding="utf-8")
    with opened(browser, file, reduced_motion="reduce") as page:
        figure = first(page)
        figure.locator(".ml-label").wait_for()
        assert figure.locator(".ml-label").inner_text() == "a"
        assert figure.get_by_role("slider").count() == 1  # time's alone
        player = "document.querySelector('figure').motionlab"
        box = figure.locator(".ml-overtime-plot").bounding_box()

        def click(across, down):
            place = [box["x"] + across * box["width"], box["y"] + down * box["height"]]
            page.mouse.click(*place)
            return page.evaluate(f"[{player}.chosen, {player}.playing, {player}.frame]")

        chosen, playing, frame = click(0.5, 0.8)
        assert (chosen, playing) == (1, True) and frame >= 148
        page.wait_for_function("document.querySelector('.ml-label').textContent === 'b'")
        bold = "line => getComputedStyle(line).strokeWidth"
        assert figure.locator(".ml-picked").count() == 1
        assert figure.locator(".ml-picked").evaluate(bold) == "3.5px"
        page.wait_for_function(f"{player}.frame > {frame}")
        assert click(0.1, 0.5)[:2] == [2, True]
        assert click(0.9, 0.1)[:2] == [0, True]  # where the shorter one is no more
        page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.8 * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.8 * box["height"])
        page.mouse.up()
        dragged = page.evaluate(f"[{player}.chosen, {player}.playing]")
        assert dragged == [0, False]  # through time, at the same line


def test_the_names_of_lines_choose_as_a_click_does(browser, page_file):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figures = [
            show([waving(), waving().mirror()], labels=["a", "b"], choose="walk",
                 chart={"a": [1.0] * 300, "b": [2.0] * 300}, height=240)
            for _ in range(2)
        ]  # fmt: skip
    file = page_file.with_name("names.html")
    file.write_text(PAGE.format("".join(figure.html for figure in figures)), encoding="utf-8")
    with opened(browser, file, reduced_motion="reduce") as page:
        page.wait_for_selector(".ml-label")
        group, other = (page.get_by_role("radiogroup", name="walk").nth(i) for i in (0, 1))
        group.get_by_role("radio", name="a").focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("document.querySelector('.ml-label').textContent === 'b'")
        assert group.get_by_role("radio", name="b").is_checked()
        assert other.get_by_role("radio", name="a").is_checked()  # a group of its own
        states = "[...document.querySelectorAll('figure')].map((f) => f.motionlab.playing)"
        assert page.evaluate(states) == [True, False]
        page.evaluate("document.querySelector('figure').motionlab.set('chosen', 0)")
        assert group.get_by_role("radio", name="a").is_checked()
        page.set_viewport_size({"width": 390, "height": 700})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
