"""Hands that steer, in a page opened from disk: keys, a stick, a gamepad; no kernel, no server."""

from __future__ import annotations

import math
from itertools import groupby

import pytest
from steered_pages import PATIENCE, SECOND, frames_pass, load, settled, until, value, write_pages

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steer")
    write_pages(folder)
    return folder


def test_keys_turn_him_about(visit):
    """By 180° within four seconds of his time, with the network that ships and its refiner."""
    page = visit("shipped.html").page
    load(page)  # and the picture has the focus
    assert value(page, "commands.asked(0).speed") == 0
    page.keyboard.down("ArrowUp")
    frames_pass(page, 2 * SECOND)
    assert abs(value(page, "steered.characters[0].aim.direction")) < 1e-6
    page.keyboard.up("ArrowUp")
    page.keyboard.down("KeyS")
    took = settled(page, 180, 20, 8 * SECOND)
    assert took <= 4 * SECOND, took
    frames_pass(page, 2 * SECOND)
    z = "player.tracks[0].at(1e9).place.z"
    before = value(page, z)
    frames_pass(page, SECOND)
    assert value(page, z) < before - 0.5  # a second's walk back to where one looks from
    page.keyboard.up("KeyS")
    until(page, "figure.steered.characters[0].before.going.pace < 0.15")  # he stands


def test_until_a_hand_steers_it_is_told_how(visit):
    page = visit().page
    load(page)
    said = page.locator("p[role=status]")
    said.filter(has_text="Hold an arrow key").wait_for(timeout=PATIENCE)
    page.keyboard.down("ArrowUp")
    said.filter(has_text="Runs here").wait_for(timeout=PATIENCE)
    page.keyboard.up("ArrowUp")
    assert value(page, "commands.used") is True


def test_one_that_loads_by_itself_leaves_the_keys_to_the_page(visit):
    """In sight it is loaded; arrow keys scroll until the picture is clicked, then they steer."""
    page = visit("at_once.html").page
    page.wait_for_selector("figure[data-live]", timeout=PATIENCE)
    page.locator("p[role=status]").filter(has_text="Click the picture, then").wait_for(timeout=PATIENCE)  # fmt: skip
    assert page.evaluate("document.activeElement === document.body")
    page.keyboard.press("ArrowUp")
    frames_pass(page, 2)
    assert value(page, "commands.used") is False
    assert value(page, "commands.asked(0).speed") > 1  # he walks by himself
    page.locator("figure canvas").click(position={"x": 60, "y": 60})
    page.keyboard.down("ArrowUp")
    until(page, "figure.commands.used")
    page.keyboard.up("ArrowUp")


def test_who_wants_little_motion_is_asked_first(visit):
    page = visit("at_once.html", reduced_motion="reduce").page
    button = page.get_by_role("button", name="Load the network")
    button.wait_for(timeout=PATIENCE)
    page.wait_for_timeout(500)  # in which it would have been disabled
    assert button.is_enabled() and page.locator("figure[data-live]").count() == 0


def test_pictures_that_come_late_are_told(visit):
    page = visit().page
    load(page)
    page.get_by_role("button", name="Pause").click()
    told = page.evaluate(
        """() => {
          const figure = document.querySelector("figure").motionlab;
          const pace = figure.player.passes;
          figure.commands.used = true;
          figure.steered.cost = 1; // making them is fast
          return [0.125, 0.25, 1].map((share) => {
            pace.take();
            pace.rest();
            for (let i = 0; i <= 10; i++) pace.picture(500 * i, 0.5 * share);
            pace.picture(60_000, 0.25); // back after a minute elsewhere
            pace.rest();
            pace.picture(90_000, 0); // and after a pause
            figure.tellCost();
            return figure.status.textContent;
          });
        }"""
    )
    assert "time passes at 0.1 of its pace" in told[0]
    assert "time passes at 0.3 of its pace" in told[1]
    assert "late" not in told[2]


