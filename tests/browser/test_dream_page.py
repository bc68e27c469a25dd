"""The network that runs in a page: opened from disk, no kernel, no server, no network."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import torch
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

from motionlab.encodings import JointAngles, Normalizer, RootRelative
from motionlab.models import AcLstm, LstmGmm, Refiner
from motionlab.viewer.live.dream_page import page_figure
from motionlab.viewer.live.network_figure import NetworkFigure
from motionlab.viewer.live.network_weights import as_in_browser, weights_script
from motionlab.viewer.live.player import bundle_path

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAGE = """<!doctype html><html lang="en"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>dream</title>
<script src="player.js"></script><body style="margin: 8px">{}
<p style="height: 3000px">text</p><p id="end">end</p></body></html>"""


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5")


@pytest.fixture(scope="module")
def model(clips):
    return tiny_lstm(clips)


@pytest.fixture(scope="module")
def dancer(clips):
    return tiny_aclstm(clips)


@pytest.fixture(scope="module")
def folder(model, dancer, tmp_path_factory):
    """page.html with the network beside it, missing.html without, alone.html that needs nothing;
    exact.html, whose weights are not rounded; dancer.html, of another kind of network; both.html."""
    folder = tmp_path_factory.mktemp("dream")
    shutil.copy(bundle_path(), folder / "player.js")
    figure = page_figure(model, seconds=2, height=200, caption="A walker")
    figure.weights.write(folder / "_static")
    (folder / "page.html").write_text(PAGE.format(figure.html), encoding="utf-8")
    broken = figure.html.replace("_static/motionlab-weights", "_static/no-such")
    (folder / "missing.html").write_text(PAGE.format(broken), encoding="utf-8")
    figure.save(folder / "alone.html")
    exact = weights_script(model, "exact", rounded=False)
    live = figure.content["live"] | {"name": exact.name}
    NetworkFigure(figure.content | {"live": live}, exact, figure.still, None).save(
        folder / "exact.html"
    )
    other = page_figure(dancer, seconds=1, height=200)
    other.save(folder / "dancer.html")
    other.weights.write(folder / "_static")
    (folder / "both.html").write_text(PAGE.format(figure.html + other.html), encoding="utf-8")
    return folder


@pytest.fixture
def size():
    return {"width": 700, "height": 800}


def load(page):
    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=20_000)
    return page.locator("figure.motionlab-dream")


def value(figure, of: str):
    return figure.evaluate(f"figure => figure.motionlab.{of}")


def until(page, expression: str) -> None:
    page.wait_for_function(
        f"(() => {{ const figure = document.querySelector('figure').motionlab; return {expression} }})()"
    )


def test_clips_play_until_the_network_is_asked_for(visit):
    page = (opened := visit()).page
    figure = page.locator("figure.motionlab-dream")
    assert value(figure, "player.clock.frames") == 61
    page.get_by_label("Start").select_option("run_3.0")
    until(page, "figure.player.payload === figure.clips[1] && figure.player.frame > 3")
    assert not page.get_by_label("Temperature", exact=True).is_visible()
    names = lambda: {url.rsplit("/", 1)[1] for url in opened.loaded if "data:" not in url}
    assert names() == {"page.html", "player.js"}
    load(page)
    (script,) = names() - {"page.html", "player.js"}
    assert script.startswith("motionlab-weights-")
    assert value(figure, "dreamer.settings.start") == 1  # the start that was chosen
    until(page, "figure.dreamer.last > 70")  # longer than any clip
    assert page.get_by_label("Temperature", exact=True).is_visible()
    assert not page.get_by_role("button", name="Load the network").is_visible()
    assert "Runs here" in page.locator("p[role=status]").inner_text()


@pytest.mark.parametrize("name", ["page.html", "exact.html"])
def test_its_step_is_that_of_torch(visit, model, clips, name):
    """With float weights, and with weights of a byte each, which torch can have too."""
    rows = model.encoding.encode(clips[1])[20:40]
    figure = load(visit(name).page)
    said = figure.evaluate(
        """(figure, rows) => {
          const { dreamer, player } = figure.motionlab;
          player.pause();
          dreamer.restart();
          const [character] = dreamer.characters;
          return rows.map((row) => {
            character.input = dreamer.normalize(row);
            const [mixture] = dreamer.network.step([character]);
            return ["logWeights", "means", "stds"].map((part) => Array.from(mixture[part]));
          });
        }""",
        rows.tolist(),
    )
    network = model if name == "exact.html" else as_in_browser(model)
    state, worst = model.starts[:1], 0.0
    for row, parts in zip(rows, said, strict=True):
        mixture, state = network.step(row[None], state)
        for expected, part in zip(mixture, parts, strict=True):
            worst = max(worst, np.abs(expected.flatten().numpy() - part).max())
    assert worst < 1e-3


def end_after(frames: int) -> str:
    """Script: where each figure's characters are after so many frames, all figures by turns; or one by one."""
    return f"""byTurns => {{
      const dreamers = [...document.querySelectorAll("figure.motionlab-dream")].map((figure) => figure.motionlab.dreamer);
      for (const dreamer of dreamers) dreamer.restart();
      if (byTurns) for (let frame = 1; frame <= {frames}; frame++) dreamers.forEach((dreamer) => dreamer.reach(frame));
      else dreamers.forEach((dreamer) => dreamer.reach({frames}));
      return dreamers.map((dreamer) => Array.from(dreamer.tracks[0].room({frames})));
    }}"""


