"""The player in a page opened from disk, as a reader meets it: no kernel, no server, no network."""

from __future__ import annotations

import shutil
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import torch
from PIL import Image

from motionlab import Motion
from motionlab.viewer.live.knobs import knobs
from motionlab.viewer.live.player import bundle_path
from motionlab.viewer.live.show import show

check_book = pytest.importorskip("check_book", exc_type=ImportError)
from player_pages import PAGE, first, frame, opened, picture, waving  # noqa: E402

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    shutil.copy(bundle_path(), folder / "player.js")
    motion = waving()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figures = [
            show(motion, contacts=True, trail="left_hand", paths=[[0, 0], [0, 8]], height=240),
            show([motion, motion.mirror()], labels=["mocap", "RNN"], caption="two", height=240),
            *[show(motion[:20], height=160) for _ in range(16)],  # more than WebGL contexts
        ]
    html = PAGE.format("<p>text</p>".join(figure.html for figure in figures))
    (folder / "page.html").write_text(html, encoding="utf-8")
    return folder / "page.html"


def test_it_plays_scrubs_and_listens_to_keys(browser, page_file):
    with opened(browser, page_file) as page:
        figure = first(page)
        before, start = picture(page, figure), frame(figure)
        page.wait_for_timeout(700)
        assert picture(page, figure) != before and frame(figure) != start

        figure.get_by_role("button", name="Pause").click()
        figure.get_by_label("Frame").fill("200")
        assert frame(figure) == 200
        there = picture(page, figure)
        figure.get_by_label("Frame").fill("30")
        assert picture(page, figure) != there

        figure.locator("canvas").focus()
        for key, expected in {"ArrowRight": 31, "End": 299, "PageUp": 269, "Home": 0}.items():
            page.keyboard.press(key)
            assert frame(figure) == expected, key
        still = picture(page, figure)
        page.keyboard.press("Shift+ArrowLeft")
        assert picture(page, figure) != still  # turned
        page.keyboard.press("r")
        page.keyboard.press(" ")
        assert figure.evaluate("figure => figure.motionlab.playing")


