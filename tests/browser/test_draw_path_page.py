"""Drawing a path in a page opened from disk, and watching it walked; no kernel, no server, no network."""

from __future__ import annotations

import math
import shutil

import numpy as np
import pytest
from tiny_lstm import tiny_clips, tiny_lstm
from widget_pages import open_widget

from motionlab import read_bvh
from motionlab.metrics import root_path_error
from motionlab.paths import Path
from motionlab.viewer.live.draw_path_kernel import widget
from motionlab.viewer.live.draw_path_page import page_figure
from motionlab.viewer.live.player import bundle_path

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAGE = """<!doctype html><html lang="en"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>path</title>
<script src="player.js"></script><body style="margin: 8px">{}</body></html>"""
CORNERS = [[0, 0], [0, 3], [2, 3]]


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5")


@pytest.fixture(scope="module")
def model(clips):
    model = tiny_lstm(clips)
    model.sampling = {"temperature": 0.1}
    return model


@pytest.fixture(scope="module")
def folder(model, clips, tmp_path_factory):
    """solved.html with paths that were solved beforehand, page.html without; missing.html without the
    network beside it."""
    folder = tmp_path_factory.mktemp("path")
    shutil.copy(bundle_path(), folder / "player.js")
    plain = page_figure(model, height=200, caption="Draw")
    plain.weights.write(folder / "_static")
    (folder / "page.html").write_text(PAGE.format(plain.html), encoding="utf-8")
    broken = plain.html.replace("_static/motionlab-weights", "_static/no-such")
    (folder / "missing.html").write_text(PAGE.format(broken), encoding="utf-8")
    record = {"timing": {"asked (m/s)": 0.8}, "start": model.start_names[2]}
    solved = [
        ("straight", [[0, 0], [0, 5]], clips[0][:60]),
        ("corners", CORNERS, clips[1][:60], record),
    ]
    figure = page_figure(model, solved, height=200)
    (folder / "solved.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    return folder


def value(page, of: str):
    return page.evaluate(f"document.querySelector('figure').motionlab.{of}")


def draw(page, places) -> None:
    """With the mouse; places are shares of the board's width and height."""
    box = page.locator(".ml-board").bounding_box()
    at = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in places]
    page.mouse.move(*at[0])
    page.mouse.down()
    for place in at[1:]:
        page.mouse.move(*place, steps=4)
    page.mouse.up()


def walk(page) -> list[str]:
    page.get_by_role("button", name="Walk").click()
    page.wait_for_selector("figure[data-walked]", timeout=20_000)
    return page.locator(".ml-results .ml-name").all_inner_texts()


def test_a_line_drawn_with_the_mouse_is_walked_and_its_error_told(visit):
    opened = visit()
    page = opened.page
    draw(page, [(0.2 + 0.6 * t, 0.5 - 0.2 * math.sin(6 * t)) for t in np.linspace(0, 1, 30)])
    drawn = np.array(value(page, "board.points"))
    assert len(drawn) > 20
    # what is right in the picture is right of one who looks along z, where x falls
    assert drawn[-1, 0] < drawn[0, 0] - 4 and drawn[8, 1] > drawn[0, 1]
    names = lambda: {url.rsplit("/", 1)[1] for url in opened.loaded if "data:" not in url}
    assert names() == {"page.html", "player.js"}  # no network yet
    (told,) = walk(page)
    assert any(name.startswith("motionlab-weights-") for name in names())
    said = float(told.split(": ")[1].split(" cm")[0])
    assert "guided, in this page" in told
    assert page.get_by_text("Root mean square distance of the hips").is_visible()
    root = np.array(value(page, "walked.track.ground()"))
    path = Path.through(drawn)
    three = np.stack([root[:, 0], np.zeros(len(root)), root[:, 1]], 1)[30:, None]
    assert said == pytest.approx(float(root_path_error(three, path.places).rms), abs=0.6)
    assert np.linalg.norm(root[0] - drawn[0]) < 1e-3
    assert np.linalg.norm(root[-1] - drawn[-1]) < 1
    assert value(page, "player.clock.frames") == len(root)
    first = value(page, "player.frame")
    page.wait_for_function(f"document.querySelector('figure').motionlab.player.frame != {first}")