def test_a_delay_lets_him_hear_late(visit):
    """What is asked is heard so many frames later, what was asked meanwhile in its order."""
    page = visit().page
    canvas = load(page)
    page.get_by_label("Delay (s)").first.fill("0.5")
    canvas.focus()
    page.evaluate(
        """() => {
          const { steered, player, commands } = document.querySelector("figure").motionlab;
          const [asked, steer] = [commands.asked.bind(commands), steered.steer.bind(steered)];
          const note = (list, wish) => {
            const way = wish.speed ? Math.round(wish.direction * 180 / Math.PI) : "stand";
            list.push([player.clock.time, way]);
            return wish;
          };
          Object.assign(window, { said: [], heard: [] });
          commands.asked = (view) => note(said, asked(view)); // once a picture
          steered.steer = (wish) => steer(note(heard, wish));
        }"""
    )
    frames_pass(page, SECOND)
    page.keyboard.down("ArrowUp")
    frames_pass(page, 8)
    page.keyboard.down("ArrowLeft")
    frames_pass(page, 8)
    page.keyboard.up("ArrowUp")
    page.keyboard.up("ArrowLeft")
    frames_pass(page, SECOND)
    said, heard = page.evaluate("[said, heard]")
    ways = [way for way, _ in groupby(way for _, way in said)]
    assert ways[:3] == ["stand", 0, 45] and ways[-1] == "stand"
    # However few pictures a busy machine draws: at each, what was said half a second or more before.
    late = {now: [way for at, way in said if at <= now - 15] for now, _ in said}
    expected = [[now, ways[-1]] for now, ways in late.items() if ways]
    assert [found for found in heard if found[0] >= said[0][0] + 15] == expected
    assert {way for _, way in expected} >= {"stand", 0, 45} and expected[-1][1] == "stand"
    page.locator("p[role=status]").filter(has_text="seen after 0.").wait_for(timeout=PATIENCE)
    least = page.locator("p[role=status]").inner_text().split("after ")[1].split(" ")[0]
    assert float(least) == pytest.approx(0.5 + value(page, "steered.latency[0]"), abs=0.01)


def test_shift_runs(visit):
    page = visit("shipped.html").page
    load(page)
    for key in ("Shift", "w"):
        page.keyboard.down(key)
    until(page, "figure.steered.characters[0].before.going.pace > 2.2")
    page.keyboard.up("Shift")
    until(page, "figure.steered.characters[0].before.going.pace < 1.6")