def test_a_body_of_any_size_fills_the_view(browser, page_file):
    """Metres read as centimetres, and the other way round: all alike but for what the lines tell."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        sizes = [scaled(waving(), factor) for factor in (1, 0.01, 100)]
        figures = [show(motion, trail="left_hand", height=240) for motion in sizes]
    file = page_file.with_name("sizes.html")
    file.write_text(PAGE.format("".join(figure.html for figure in figures)), encoding="utf-8")
    with opened(browser, file, reduced_motion="reduce") as page:
        pictures = []
        for figure in page.locator("figure.motionlab-player").all():
            figure.scroll_into_view_if_needed()
            figure.get_by_label("Frame").fill("100")
            page.add_style_tag(content=".ml-scale { opacity: 0 }")
            pictures.append(
                np.array(Image.open(BytesIO(picture(page, figure))).convert("L"), float)
            )
        assert pictures[0].min() < 0.5 * pictures[0].max()
        for other in pictures[1:]:
            assert (np.abs(other - pictures[0]) > 10).mean() < 0.002
        assert page.locator(".ml-scale").all_inner_texts() == [
            "Lines on the floor: every 5 mm",
            "Lines on the floor: every 50 m",
        ]


def scaled(motion: Motion, factor: float) -> Motion:
    body = motion.skeleton
    other = replace(body, offsets=factor * body.offsets, end_offsets=factor * body.end_offsets)
    return replace(motion, skeleton=other, root_positions=factor * motion.root_positions)


def test_dragging_turns_the_view(browser, page_file):
    with opened(browser, page_file, reduced_motion="reduce") as page:
        figure = first(page)
        before = picture(page, figure)
        box = figure.locator("canvas").bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 220, box["y"] + 110, steps=4)
        page.mouse.up()
        assert picture(page, figure) != before


def test_every_control_has_a_name_and_takes_focus(browser, page_file):
    with opened(browser, page_file) as page:
        controls = first(page).locator("button:visible, input, select, canvas")
        assert controls.count() == 7
        for i in range(controls.count()):
            assert controls.nth(i).get_attribute("aria-label")
            controls.nth(i).focus()
            assert controls.nth(i).evaluate("e => e === document.activeElement")


def test_several_share_one_clock_side_by_side_and_overlaid(browser, page_file):
    with opened(browser, page_file, reduced_motion="reduce") as page:
        figure = page.locator("figure.motionlab-player").nth(1)
        figure.scroll_into_view_if_needed()
        aside = picture(page, figure)
        left, right = (figure.locator(".ml-label").nth(i).bounding_box() for i in (0, 1))
        assert right["x"] - left["x"] > 200
        assert figure.locator("figcaption").inner_text() == "two"
        figure.get_by_role("button", name="Show all in one picture").click()
        assert picture(page, figure) != aside
        left, right = (figure.locator(".ml-label").nth(i).bounding_box() for i in (0, 1))
        assert 0 < right["x"] - left["x"] < 200


def test_a_slider_chooses_which_motion_is_seen(browser, page_file):
    motion = waving()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figure = show([motion, motion.mirror(), motion[:50]], labels=["0", "1/2", "1"],
                      choose="blend", chosen=1, height=240)  # fmt: skip
    file = page_file.with_name("choose.html")
    file.write_text(PAGE.format(figure.html), encoding="utf-8")
    with opened(browser, file) as page:
        page.wait_for_selector(".ml-label")
        slider = page.get_by_role("slider", name="blend")
        assert page.locator(".ml-label").all_inner_texts() == ["1/2"]
        assert slider.get_attribute("aria-valuetext") == "1/2"
        page.evaluate("document.querySelector('figure').motionlab.setFrame(30)")
        slider.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("document.querySelector('.ml-label').textContent === '1'")
        assert page.locator(".ml-choose output").inner_text() == "1"
        assert page.locator(".ml-overlay").is_hidden()
        assert page.evaluate("document.querySelector('figure').motionlab.frame") >= 30
        page.set_viewport_size({"width": 390, "height": 700})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_knobs_change_the_motion_and_what_is_said_of_it(browser, page_file):
    def make(rise, wide):
        motion = waving() if wide else waving()[:100]
        root = motion.root_positions + torch.tensor([0.0, rise, 0.0])
        return replace(motion, root_positions=root), f"rise {rise:g}, wide {wide}"

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        figure = knobs(make, {"rise": (0.0, 0.2, 0.5), "wide": (False, True)}, height=240)
    file = page_file.with_name("knobs.html")
    file.write_text(PAGE.format(figure.html), encoding="utf-8")
    chosen = "document.querySelector('figure').motionlab.chosen"
    with opened(browser, file) as page:
        page.wait_for_selector("canvas")
        assert page.locator(".said").inner_text() == "rise 0, wide False"
        assert page.evaluate(chosen) == 0
        page.get_by_role("slider", name="rise").focus()
        page.keyboard.press("ArrowRight")
        page.get_by_role("checkbox", name="wide").check()
        assert page.locator(".said").inner_text() == "rise 0.2, wide True"
        assert page.evaluate(chosen) == 3
        assert page.locator(".ml-choose").is_hidden()
        page.set_viewport_size({"width": 390, "height": 700})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


COLORS = """i => {
  const canvas = document.querySelectorAll("figure canvas")[i];
  const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 100 });
  const brush = copy.getContext("2d");
  brush.drawImage(canvas, 0, 0, 200, 100);
  return new Set(new Uint32Array(brush.getImageData(0, 0, 200, 100).data.buffer)).size;
}"""


def wait_drawn(page, number):
    """Until a player shows a picture: many different pixels, not a blank."""
    page.locator("figure.motionlab-player").nth(number).scroll_into_view_if_needed()
    page.wait_for_function(f"i => ({COLORS})(i) > 200", arg=number, timeout=20_000)


def test_more_players_than_webgl_contexts_all_show(browser, page_file):
    with opened(browser, page_file, reduced_motion="reduce") as page:
        for number in range(page.locator("figure.motionlab-player").count()):
            wait_drawn(page, number)
        wait_drawn(page, 0)  # long out of sight


def test_out_of_sight_it_holds_no_picture_and_in_print_it_does(browser, page_file):
    held = "() => [...document.querySelectorAll('figure')].map(f => [!!f.motionlab.casts, f.querySelector('canvas').width])"
    with opened(browser, page_file, reduced_motion="reduce") as page:
        page.evaluate("const set = setTimeout; setTimeout = (f, ms) => set(f, ms / 100)")
        wait_drawn(page, 0)
        wait_drawn(page, 17)
        page.wait_for_function(f"() => ({held})()[0][1] === 1")
        assert page.evaluate(held)[0] == [False, 1] and page.evaluate(held)[17][0]
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert all(casts and width > 100 for casts, width in page.evaluate(held))
        page.emulate_media(media="print")  # where each is a strip of moments that differ
        strips = page.evaluate(
            "() => [...document.querySelectorAll('figure')].map(f => "
            "[...f.querySelectorAll('.ml-strip img')].map(i => i.src))"
        )
        views = page.evaluate("() => [...document.querySelectorAll('figure')].map(f => f.motionlab.cells.length)")  # fmt: skip
        rows = [len(moments) / 6 for moments in strips]  # one for each view
        assert rows == views and all(len(set(moments)) == len(moments) for moments in strips)
        first = page.locator("figure").first
        assert (
            first.locator(".ml-strip").is_visible() and not first.locator(".ml-view").is_visible()
        )
        page.emulate_media(media="screen")
        assert (
            first.locator(".ml-view").is_visible() and not first.locator(".ml-strip").is_visible()
        )
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.locator(".ml-strip").count() == 0
        assert page.evaluate(held)[0] == [False, 1] and page.evaluate(held)[17][0]
        page.set_viewport_size({"width": 700, "height": 100})
        page.evaluate(
            "document.body.append(Object.assign(document.createElement('p'), { style: 'height: 2000px' }))"
        )
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        page.wait_for_function("__motionlab_stage_2.gone")  # nobody stands on it
        wait_drawn(page, 1)


def test_a_stage_that_the_browser_took_away_is_built_again(browser, page_file):
    """Of a tab that lay in the background, say."""
    with opened(browser, page_file, reduced_motion="reduce") as page:
        wait_drawn(page, 0)
        page.evaluate("globalThis.before = __motionlab_stage_2; before.renderer.forceContextLoss()")
        page.wait_for_function("__motionlab_stage_2 !== before && !__motionlab_stage_2.gone")
        wait_drawn(page, 0)


def test_it_rests_when_out_of_view(browser, page_file):
    with opened(browser, page_file) as page:
        figure = first(page)
        page.wait_for_timeout(500)
        page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
        page.wait_for_timeout(500)
        resting = frame(figure)
        page.wait_for_timeout(500)
        assert frame(figure) == resting


def test_reduced_motion_waits_for_the_reader(browser, page_file):
    with opened(browser, page_file, reduced_motion="reduce") as page:
        page.wait_for_timeout(800)
        assert frame(first(page)) == 0
        first(page).get_by_role("button", name="Play").click()
        page.wait_for_timeout(800)
        assert frame(first(page)) > 0


def test_it_follows_the_theme_at_run_time(browser, page_file):
    with opened(browser, page_file, reduced_motion="reduce", color_scheme="dark") as page:
        figure = first(page)
        panel = figure.locator(".ml-bar")

        def brightness():
            rgb = panel.evaluate("e => getComputedStyle(e).backgroundColor.match(/\\d+/g)")
            return np.mean([int(v) for v in rgb[:3]])

        assert figure.get_attribute("data-ml-theme") == "dark" and brightness() < 80
        dark = picture(page, figure)
        page.evaluate("document.documentElement.dataset.theme = 'light'")
        assert picture(page, figure) != dark
        assert figure.get_attribute("data-ml-theme") == "light" and brightness() > 180
        page.evaluate("document.documentElement.dataset.theme = 'dark'")
        page.wait_for_timeout(100)
        assert brightness() < 80


def test_it_fits_a_phone(browser, page_file):
    phone = {"width": 390, "height": 800}
    with opened(browser, page_file, viewport=phone, has_touch=True) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        for control in first(page).locator("button:visible, select").all():
            box = control.bounding_box()
            assert min(box["width"], box["height"]) >= 40  # a finger's width


def test_without_scripts_there_is_a_still(browser, page_file):
    window = browser.new_context(java_script_enabled=False)
    page = window.new_page()
    page.goto(page_file.as_uri())
    assert page.locator("figure img").first.is_visible()
    window.close()


def test_without_webgl_it_says_so_and_shows_the_still(browser, page_file):
    window = browser.new_context()
    window.add_init_script(
        "for (const { prototype } of [HTMLCanvasElement, OffscreenCanvas]) {"
        "  const get = prototype.getContext;"
        "  prototype.getContext = function (kind, ...rest) {"
        "    return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest) } }"
    )
    visit = check_book.Visit(window, page_file.as_uri())
    visit.page.wait_for_selector("figure img")
    assert "WebGL" in first(visit.page).locator(".ml-note").inner_text()
    assert visit.troubles == []
    window.close()
