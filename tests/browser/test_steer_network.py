"""What is steered in a page opened from disk: the network, its settings, a look inside, files."""

from __future__ import annotations

import math

import numpy as np
import pytest
from steered_pages import PATIENCE, SECOND, frames_pass, load, until, value, write_pages

from motionlab import read_bvh

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steer")
    write_pages(folder)
    return folder


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


def test_who_is_asked_for_what_nobody_can_do_does_what_he_can_and_says_so(visit):
    page = visit().page
    load(page)
    page.get_by_role("button", name="Pause").click()
    aim, notes, rows = page.evaluate(
        """() => {
          const { steered } = document.querySelector("figure").motionlab;
          steered.steer({ speed: 100, direction: 1e9 });
          steered.reach(steered.last + 60);
          const { aim: { speed, direction } } = steered.characters[0];
          return [[speed, direction, steered.fastest], steered.records[0].notes, [...steered.tracks[0].at(1e9).row]];
        }"""
    )
    assert aim[0] == aim[2] < 10 and abs(aim[1]) <= math.pi
    assert "100.0 m/s is faster than anybody" in notes[0]
    assert all(math.isfinite(number) for number in rows)


def test_who_is_asked_nothing_for_longer_than_is_kept_takes_no_more_room(visit):
    page = visit().page
    load(page)
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Futures (K)").fill("1")
    for _ in range(9):
        page.evaluate(
            """() => {
              const { steered } = document.querySelector("figure").motionlab;
              steered.steer({ speed: 0, direction: 0 });
              steered.reach(steered.last + 500);
            }"""
        )
    assert value(page, "steered.last") > 120 * SECOND
    assert value(page, "steered.tracks[0].frames.length") == 120 * SECOND
    assert value(page, "steered.characters[0].lost") == 0
    assert value(page, "steered.tracks[0].oldest") > 0  # the beginning is gone


def test_two_figures_of_a_page_are_steered_one_at_a_time(visit, folder):
    one = (folder / "page.html").read_text(encoding="utf-8")
    figure = one[one.index("<figure") : one.index("</figure>") + len("</figure>")]
    (folder / "two.html").write_text(one.replace(figure, figure + figure), encoding="utf-8")
    page = visit("two.html").page
    for number in (0, 1):
        page.locator("figure").nth(number).get_by_role("button", name="Load the network").click()
        page.wait_for_function(
            f"document.querySelectorAll('figure[data-live]').length === {number + 1}",
            timeout=PATIENCE,
        )
    hands = (
        "[...document.querySelectorAll('figure')].map((one) => one.motionlab.commands.hand.join())"
    )
    page.keyboard.down("KeyW")  # the newest has the focus
    assert page.evaluate(hands) == ["0,0", "0,1"]
    page.locator("figure").nth(0).get_by_label("Help", exact=True).click()
    assert page.evaluate(hands) == ["0,0", "0,0"]  # let go with the focus
    page.keyboard.down("KeyA")
    assert page.evaluate(hands) == ["1,0", "0,0"]


def test_who_comes_apart_begins_again(visit):
    page = visit().page
    load(page)
    until(page, "figure.steered.last > 10")
    page.evaluate(
        "document.querySelector('figure').motionlab.steered.characters[0].before.hidden[0].fill(NaN)"
    )
    until(page, "figure.steered.characters[0].lost === 1 && figure.steered.last > 40")
    page.locator("p[role=status]").filter(has_text="began again").wait_for(timeout=PATIENCE)


AFTER_A_WISH = """(frames => {
  const { steered } = document.querySelector("figure").motionlab;
  steered.steer({ speed: 3, direction: 3 });
  steered.reach(steered.last + frames);
  return steered.records[0].notes;
})"""


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
    told = """() => {
      const figure = document.querySelector("figure").motionlab;
      figure.player.clock.seek(60);
      figure.tell();
      return figure.lines[0].asked.textContent;
    }"""
    assert page.evaluate(told) == "asked: nothing"
    assert page.evaluate(f"{AFTER_A_WISH}(90)") == []  # what is not asked can't be missed
    page.get_by_label("Help", exact=True).check()
    assert page.evaluate(run, 1.5) != page.evaluate(run, 0)
    assert page.evaluate(told) == "asked: 1.2 m/s, 0°"


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


def test_shaders_of_the_clip_serve_who_is_steered(visit):
    """To make them anew takes a second of the two until the first step, where no graphics card is."""
    page = visit().page
    until(page, "figure.player.frame > 2")
    programs = "__motionlab_stage_2.renderer.info.programs.map(({ id }) => id)"
    before = page.evaluate(programs)
    load(page)
    frames_pass(page, 3)
    assert before and set(before) <= set(page.evaluate(programs))


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


def test_one_that_loads_by_itself_shows_its_clip_where_it_can_not(browser, folder):
    window = browser.new_context(offline=True)
    page = window.new_page()
    page.goto((folder / "missing_at_once.html").as_uri())
    page.get_by_text("not beside this page").wait_for(timeout=PATIENCE)
    page.wait_for_selector("figure canvas", timeout=PATIENCE)
    assert page.locator(".ml-waits").count() == 0
    assert page.get_by_role("button", name="Load the network").is_enabled()
    window.close()


def test_on_a_phone_stick_and_main_settings_are_in_reach_of_who_sees_him(visit):
    page = visit(viewport={"width": 390, "height": 844}, has_touch=True).page
    load(page)
    boxes = [
        page.get_by_label(name, exact=True).bounding_box()
        for name in ("Speed (m/s)", "Direction (°)", "Keep going", "Help", "Lock the feet")
    ]
    view = page.locator(".ml-view").bounding_box()
    assert view["y"] >= 0 and max(box["y"] + box["height"] for box in boxes) < 844
    assert not page.get_by_label("Seed").is_visible()
    page.get_by_text("More settings").click()
    page.get_by_label("Seed").evaluate("field => field.scrollIntoView({ block: 'end' })")
    assert page.evaluate("scrollY") > 0
    seen = page.locator(".ml-view"), page.locator(".ml-stick"), page.get_by_label("Seed")
    for part in seen:  # he stays in sight, and nothing hides what is set
        box = part.bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] < 845
    view = seen[0].bounding_box()
    assert seen[2].bounding_box()["y"] > view["y"] + view["height"]


@pytest.mark.parametrize("name", ["page.html", "beside.html"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_all_of_it(visit, name, scheme):
    opened = visit(name, viewport={"width": 390, "height": 844}, color_scheme=scheme)
    load(opened.page)
    opened.page.get_by_text("Where these weights come from").click()
    opened.check_width()
    assert opened.page.locator("figure").get_attribute("data-ml-theme") == scheme