def load_all(page):
    while (button := page.get_by_role("button", name="Load the network")).count():
        loaded = page.locator("figure[data-live]").count()
        button.first.click()
        page.locator("figure[data-live]").nth(loaded).wait_for(timeout=20_000)
        page.get_by_role("button", name="Pause").last.click()


def test_two_networks_of_a_page_keep_their_own(visit):
    page = visit("both.html").page
    load_all(page)
    simd = "figure => !!figure.motionlab.dreamer.network.leave.layer.arrays"
    assert [figure.evaluate(simd) for figure in page.locator("figure.motionlab-dream").all()] == [
        True,
        True,
    ]
    by_turns, alone = (page.evaluate(end_after(30), turns) for turns in (True, False))
    assert by_turns == alone


def test_two_networks_that_play_share_the_time(visit):
    page = visit("both.html").page
    load_all(page)
    given = page.evaluate(
        """() => [...document.querySelectorAll("figure.motionlab-dream")].map(({ motionlab }) => motionlab).map((figure, _, all) => {
          for (const { player } of all) Object.assign(player.clock, { playing: true }), player.seen(true);
          let given;
          figure.dreamer.reach = (frame, milliseconds) => { given = milliseconds; };
          figure.player.clock.tick(0.1);
          return given;
        })"""
    )
    assert given == pytest.approx([25, 25])  # together half of it


def test_a_pace_is_judged_by_the_time_that_somebody_looked(visit):
    """A tab that was in the background made few frames, and its machine is not busy."""
    page = visit().page
    figure = load(page)
    until(page, "figure.dreamer.last > 5")
    said = """(figure, asked) => {
      const { motionlab: { dreamer, player, panel }, motionlab } = figure;
      player.clock.asked = asked;
      motionlab.told = dreamer.last - 3;
      motionlab.tellCost();
      return panel.status.textContent;
    }"""
    assert "busy" not in figure.evaluate(said, 3)
    assert "busy: 3 frames a second instead of 30" in figure.evaluate(said, 30)


@pytest.mark.parametrize("lacking", ["WebAssembly", "WebAssembly.validate", "WebAssembly.Memory"])
def test_a_browser_without_simd_goes_on(browser, folder, visit, lacking):
    """In plain JavaScript, and to the same place."""
    window = browser.new_context(offline=True)
    window.add_init_script(f"{lacking} = () => false")
    opened = check_book.Visit(window, (folder / "both.html").as_uri())
    other = visit("both.html")
    ends = []
    for page in (opened.page, other.page):
        load_all(page)
        ends.append(page.evaluate(end_after(30), True))
    assert opened.page.evaluate(
        "!document.querySelector('figure').motionlab.dreamer.network.leave.layer.arrays"
    )
    for plain, fast in zip(*ends, strict=True):
        assert 0 < np.abs(np.array(plain) - fast).max() < 1e-3  # metres
    assert opened.troubles == []
    window.close()