def test_the_stick_steers_by_mouse_and_finger(visit):
    page = visit(has_touch=True).page
    load(page)
    stick = page.locator(".ml-stick").bounding_box()
    x, y = stick["x"] + stick["width"] / 2, stick["y"] + stick["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 60, y)
    assert value(page, "commands.hand") == [1, 0]  # left, and not beyond
    until(page, "Math.abs(figure.steered.characters[0].aim.direction - Math.PI / 2) < 0.01")
    page.mouse.move(x, y - 17)
    until(page, "Math.abs(figure.steered.characters[0].aim.speed - 0.6) < 0.01")  # half the way
    page.mouse.up()
    assert value(page, "commands.hand") == [0, 0]
    finger = page.context.new_cdp_session(page)
    touch = lambda kind, *at: finger.send(
        "Input.dispatchTouchEvent",
        {"type": kind, "touchPoints": [{"x": a, "y": b} for a, b in at]},
    )
    scrolled = page.evaluate("scrollY")
    touch("touchStart", (x, y))
    touch("touchMove", (x + 20, y + 60))
    touch("touchMove", (x, y + 60))
    until(page, "Math.abs(Math.abs(figure.steered.characters[0].aim.direction) - Math.PI) < 0.01")
    touch("touchEnd")
    assert value(page, "commands.hand") == [0, 0] and page.evaluate("scrollY") == scrolled


def test_a_gamepad_steers(visit):
    page = visit().page
    load(page)
    page.evaluate(
        """() => { navigator.getGamepads = () => [null, { connected: true, axes: [-1, 0],
        buttons: Array.from({ length: 8 }, (_, i) => ({ pressed: i === 7 })) }]; }"""
    )
    until(page, "Math.abs(figure.steered.characters[0].aim.direction - Math.PI / 2) < 0.01")
    assert value(page, "commands.asked(0).speed") == 2.6
    page.evaluate("navigator.getGamepads = () => []")
    until(page, "figure.steered.characters[0].aim.speed === 0")


def test_keys_act_while_the_picture_has_the_focus_and_only_then(visit):
    page = visit().page
    canvas = load(page)
    outline = lambda: canvas.evaluate("canvas => getComputedStyle(canvas).outlineStyle")
    page.keyboard.press("Tab")
    page.keyboard.press("Shift+Tab")  # back to it, by keyboard
    assert outline() == "solid"
    page.keyboard.down("ArrowDown")
    assert value(page, "commands.hand") == [0, -1] and page.evaluate("scrollY") == 0
    page.get_by_label("Seed").focus()  # a key that is held while the focus goes is let go
    assert value(page, "commands.hand") == [0, 0]
    page.keyboard.up("ArrowDown")
    page.evaluate(
        """() => {
          document.activeElement.blur();
          addEventListener("keydown", ({ defaultPrevented }) => { globalThis.taken = defaultPrevented; });
        }"""
    )
    page.keyboard.down("ArrowDown")
    assert page.evaluate("taken") is False  # the page scrolls as ever
    assert value(page, "commands.hand") == [0, 0]


def test_keys_steer_again_after_a_click_on_anything_below_the_picture(visit):
    page = visit().page
    load(page)

    def steers(*keys: str) -> list[bool]:
        found = []
        for key in keys:
            page.keyboard.down(key)
            found.append(value(page, "commands.hand") != [0, 0])
            page.keyboard.up(key)
            assert value(page, "commands.hand") == [0, 0]
        return found

    for control in ("Help", "Keep going"):
        page.get_by_label(control, exact=True).click()
        assert steers("ArrowUp", "KeyA") == [True, True], control
    page.get_by_text("Lock the feet").click()
    page.get_by_role("button", name="Save the last").click()
    assert steers("ArrowLeft") == [True]
    page.get_by_label("Speed (m/s)").click(position={"x": 40, "y": 18})  # by mouse
    assert steers("ArrowRight") == [True]
    page.get_by_text("Draw a line, and he goes along it").click()
    assert steers("ArrowDown") == [True]
    page.locator(".ml-told").click()
    assert steers("ArrowUp") == [True]
    page.get_by_label("Start", exact=True).select_option("walk_1.2")
    assert value(page, "settings.start") == 0


def test_who_comes_to_a_slider_by_tab_moves_it_by_arrows_and_steers_by_letters(visit):
    page = visit().page
    load(page)
    slider = page.get_by_label("Speed (m/s)")
    page.keyboard.press("Tab")
    while not slider.evaluate("slider => slider === document.activeElement"):
        page.keyboard.press("Tab")
    speed = value(page, "settings.speed")
    page.keyboard.press("ArrowRight")
    assert value(page, "settings.speed") > speed and value(page, "commands.hand") == [0, 0]
    page.keyboard.down("KeyW")
    assert value(page, "commands.hand") == [0, 1]
    page.keyboard.up("KeyW")
    page.keyboard.press("Tab")
    page.get_by_label("Help", exact=True).focus()
    page.keyboard.press("Space")  # by keyboard: he stays, and arrows steer all the same
    assert page.get_by_label("Help", exact=True).evaluate("tick => tick === document.activeElement")
    page.keyboard.down("ArrowUp")
    assert value(page, "commands.hand") == [0, 1]
    page.get_by_label("Seed").focus()
    assert value(page, "commands.hand") == [0, 0]  # a field has a use for it
    page.keyboard.up("ArrowUp")
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.tagName") == "CANVAS"


@pytest.mark.parametrize("leave", ["blur", "visibilitychange"])
def test_keys_are_let_go_when_window_or_tab_goes(visit, leave):
    page = visit().page
    load(page)
    page.keyboard.down("KeyA")
    assert value(page, "commands.hand") == [1, 0]
    page.evaluate(
        """leave => {
          if (leave === "blur") return dispatchEvent(new Event("blur"));
          Object.defineProperty(document, "hidden", { value: true });
          document.dispatchEvent(new Event("visibilitychange"));
        }""",
        leave,
    )
    assert value(page, "commands.hand") == [0, 0]


def test_it_rests_where_nobody_looks(visit):
    page = visit().page
    load(page)
    frames_pass(page, 5)
    page.locator("#end").scroll_into_view_if_needed()
    until(page, "!figure.player.visible")
    last = value(page, "steered.last")
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert value(page, "steered.last") == last


def test_he_goes_along_a_line_that_is_drawn_until_a_hand_steers(visit):
    page = visit("shipped.html").page
    load(page)
    page.get_by_text("Draw a line, and he goes along it").click()
    page.evaluate(
        "document.querySelector('figure').motionlab.course.board.take([[0, 0.5], [0, 2], [1, 2.5]])"
    )
    assert "A line of 2." in page.locator(".ml-course .ml-status").inner_text()
    until(page, "figure.steered.characters[0].aim.arc > figure.commands.path.length - 0.5")
    x, z = page.evaluate("document.querySelector('figure').motionlab.course.place")
    assert math.hypot(x - 1, z - 2.5) < 1.2
    page.locator("figure canvas").focus()
    page.keyboard.down("ArrowUp")
    until(page, "figure.commands.path === null && figure.steered.characters[0].aim.path === null")


def test_who_asks_for_calm_starts_it_by_a_key(visit):
    page = visit(reduced_motion="reduce").page
    load(page)
    assert not value(page, "player.playing")
    page.keyboard.down("ArrowUp")
    until(page, "figure.player.playing && figure.player.frame > 5")
