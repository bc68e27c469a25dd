"""How soon the front page of the built book can be used, opened from disk in Chromium.

    python benchmarks/bench_opening.py [--book book/_build/html] [--rounds 7] [--save]

By the page's own clock, from the moment it is asked for, each time in a new window: until the first figure
moves, and until the network is loaded and a key turns whom it makes. Against two seconds on two free cores.
Pictures are drawn by the processor.
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from pathlib import Path

import tyro
from bench_memory import FLAGS, FRONT, HERE, place_of_chromium
from interleaved import save, table, verdict

LIMIT = 2.0  # seconds
# The page tells when: looked at before each picture.
WATCH = """globalThis.when = {};
const watch = () => {
  const steer = document.querySelector("figure.motionlab-steer");
  const player = steer?.motionlab?.player;
  if (player?.frame > 0) when.moves ??= performance.now() / 1000;
  if (steer?.dataset.live !== undefined && !when.steered) {
    player.canvas.dispatchEvent(new KeyboardEvent("keydown", {code: "ArrowUp", key: "ArrowUp", bubbles: true}));
    if (steer.motionlab.commands.used) when.steered = performance.now() / 1000;
  }
  if (!when.steered || !when.moves) requestAnimationFrame(watch);
};
requestAnimationFrame(watch);"""


@dataclass
class Options:
    book: Path = HERE.parent / "book" / "_build" / "html"
    rounds: int = 7
    save: bool = False


def main(options: Options) -> None:
    from playwright.sync_api import sync_playwright

    times: dict[str, list[float]] = {"moves": [], "steered": []}
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=place_of_chromium(), args=FLAGS)
        for _ in range(options.rounds + 1):
            window = browser.new_context(offline=True, viewport={"width": 1280, "height": 900})
            window.add_init_script(WATCH)
            page = window.new_page()
            page.goto((options.book / FRONT).resolve().as_uri())
            page.wait_for_function(
                "globalThis.when.steered && globalThis.when.moves", timeout=120_000
            )
            for name, its in times.items():
                its.append(page.evaluate(f"globalThis.when.{name}"))
            window.close()
        browser.close()
    # the first one finds nothing in memory, and does not count
    numbers: dict[str, float] = {name: statistics.median(its[1:]) for name, its in times.items()}
    numbers |= {"longest": max(times["steered"][1:]), "limit": 1.0}
    numbers["ratio"] = numbers["steered"] / LIMIT
    table(
        "the front page, from disk",
        [
            ("a figure moves, s", f"{numbers['moves']:.2f}", ""),
            ("a key steers, s", f"{numbers['steered']:.2f}", verdict(numbers["ratio"], 1.0)),
        ],
    )
    if options.save:
        save("bench_opening", numbers)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