def test_a_dancer_goes_on_as_in_python(visit, dancer):
    page = visit("dancer.html").page
    figure = load(page)
    until(page, "figure.dreamer.last > 40")  # longer than the clips
    assert not page.get_by_label("Temperature", exact=True).count()
    assert "Gaussians" not in page.locator("dl").inner_text()
    page.get_by_role("button", name="Pause").click()
    points = figure.evaluate(
        """figure => {
          const { dreamer } = figure.motionlab;
          dreamer.restart();
          dreamer.reach(30);
          return Array.from(dreamer.tracks[0].room(30));
        }"""
    )
    features = as_in_browser(dancer).generate(30, dancer.starts[:1])
    expected = dancer.encoding.positions(torch.cat([dancer.starts.frame[:1, None], features], 1))
    assert np.abs(expected[0, 30].flatten().numpy() - points).max() < 1e-3


def test_characters_of_a_dancer_part_with_noise(visit):
    page = visit("dancer.html").page
    load(page)
    page.get_by_label("Characters").fill("2")
    status = page.locator("p[role=status]")
    status.filter(has_text="all do the same").wait_for()
    page.get_by_label("Input noise").fill("0.5")
    status.filter(has_not_text="all do the same").wait_for()
    until(page, "figure.player.casts.length === 2 && figure.dreamer.last > 20")


def test_a_refiner_comes_with_its_network(visit, model, folder):
    refiner = Refiner(model.encoding, model.normalizer, width=20, reach=0.05, slow=0.1)
    page_figure(model, seconds=0.1, height=200, refiner=refiner).save(folder / "refined.html")
    page = visit("refined.html").page
    figure = load(page)
    until(page, "figure.dreamer.last > 10")
    assert figure.evaluate("figure => !!figure.motionlab.dreamer.refiner.lstm.gates.layer.arrays")
    page.get_by_text("Where these weights come from").click()
    assert "Refined by" in page.locator("dl").inner_text()


def test_sliders_act_while_it_plays(visit):
    page = visit().page
    figure = load(page)
    until(page, "figure.dreamer.last > 5")
    page.get_by_label("Temperature", exact=True).fill("0.3")
    page.get_by_label("Input noise").fill("0.1")
    page.get_by_label("Memory of the noise").fill("0.9")
    settings = value(figure, "dreamer.settings")
    assert [settings[key] for key in ("temperature", "noise", "memory")] == [0.3, 0.1, 0.9]
    assert value(figure, "dreamer.last") > 5  # and it went on
    page.get_by_label("Characters").fill("3")
    until(page, "figure.player.casts.length === 3")
    assert value(figure, "dreamer.tracks[1].first") > 5  # newcomers join
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Seed").fill("5")
    assert value(figure, "dreamer.last") == 0
    page.get_by_label("Characters").fill("1")
    until(page, "figure.player.casts.length === 1")
    page.get_by_label("Seed").fill("")  # on the way to another number
    assert value(figure, "dreamer.settings.seed") == 5


def test_its_noise_has_the_memory_of_the_slider(visit):
    """Of the same chance, by the recursion: the state of a character carries the noise."""
    page = visit().page
    figure = load(page)
    page.get_by_role("button", name="Pause").click()

    def noise(memory: float) -> np.ndarray:
        page.get_by_label("Memory of the noise").fill(str(memory))
        said = figure.evaluate(
            """figure => {
              const { dreamer } = figure.motionlab;
              dreamer.restart();
              return [1, 2, 9].map((frame) => {
                dreamer.reach(frame);
                return Array.from(dreamer.characters[0].noise);
              });
            }"""
        )
        return np.array(said)

    white, slow = noise(0), noise(0.9)
    assert (slow[0] == white[0]).all()  # the first draw knows of no other
    np.testing.assert_allclose(slow[1], 0.9 * white[0] + 0.19**0.5 * white[1], atol=1e-12)
    apart, near = (np.abs(some[1] - some[0]).mean() for some in (white, slow))
    assert near < 0.5 * apart