def test_the_same_seed_walks_the_same_way(visit):
    page = visit().page
    way = lambda: (walk(page), value(page, "walked.track.ground()"))
    first = way()
    assert way() == first
    page.get_by_label("Seed").fill("7")
    assert way() != first
    page.get_by_label("Start").select_option("run_3.0")
    page.get_by_label("Speed (m/s)").fill("2.5")
    frames = len(first[1])
    assert len(way()[1]) < 0.8 * frames


def test_what_walked_can_be_saved_and_stands_where_the_line_is(visit, tmp_path):
    page = visit().page
    page.get_by_role("button", name="Square").click()
    walk(page)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Save as a file").click()
    for kind in ("bvh", "glb"):
        with page.expect_download() as waiting:
            page.get_by_role("button", name=f".{kind}").click()
        waiting.value.save_as(tmp_path / f"walk.{kind}")
    motion = read_bvh(tmp_path / "walk.bvh")
    root = np.array(value(page, "walked.track.ground()"))
    saved = motion.positions()[:, 0, [0, 2]].numpy()
    np.testing.assert_allclose(saved, root, atol=1e-3)
    assert (tmp_path / "walk.glb").read_bytes()[:4] == b"glTF"


def test_fingers_draw_and_do_not_scroll(visit):
    page = visit(viewport={"width": 390, "height": 500}, has_touch=True).page
    page.get_by_role("button", name="Clear").click()
    board = page.locator(".ml-board")
    board.scroll_into_view_if_needed()
    before = page.evaluate("scrollY")
    box = board.bounding_box()
    finger = page.context.new_cdp_session(page)
    at = lambda t: [{"x": box["x"] + 150, "y": box["y"] + 200 - 150 * t}]
    finger.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": at(0)})
    for t in np.linspace(0, 1, 12):
        finger.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at(float(t))})
    finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    points = np.array(value(page, "board.points"))
    assert points[-1, 1] - points[0, 1] > 2 and page.evaluate("scrollY") == before


def test_keys_and_taps_set_corners(visit):
    page = visit().page
    page.get_by_role("button", name="Clear").click()
    board = page.locator(".ml-board")
    board.focus()
    for key in (
        "Enter",
        "Shift+ArrowUp",
        "Shift+ArrowUp",
        "Enter",
        "Shift+ArrowLeft",
        "ArrowLeft",
        "Enter",
    ):
        page.keyboard.press(key)
    points = value(page, "board.points")
    corners = np.diff(np.array(points), axis=0)
    np.testing.assert_allclose(corners, [[0, 2], [1.25, 0]], atol=1e-9)
    assert "corners rounded" in page.locator(".ml-status").first.inner_text()
    page.keyboard.press("Backspace")
    assert value(page, "board.points") == points[:2]
    page.get_by_role("button", name="Undo").click()
    assert "One point" in page.locator(".ml-status").first.inner_text()
    assert page.get_by_role("button", name="Walk").is_disabled()
    board.click(position={"x": 40, "y": 40})
    assert len(value(page, "board.points")) == 2
    assert page.get_by_role("button", name="Walk").is_enabled()
    page.keyboard.press("Escape")
    assert value(page, "board.points") == []


def test_a_stroke_from_the_end_goes_on_and_another_begins_anew(visit):
    page = visit().page
    draw(page, [(0.2, 0.8), (0.2, 0.5)])
    first = value(page, "board.points")
    draw(page, [(0.2, 0.5), (0.6, 0.5)])
    both = value(page, "board.points")
    assert both[: len(first) - 1] == first[:-1] and len(both) > 1.5 * len(first)
    draw(page, [(0.8, 0.8), (0.8, 0.3)])
    assert len(value(page, "board.points")) < len(both)
    draw(page, [(0.5, 0.5), (0.5, 0.505), (0.5, 0.51)])  # a tap that trembles
    assert len(value(page, "board.points")) > 1


def test_what_is_wrong_with_a_line_is_said(visit):
    page = visit().page
    said = page.locator(".ml-status").first
    judge = lambda points: page.evaluate(
        f"document.querySelector('figure').motionlab.board.take({points})"
    )
    judge([[0, 0], [0, 0.05]])
    assert "10 cm" in said.inner_text()
    judge([[0, 0], [0, 500]])
    assert "200 m" in said.inner_text()
    judge([[0, 0], [0, 3], [2, 1], [-2, 1.5]])
    assert "crosses itself once" in said.inner_text()
    assert page.get_by_role("button", name="Walk").is_enabled()


