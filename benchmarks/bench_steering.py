"""A character who is steered in a page: what a frame takes, opened from disk in Chromium.

    python benchmarks/bench_steering.py [--rounds 25] [--save]

A frame is all of it but the picture: K samples of the network, pushed to a way that changes each second,
judged by their feet and poses, the best refined, and the points of its body. By the clock.
"""

from __future__ import annotations

import os
import shutil
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import tyro
from interleaved import save, table

import motionlab
from motionlab.viewer.live.steer_page import page_figure
from motionlab.viewer.live.steer_settings import Look

LIMIT, LIMITED = 12, 8  # milliseconds a frame may take, with so many futures
FUTURES = 1, 8, 16


WALK = """([futures, round]) => {
  const { steered } = document.querySelector("figure.motionlab-steer").motionlab;
  steered.settings.futures = futures;
  steered.steer({ speed: 1.2, direction: 2.4 * round });
  const [before, began] = [steered.last, performance.now()];
  steered.reach(before + 30);
  return (performance.now() - began) / (steered.last - before);
}"""


@dataclass
class Options:
    rounds: int = 25
    save: bool = False


def main(options: Options) -> None:
    path = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if not path:
        raise SystemExit("No Chromium on the PATH, and none named by CHROMIUM.")
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        page_figure([(model, refiner)], (), Look(1.2, LIMITED, 200, "#d98324")).save(page)
        found = in_chromium(page, options.rounds, path)
    rows = []
    for name, times in found.items():
        took = found[name] = statistics.median(times)
        limited = name == f"K = {LIMITED}"
        said = (
            f"at most {LIMIT} ms: {'holds' if took <= LIMIT else 'MISSED'}" if limited else "told"
        )
        rows.append((name, f"{took:.2f} ms", said))
    table("a frame of who is steered: Chromium, from disk", rows)
    if options.save:
        save("bench_steering", {"limits": {f"K = {LIMITED}, ms": LIMIT}, "ms a frame": found})


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
                took = page.evaluate(WALK, [count, number])
                found.setdefault(f"K = {count}{name}", []).append(took)
        browser.close()
    return {name: times[1:] for name, times in found.items()}


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
