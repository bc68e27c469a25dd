"""A character who is steered in a page: what a frame takes, opened from disk in Chromium.

    python benchmarks/bench_steering.py [--rounds 25] [--save]

A frame is all of it but the picture: K samples of the network, pushed to a way that changes each second,
judged by their feet and poses, the best refined, its feet locked, and the points of its body. By the clock.

Then somebody steers for a minute with a key held, another one each two seconds: how long it takes from the
click that loads the network until he has gone a decimetre, and how long one waits for each picture. Chromium
draws without a GPU here, so that is the machine's time more than the page's; what its networks take is told, too.
"""

from __future__ import annotations

import os
import shutil
import statistics
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import mean

import tyro
from interleaved import save, table

import motionlab
from motionlab.viewer.live.steer_page import page_figure
from motionlab.viewer.live.steer_settings import Look

LIMIT, LIMITED = 12, 8  # milliseconds a frame may take, with so many futures
FIRST, LONGEST = (
    2.0,
    50,
)  # seconds from the click to the first decimetre; milliseconds from picture to picture
FUTURES = 1, 8, 16
KEYS = "ArrowUp", "ArrowLeft", "KeyS", "KeyD"
EACH = 2.0  # seconds that a key is held

WALK = """([futures, round, lock]) => {
  const { steered } = document.querySelector("figure.motionlab-steer").motionlab;
  Object.assign(steered.settings, { futures, lock });
  steered.steer({ speed: 1.2, direction: 2.4 * round });
  const [before, began] = [steered.last, performance.now()];
  steered.reach(before + 30);
  return (performance.now() - began) / (steered.last - before);
}"""


# When pictures come and what the page did for each; when he has gone a decimetre after the click.
WATCH = """() => {
  const figure = document.querySelector("figure.motionlab-steer").motionlab;
  Object.assign(globalThis, { pictures: [], work: [], networks: [] });
  figure.go.addEventListener("click", () => { globalThis.clicked = performance.now(); }, true);
  const time = (owner, name, found) => {
    const act = owner[name].bind(owner);
    owner[name] = (...given) => {
      const began = performance.now();
      act(...given);
      found.push(performance.now() - began);
    };
  };
  const look = (now) => {
    const { player, steered } = figure;
    if (steered && !globalThis.first) {
      const { place: { x, z } } = steered.tracks[0].at(player.frame);
      if (Math.hypot(x, z) > 0.1) globalThis.first = performance.now() - clicked;
    }
    if (steered && !player.timed) {
      time(player, "tick", work);
      time(steered, "reach", networks);
      player.timed = true;
    }
    if (globalThis.first) pictures.push(now);
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""


@dataclass
class Options:
    rounds: int = 25
    seconds: float = 60.0
    save: bool = False


def main(options: Options) -> None:
    path = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if not path:
        raise SystemExit("No Chromium on the PATH, and none named by CHROMIUM.")
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        page_figure([(model, refiner)], (), Look(1.2, LIMITED, 200, "#dc740a")).save(page)
        found = in_chromium(page, options.rounds, path)
        hand = by_hand(page, options.seconds, path)
    rows = []
    for name, times in found.items():
        took = found[name] = statistics.median(times)
        limited = name == f"K = {LIMITED}"
        said = (
            f"at most {LIMIT} ms: {'holds' if took <= LIMIT else 'MISSED'}" if limited else "told"
        )
        rows.append((name, f"{took:.2f} ms", said))
    first, worst = hand["first decimetre (s)"], hand["picture, longest (ms)"]
    held = lambda holds: "holds" if holds else "MISSED"
    rows += [
        ("from the click to a decimetre", f"{first:.2f} s", f"at most {FIRST:g} s: {held(first <= FIRST)}"),
        ("the longest wait for a picture", f"{worst:.0f} ms", f"at most {LONGEST} ms: {held(worst <= LONGEST)}"),
        *((name, f"{value:.3g}", "told") for name, value in hand.items()),
    ]  # fmt: skip
    table("a frame of who is steered: Chromium, from disk", rows)
    if options.save:
        limits = {f"K = {LIMITED}, ms": LIMIT, "first, s": FIRST, "picture, ms": LONGEST}
        save("bench_steering", {"limits": limits, "ms a frame": found, "by hand": hand})


def in_chromium(page_file: Path, rounds: int, path: str) -> dict[str, list[float]]:
    """Milliseconds of a frame in every round, by turns; a window without WebAssembly as well."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        pages = {"": loaded(browser, page_file)}
        pages[", plain JavaScript"] = loaded(browser, page_file, "delete globalThis.WebAssembly")
        found: dict[str, list[float]] = {}
        for number in range(rounds + 1):
            for (name, page), count in [(p, k) for p in pages.items() for k in FUTURES]:
                page.bring_to_front()
                took = page.evaluate(WALK, [count, number, 1])
                found.setdefault(f"K = {count}{name}", []).append(took)
            loose = pages[""].evaluate(WALK, [LIMITED, number, 0])
            found.setdefault(f"K = {LIMITED}, feet not locked", []).append(loose)
        browser.close()
    return {name: times[1:] for name, times in found.items()}


def by_hand(page_file: Path, seconds: float, path: str) -> dict[str, float]:
    """What somebody waits for who loads the network and steers with keys."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 900, "height": 700})
        page.goto(page_file.as_uri())
        page.evaluate(WATCH)
        page.get_by_role("button", name="Load the network").click()
        page.wait_for_selector("figure[data-live]", timeout=60_000)
        for number in range(max(1, round(seconds / EACH))):
            key = KEYS[number % len(KEYS)]
            page.keyboard.down(key)
            page.wait_for_timeout(1000 * EACH)
            page.keyboard.up(key)
        first, pictures, work, networks = page.evaluate("[first, pictures, work, networks]")
        browser.close()
    waits = sorted(later - earlier for earlier, later in pairwise(pictures))
    work, networks = sorted(work[-len(waits) :]), sorted(networks[-len(waits) :])
    return {
        "first decimetre (s)": first / 1000,
        "pictures a second": 1000 * len(waits) / sum(waits),
        "picture, median (ms)": statistics.median(waits),
        "picture, longest (ms)": waits[-1],
        f"pictures that took over {LONGEST} ms (%)": 100 * mean(each > LONGEST for each in waits),
        "page's work for one, drawn, median (ms)": statistics.median(work),
        "page's work for one, drawn, longest (ms)": work[-1],
        "networks' part of it, median (ms)": statistics.median(networks),
        "networks' part of it, longest (ms)": networks[-1],
    }


def loaded(browser, page_file: Path, script: str = ""):
    window = browser.new_context(
        offline=True, reduced_motion="reduce"
    )  # it does not play by itself
    window.add_init_script(script)
    page = window.new_page()
    page.goto(page_file.as_uri())
    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=60_000)
    return page


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
