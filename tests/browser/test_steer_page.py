"""Steering in a page opened from disk; no kernel, no server, no network.

A loaded machine makes few frames a second. So nothing here waits for a clock: it waits for frames, and
counts them.
"""

from __future__ import annotations

import math
import shutil

import numpy as np
import pytest
from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab import read_bvh
from motionlab.viewer.live.player import bundle_path
from motionlab.viewer.live.steer_page import page_figure
from motionlab.viewer.live.steer_settings import Look

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>steer</title>
<script src="player.js"></script><body style="margin: 8px">{}<p style="height: 2000px">.</p>
<p id="end">end</p></body></html>"""
LOOK = Look(1.2, 4, 240, "#d98324")
PATIENCE = 60_000  # milliseconds
SECOND = 30  # frames


@pytest.fixture(scope="module")
def tiny():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "stand"))
    model.sampling = {"temperature": 0.3}
    return model


@pytest.fixture(scope="module")
def folder(tiny, tmp_path_factory):
    """page.html with a network that is quickly loaded and walks somehow; shipped.html with one that
    walks; beside.html, two under the same keys; missing.html without its weights."""
    folder = tmp_path_factory.mktemp("steer")
    shutil.copy(bundle_path(), folder / "player.js")
    shipped = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    pages = {
        "page": page_figure([(tiny, None), shipped], (), LOOK, "Steered"),
        "shipped": page_figure([shipped], (), LOOK),
        "beside": page_figure([(tiny, None)], (1, 3), LOOK),
    }
    for name, figure in pages.items():
        for script in (figure.weights, *figure.others):
            script.write(folder / "_static")
        (folder / f"{name}.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    broken = pages["page"].html.replace("_static/motionlab-weights", "_static/no-such")
    (folder / "missing.html").write_text(PAGE.format(broken), encoding="utf-8")
    return folder


def value(page, of: str):
    return page.evaluate(f"document.querySelector('figure').motionlab.{of}")


def until(page, expression: str) -> None:
    page.wait_for_function(
        f"(() => {{ const figure = document.querySelector('figure').motionlab; return {expression} }})()",
        timeout=PATIENCE,
    )


def load(page):
    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=PATIENCE)
    return page.locator("figure canvas")


def frames_pass(page, count: int) -> None:
    """So many frames more are seen."""
    until(page, f"figure.player.frame >= {value(page, 'player.frame') + count}")


def settled(page, way: float, within: float, frames: int) -> int:
    """Frames until he goes some way (degrees), judged frame by frame from the newest on."""
    first = value(page, "steered.last")
    off = f"Math.abs(Math.atan2(Math.sin(going.bearing - {math.radians(way)}), Math.cos(going.bearing - {math.radians(way)})))"
    until(
        page,
        f"figure.steered.last > {first + frames} || figure.steered.characters.every(({{ before: {{ going }} }}) => {off} < {math.radians(within)})",
    )
    return value(page, "steered.last") - first


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


def test_commands_that_change_every_frame_are_heard(visit):
    page = visit().page
    load(page)
    page.get_by_role("button", name="Pause").click()
    page.evaluate(
        """() => {
          const { steered } = document.querySelector("figure").motionlab;
          for (let frame = 0; frame < 60; frame++) {
            steered.steer({ speed: 3 * (frame % 2), direction: 2 * frame });
            steered.reach(steered.last + 1);
          }
        }"""
    )
    rows = value(page, "steered.tracks[0].at(1e9).row")
    assert all(math.isfinite(number) for number in rows)
    for wrong, said in (
        ("speed: NaN", "NaN"),
        ("direction: Infinity", "Infinity"),
        ("speed: -1", "0 or more"),
    ):
        told = page.evaluate(
            f"""() => {{
              const {{ steered }} = document.querySelector("figure").motionlab;
              const before = JSON.stringify(steered.characters[0].aim);
              try {{ steered.steer({{ {wrong} }}); return ""; }} catch (error) {{
                return before === JSON.stringify(steered.characters[0].aim) ? error.message : "";
              }}
            }}"""
        )
        assert said in told, wrong


def test_who_comes_apart_begins_again(visit):
    page = visit().page
    load(page)
    until(page, "figure.steered.last > 10")
    page.evaluate(
        "document.querySelector('figure').motionlab.steered.characters[0].before.hidden[0].fill(NaN)"
    )
    until(page, "figure.steered.characters[0].lost === 1 && figure.steered.last > 40")
    page.locator("p[role=status]").filter(has_text="began again").wait_for(timeout=PATIENCE)


def test_without_help_nothing_is_asked(visit):
    page = visit().page
    load(page)
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Help", exact=True).uncheck()
    run = """way => {
      const { steered, player } = document.querySelector("figure").motionlab;
      player.reset();
      steered.steer({ speed: 1.2, direction: way });
      steered.reach(60);
      return Object.values(steered.tracks[0].at(60).place);
    }"""
    free = page.evaluate(run, 0)
    assert page.evaluate(run, 1.5) == free
    page.get_by_label("Help", exact=True).check()
    assert page.evaluate(run, 1.5) != page.evaluate(run, 0)


def test_sliders_act_and_the_direction_is_held_without_keys(visit):
    page = visit().page
    load(page)
    page.get_by_label("Direction (°)").fill("-90")
    page.get_by_label("Speed (m/s)").fill("2")
    page.get_by_label("Keep going").check()
    until(page, "figure.steered.characters[0].aim.speed === 2")
    assert value(page, "steered.characters[0].aim.direction") == pytest.approx(-math.pi / 2)
    for name, label, number in (
        ("futures", "Futures (K)", 2),
        ("push", "Push", 0.5),
        ("memory", "Memory of the noise", 0.9),
    ):
        page.get_by_label(label).fill(str(number))
        assert value(page, f"steered.settings.{name}") == number
    page.locator("figure canvas").focus()
    page.keyboard.down("ArrowUp")
    until(page, "figure.settings.direction === 0")  # the slider follows the hand
    assert page.get_by_label("Direction (°)").input_value() == "0"


def test_the_network_can_be_looked_into(visit):
    page = visit("shipped.html").page
    load(page)
    page.keyboard.down("ArrowUp")
    frames_pass(page, 10)
    page.get_by_role("button", name="Pause").click()
    weights, spread = page.locator(".ml-bars").all()
    said = [float(text) for text in weights.locator(".ml-value").all_inner_texts()]
    assert len(said) == 5 and sum(said) == pytest.approx(1, abs=0.03)
    assert "m/s" in spread.inner_text() and "4 futures" in page.locator(".ml-inside").inner_text()
    told = page.locator(".ml-told").inner_text()
    assert "asked: 1.2 m/s, 0°" in told and "does:" in told


def test_two_are_steered_by_the_same_keys(visit):
    page = visit("beside.html").page
    load(page)
    page.keyboard.down("ArrowLeft")
    until(
        page,
        "figure.steered.characters.every(({ aim }) => Math.abs(aim.direction - Math.PI / 2) < 0.01)",
    )
    frames_pass(page, 5)
    seen = "figure.steered.tracks.map((track) => track.at(1e9).energies.length).join()"
    until(page, f"{seen} === '1,3'")
    assert page.get_by_text("K = 1", exact=True).count() == 2  # a chip, and a line
    assert not page.get_by_label("Futures (K)").count()


def test_another_network_can_be_taken(visit):
    page = visit().page
    load(page)
    page.get_by_label("Network", exact=True).select_option("lstm-gmm-contacts")
    assert value(page, "steered") is None
    load(page)
    frames_pass(page, 5)
    assert value(page, "steered.parts.refiner.lstm.width") > 0


def test_what_was_done_can_be_saved(visit, tmp_path):
    page = visit().page
    load(page)
    page.keyboard.down("ArrowUp")
    frames_pass(page, 20)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Save the last 120 seconds as a file").click()
    for kind in ("bvh", "glb"):
        with page.expect_download() as waiting:
            page.get_by_role("button", name=f".{kind}").click()
        waiting.value.save_as(tmp_path / f"steered.{kind}")
    motion = read_bvh(tmp_path / "steered.bvh")
    root = np.array(value(page, "steered.tracks[0].ground()"))
    assert len(root) == value(page, "steered.last") + 1
    saved = motion.positions()[:, 0, [0, 2]].numpy()
    np.testing.assert_allclose(saved, root, atol=1e-3)
    assert (tmp_path / "steered.glb").read_bytes()[:4] == b"glTF"


@pytest.mark.parametrize("lacking", ["WebAssembly", "WebAssembly.validate"])
def test_a_browser_without_simd_goes_on(browser, folder, lacking):
    window = browser.new_context(offline=True)
    window.add_init_script(f"{lacking} = () => false")
    opened = check_book.Visit(window, (folder / "page.html").as_uri())
    load(opened.page)
    opened.page.keyboard.down("ArrowUp")
    frames_pass(opened.page, 20)
    assert (
        not value(opened.page, "steered.parts.network.leave.layer.arrays") and opened.troubles == []
    )
    window.close()


def test_without_its_weights_it_says_so(browser, folder):
    window = browser.new_context(offline=True)
    page = window.new_page()
    page.goto((folder / "missing.html").as_uri())
    page.get_by_role("button", name="Load the network").click()
    page.get_by_text("not beside this page").wait_for(timeout=PATIENCE)
    assert page.get_by_role("button", name="Load the network").is_enabled()
    window.close()


def test_who_asks_for_calm_starts_it_by_a_key(visit):
    page = visit(reduced_motion="reduce").page
    load(page)
    assert not value(page, "player.playing")
    page.keyboard.down("ArrowUp")
    until(page, "figure.player.playing && figure.player.frame > 5")


@pytest.mark.parametrize("name", ["page.html", "beside.html"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_all_of_it(visit, name, scheme):
    opened = visit(name, viewport={"width": 390, "height": 844}, color_scheme=scheme)
    load(opened.page)
    opened.page.get_by_text("Where these weights come from").click()
    opened.check_width()
    assert opened.page.locator("figure").get_attribute("data-ml-theme") == scheme