def test_every_shape_is_a_path(visit):
    page = visit().page
    for name in ("Circle", "Sine", "Figure eight", "Square", "Spiral"):
        page.get_by_role("button", name=name, exact=True).click()
        assert 5 < value(page, "path.length") < 25, name
        assert value(page, "path.crossings") == 0 or name == "Figure eight"


def test_a_path_that_was_solved_is_seen_beside_the_page_s_own(visit):
    page = visit("solved.html").page
    told = page.locator(".ml-results .ml-name")
    assert told.count() == 1 and "solved beforehand" in told.inner_text()
    page.get_by_label("Solved beforehand", exact=True).select_option("corners")
    assert value(page, "board.points") == CORNERS
    assert page.get_by_label("Speed (m/s)").input_value() == "0.8"
    assert value(page, "values.start") == 2
    solved, own = walk(page)
    assert "solved beforehand" in solved and "guided" in own
    assert value(page, "player.tracks.length") == 2
    draw(page, [(0.3, 0.8), (0.3, 0.2)])  # another line: what was solved is not its
    assert value(page, "solved") is None and told.count() == 0
    assert page.get_by_label("Solved beforehand", exact=True).input_value() == "-1"
    assert value(page, "values.start") == -1  # its start was lent


def test_another_line_ends_a_walk(visit):
    page = visit().page
    page.get_by_role("button", name="Walk").click()
    page.get_by_role("button", name="Square").click()
    page.wait_for_function("!document.querySelector('figure').motionlab.walking")
    assert value(page, "walked") is None
    assert len(walk(page)) == 1


def test_without_its_weights_it_says_so(browser, folder):
    window = browser.new_context(offline=True)
    page = window.new_page()
    page.goto((folder / "missing.html").as_uri())
    page.get_by_role("button", name="Walk").click()
    page.get_by_text("not beside this page").wait_for()
    assert page.get_by_role("button", name="Walk").is_enabled()
    window.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_all_of_it(visit, scheme):
    opened = visit("solved.html", viewport={"width": 390, "height": 844}, color_scheme=scheme)
    walk(opened.page)
    opened.check_width()
    assert opened.page.locator("figure").get_attribute("data-ml-theme") == scheme


# -- in a kernel ------------------------------------------------------------------------------------


@pytest.fixture
def kernel_page(visit, folder, model, clips):
    """The widget's page, and what a kernel would answer: {frames, whole} of a clip."""
    made = widget(model, lambda: None, (), 1.2, "RNN", "Draw", 200)
    opened = open_widget(visit, folder, made)
    answers = [made._shown(clips[0][k : k + 17]) for k in (0, 17)], made._shown(clips[1][:40])
    return opened.page, *answers


def test_a_kernel_s_windows_are_seen_as_they_come(kernel_page):
    page, windows, whole = kernel_page
    draw(page, [(0.3, 0.8), (0.3, 0.2)])
    page.get_by_role("button", name="Walk").click()
    (sent,) = page.evaluate("sent.filter((message) => message.do === 'walk')")
    assert sent["speed"] == 1.2 and sent["start"] == -1 and len(sent["points"]) > 10
    tell = lambda **said: page.evaluate("message => tell(message)", {"id": sent["id"], **said})
    tell(id="another", failed="not mine")
    for number, frames in enumerate(windows):
        tell(frames=frames, share=0.5 + 0.25 * number)
        assert page.evaluate("figure.player.clock.frames") == 17 * (number + 1)
    assert "70 %" in page.locator(".ml-status").all_inner_texts()[1]
    page.get_by_role("button", name="Stop").click()
    assert page.evaluate("sent.at(-1).do") == "stop"
    tell(whole=whole, error={"curve": 0.71, "drawn": 3.2}, notes=["it was cold"], finished=False)
    assert page.evaluate("figure.player.clock.frames") == 40
    (told,) = page.locator(".ml-results .ml-name").all_inner_texts()
    assert (
        "solved by the kernel: 0.7 cm from the line, as far as it went" in told and "3.2 cm" in told
    )
    assert "it was cold" in page.locator(".ml-status").all_inner_texts()[1]
    assert page.get_by_role("button", name="Walk").is_enabled()


def test_a_kernel_s_errors_are_said(kernel_page):
    page, _, _ = kernel_page
    page.get_by_role("button", name="Walk").click()
    page.evaluate("tell({ id: sent.at(-1).id, failed: 'Nobody is as fast as that.' })")
    page.get_by_text("Nobody is as fast as that.").wait_for()
    assert page.get_by_role("button", name="Walk").is_enabled()
