"""A steered character in a notebook: the widget's page, and a kernel that answers it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tiny_lstm import tiny_clips, tiny_lstm
from widget_pages import open_widget

from motionlab.solvers.live_control import LiveControl
from motionlab.viewer.live.steer_kernel import widget
from motionlab.viewer.live.steer_settings import Look

pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PATIENCE = 60_000  # milliseconds


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("widget")


@pytest.fixture
def kernel_page(visit, folder):
    """The widget's page; what a kernel would answer comes from the widget itself."""
    tiny = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "stand"))
    tiny.sampling = {"temperature": 0.3}
    made = widget(tiny, LiveControl, None, (), Look(1.2, 4, 240, "#dc740a"), "Steered")
    opened = open_widget(visit, folder, made)
    told: list[dict] = []
    made.send = told.append

    def answer() -> dict:
        """Answer the oldest question."""
        opened.page.wait_for_function("sent.length > 0", timeout=PATIENCE)
        message = opened.page.evaluate("sent.shift()")
        made._asked(message)
        opened.page.evaluate("message => tell(message)", told[-1])
        return message

    return opened.page, answer, made


def test_a_kernel_is_asked_window_by_window(kernel_page):
    page, answer, made = kernel_page
    assert answer()["do"] == "begin"
    page.wait_for_function("figure.steered?.last === 4", timeout=PATIENCE)
    page.locator("canvas").focus()
    page.keyboard.down("ArrowLeft")
    for _ in range(12):
        message = answer()
        assert message["do"] == "go" and message["settings"]["futures"] == 4
    assert message["wish"]["direction"] == pytest.approx(math.pi / 2, abs=1e-6)
    assert page.evaluate("figure.steered.last") == 64
    assert float(made.live[0].aim.direction[0]) == pytest.approx(math.pi / 2, abs=1e-6)
    places = np.array(page.evaluate("figure.steered.tracks[0].ground()"))
    np.testing.assert_allclose(places, made.motion().root_positions[:, [0, 2]], atol=1e-3)
    page.get_by_text("frames a second; 30 are needed").wait_for(timeout=PATIENCE)
    page.get_by_label("Term: slow feet rest").uncheck()
    page.get_by_label("A gradient, too").check()
    answer()  # on its way before
    assert answer()["settings"]["term resting"] == 0
    assert made.live[0].how.weights == {"resting": 0.0}


def test_a_kernel_hears_late_by_the_delay(kernel_page):
    page, answer, _made = kernel_page
    assert answer()["do"] == "begin"
    page.get_by_label("Delay (s)").first.fill("1")
    page.locator("canvas").focus()
    page.keyboard.down("ArrowLeft")
    begun = page.evaluate("figure.player.clock.time")
    heard = [(answer()["wish"].get("speed", 0), page.evaluate("figure.player.clock.time"))]
    while not heard[-1][0] and heard[-1][1] < begun + 90:
        heard.append((answer()["wish"].get("speed", 0), page.evaluate("figure.player.clock.time")))
    assert heard[-1][0] == 1.2 and heard[-1][1] >= begun + 30
    assert len(heard) > 4


def test_a_kernel_begins_again_and_says_what_went_wrong(kernel_page):
    page, answer, made = kernel_page
    answer()
    page.wait_for_function("figure.steered?.last === 4", timeout=PATIENCE)
    answer()
    page.get_by_label("Seed").fill("5")
    while answer()["do"] != "begin":
        pass
    page.wait_for_function("figure.steered.last === 4", timeout=PATIENCE)
    assert made.motion().frames == 5
    run = page.evaluate("figure.steered.run")
    page.evaluate("message => tell(message)", {"run": run, "failed": "It was too cold."})
    page.get_by_text("It was too cold.").wait_for(timeout=PATIENCE)


def test_he_goes_along_a_line_that_is_drawn_with_the_mouse(kernel_page):
    """To its beginning first, then along it; a key takes him off it."""
    page, answer, made = kernel_page
    answer()
    page.wait_for_function("figure.steered?.last === 4", timeout=PATIENCE)
    page.get_by_text("Draw a line, and he goes along it").click()
    board = page.locator(".ml-board")
    board.scroll_into_view_if_needed()
    box = board.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(x + 8 * step, y - 4 * step)
    page.mouse.up()
    page.get_by_text("he goes to where it begins").wait_for(timeout=PATIENCE)
    drawn = page.evaluate("figure.commands.path.drawn")
    for _ in range(30):
        message = answer()
        if made._lines == [drawn]:
            break
    assert message["wish"] == {"speed": 1.2, "line": drawn}
    arcs = []
    for _ in range(6):
        answer()
        arcs.append(float(made.live[0].aim.arcs[0]))
    assert arcs == sorted(arcs) and arcs[-1] > arcs[0]  # he goes on, and does not begin again
    page.keyboard.down("ArrowUp")
    answer()  # on its way before
    answer()
    assert made._lines == [None] and int(made.live[0].aim.which[0]) == -1


def test_after_a_refusal_the_kernel_is_asked_again(kernel_page):
    page, answer, _ = kernel_page
    answer()
    page.wait_for_function("figure.steered?.last === 4 && sent.length === 1", timeout=PATIENCE)
    run = page.evaluate("sent.shift().run")
    page.evaluate("message => tell(message)", {"run": run, "failed": "It leads nowhere."})
    page.get_by_text("It leads nowhere.").wait_for(timeout=PATIENCE)
    answer()
    page.wait_for_function("figure.steered.last === 9", timeout=PATIENCE)