def test_the_picture_moves_and_keys_work(visit):
    page = visit().page
    figure = load(page)
    canvas = figure.locator("canvas")
    until(page, "figure.player.frame > 5")
    before = canvas.screenshot()
    until(page, "figure.player.frame > 20")
    assert canvas.screenshot() != before
    canvas.focus()
    page.keyboard.press(" ")
    frame = value(figure, "player.frame")
    for key, change in {"ArrowRight": 1, "ArrowLeft": 0, "PageUp": -30, "End": 30}.items():
        page.keyboard.press(key)
        until(page, f"Math.abs(figure.player.frame - {max(frame + change, 0)}) <= 1")
    page.keyboard.press("r")
    assert value(figure, "player.frame") == 0 and value(figure, "dreamer.last") == 0


def test_it_rests_where_nobody_looks(visit):
    page = visit().page
    figure = load(page)
    until(page, "figure.dreamer.last > 5")
    page.locator("#end").scroll_into_view_if_needed()
    page.wait_for_timeout(400)
    last = value(figure, "dreamer.last")
    page.wait_for_timeout(600)
    assert value(figure, "dreamer.last") == last


def test_who_asks_for_calm_starts_it_himself(visit):
    page = visit(reduced_motion="reduce").page
    figure = load(page)
    page.wait_for_timeout(500)
    assert value(figure, "dreamer.last") == 0
    page.get_by_role("button", name="Play").click()
    until(page, "figure.dreamer.last > 5")


def test_without_its_weights_the_clips_go_on(browser, folder):
    window = browser.new_context(offline=True)
    page = window.new_page()
    page.goto((folder / "missing.html").as_uri())
    page.get_by_role("button", name="Load the network").click()
    status = page.locator("p[role=status]")
    status.filter(has_text="not beside this page").wait_for()
    assert page.get_by_role("button", name="Load the network").is_enabled()
    until(page, "figure.player.frame > 3")
    window.close()


def test_without_scripts_there_is_a_still(browser, folder):
    window = browser.new_context(java_script_enabled=False)
    page = window.new_page()
    page.goto((folder / "page.html").as_uri())
    assert page.get_by_alt_text("Still picture of a sampled motion").is_visible()
    window.close()


def test_a_saved_page_needs_nothing_else(visit):
    opened = visit("alone.html")
    figure = load(opened.page)
    until(opened.page, "figure.dreamer.last > 5")
    assert {url.rsplit("/", 1)[1] for url in opened.loaded if "data:" not in url} == {"alone.html"}
    assert figure.get_by_text("A walker").is_visible()


def test_a_phone_shows_all_of_it(visit):
    opened = visit(viewport={"width": 390, "height": 844})
    load(opened.page)
    opened.page.get_by_label("Characters").fill("6")
    opened.page.get_by_text("Where these weights come from").click()
    opened.check_width()


@pytest.mark.parametrize("kind", [LstmGmm, AcLstm])
def test_a_full_network_keeps_up(browser, clips, folder, kind):
    """512 wide, as shipped: at least 30 frames a second, of one character and of two."""
    skeleton = clips[0].skeleton
    encoding = RootRelative(skeleton) if kind is AcLstm else JointAngles(skeleton, contacts=True)
    model = kind(encoding, Normalizer(encoding.dim), width=512).requires_grad_(False)
    model.starts, model.start_names = model.zero_state(), ("nothing",)
    figure = page_figure(model, seconds=0.1, height=200)
    figure.save(folder / "full.html")
    window = browser.new_context(offline=True)
    page = window.new_page()
    page.goto((folder / "full.html").as_uri())
    loaded = load(page)
    page.get_by_role("button", name="Pause").click()
    for characters in (1, 2):
        page.get_by_label("Characters").fill(str(characters))
        assert loaded.evaluate(check_book.FASTEST_STEP) < check_book.STEP
    window.close()
