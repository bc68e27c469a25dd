"""Open every page of the built book as a reader does, with the network off, and look for trouble.

    python tests/browser/check_book.py [book/_build/html]

Each page is opened from disk, on a desktop and on a phone, and from a local server. It fails if a
page asks anything of another machine, logs an error, scrolls sideways at 390 px or weighs too much;
if a formula stays TeX; if a player stands still, does not follow its slider or saves nothing; if a
scene stays empty or does not follow its own; if a network does not load and move, or too slowly; if a
path that is drawn is not walked, or who is steered does not turn; if axe-core finds a grave fault for
those who hear a page or use keys alone (these four from disk, on a desktop). From a server the first
player and the first scene of a page are enough. It waits as long as a busy machine needs. Exit status
1, and one line for each trouble. Needs Chromium on the PATH (or its path in CHROMIUM).
"""

import functools
import io
import re
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from check_access import check_access
from check_steered import EARLY, check_steered
from local_server import local_server
from PIL import Image
from playwright.sync_api import BrowserContext, Page, TimeoutError, sync_playwright

from motionlab.commands.doctor import find_chromium

PAGE_BYTES = 2.5e6  # a page's own weight: its HTML and what only it loads
PATIENCE = 20_000  # milliseconds for a formula, a player or a search to appear
DESKTOP, PHONE = (1280, 900), (390, 844)
FLAGS = [  # WebGL in software: the machine that checks may have no graphics card
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
PLAYER, SCENE, DREAM = ".motionlab-player", ".motionlab-scene iframe", ".motionlab-dream"
PATH = ".motionlab-path"
STROKE = ((0.25, 0.75), (0.35, 0.3), (0.6, 0.6), (0.75, 0.25))  # shares of a board
WEIGHTS_BYTES = 8e6  # of a network that a page loads on a click
STEP = 1000 / 30  # milliseconds that a network may take for a frame
LISTINGS = 10  # of source code, all alike: the longest of them, in the narrow window
EACH = 1000  # figure of a page; more than any has
SENDS_ON = re.compile(r'<meta http-equiv="Refresh" content="0; url=([^"]+)"')
CONTRAST = 40  # of 255 levels of grey: less between the darkest and the lightest is nothing drawn


FASTEST_STEP = """figure => {
  const times = Array.from({ length: 20 }, () => {
    const began = performance.now();
    figure.motionlab.dreamer.advance();
    return performance.now() - began;
  });
  return Math.min(...times);
}"""


class Visit:
    """One page in a browser window, and what went wrong there."""

    def __init__(self, window: BrowserContext, url: str):
        self.troubles: list[str] = []
        self.loaded: set[str] = set()
        self.page: Page = window.new_page()
        self.page.route("**/*", self._pass_own_files)
        self.page.on("console", lambda m: m.type == "error" and self.trouble(f"console: {m.text}"))
        self.page.on("pageerror", lambda error: self.trouble(f"script: {error}"))
        self.page.on("requestfailed", lambda r: self.trouble(f"failed to load {r.url}"))
        self.page.on("response", lambda r: r.status >= 400 and self.trouble(f"{r.status} {r.url}"))
        self.page.goto(url, wait_until="load")
        self.page.wait_for_timeout(300)

    def _pass_own_files(self, route):
        url = route.request.url
        if url.startswith(("file:", "http://127.0.0.1:", "data:", "blob:")):
            self.loaded.add(url.split("?")[0].split("#")[0])
            route.continue_()
        else:
            self.trouble(f"asks for {url}")
            route.abort()

    def trouble(self, text: str) -> None:
        if text not in self.troubles:
            self.troubles.append(text)

    def check_width(self) -> None:
        content, window = self.page.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
        )
        if content > window:
            self.trouble(f"scrolls sideways: {content} px wide in a window of {window}")

    def check_math(self) -> None:
        formulas = self.page.locator(".math:not(mjx-container)").count()
        if formulas:
            try:
                self.page.wait_for_selector("mjx-container svg", state="attached", timeout=PATIENCE)
            except TimeoutError:
                self.trouble(f"{formulas} formulas and none drawn")
        if self.page.locator("mjx-merror, [data-mjx-error]").count():
            self.trouble("a formula that MathJax does not understand")

    def open_dropdowns(self) -> None:
        """Show hidden solutions, as a reader does: a player in one starts when it comes into view."""
        self.page.evaluate(
            "document.querySelectorAll('.toggle-hidden .toggle-button').forEach(b => b.click())"
        )

    def check_players(self, most: int = EACH) -> None:
        self.open_dropdowns()
        for number in range(min(most, self.page.locator(PLAYER).count())):
            self._check_player(number)

    def _check_player(self, number: int) -> None:
        player = self.page.locator(PLAYER).nth(number)
        name = f"player {number + 1}"
        player.scroll_into_view_if_needed()
        try:
            player.locator("canvas").wait_for(timeout=PATIENCE)
            slider = player.locator("input[type=range]").first
            slider.wait_for(timeout=PATIENCE)
        except TimeoutError:
            self.trouble(f"{name} did not start")
            return
        frame = functools.partial(slider.evaluate, "s => Number(s.value)")

        self._play(player, True)
        before, first = frame(), self._picture(player)
        if not self.until(lambda: frame() != before and self._picture(player) != first):
            self.trouble(f"{name} does not move")

        self._play(player, False)
        self._scrub(slider, 0.2, name)
        first = self._when_still(functools.partial(self._picture, player))
        self._scrub(slider, 0.7, name)
        if not self.until(lambda: self._picture(player) != first):
            self.trouble(f"{name} shows the same picture wherever its slider stands")
        if number == 0:  # one tells of all
            self._check_saving(player, name)

    def _check_saving(self, player, name: str) -> None:
        try:
            player.get_by_role("button", name="Save as a file").click(timeout=PATIENCE)
            with self.page.expect_download(timeout=PATIENCE) as waiting:
                player.get_by_role("button", name=".bvh").first.click(timeout=PATIENCE)
            text = Path(waiting.value.path()).read_text(encoding="utf-8")
        except TimeoutError:
            text = ""
        if not text.startswith("HIERARCHY"):
            self.trouble(f"{name} can't be saved")

    def _scrub(self, slider, share: float, name: str) -> None:
        """Take the slider to a share of its way; the player must leave it there."""
        target = round(share * slider.evaluate("s => Number(s.max)"))
        slider.fill(str(target))
        if not self.until(lambda: abs(slider.evaluate("s => Number(s.value)") - target) <= 1):
            self.trouble(f"{name}: the slider does not scrub (asked for {target})")

    def check_scenes(self, most: int = EACH) -> None:
        for number in range(min(most, self.page.locator(SCENE).count())):
            self._check_scene(number)

    def _check_scene(self, number: int) -> None:
        frame = self.page.locator(SCENE).nth(number)
        name = f"scene {number + 1}"
        frame.scroll_into_view_if_needed()  # it loads when it comes into view
        try:
            view = frame.content_frame.locator("#view:has(canvas)")
            view.wait_for(timeout=PATIENCE)
            slider = frame.content_frame.locator("#frame")
            slider.wait_for(timeout=PATIENCE)
        except TimeoutError:
            self.trouble(f"{name} did not start")
            return
        # Without the names of the axes: they are text, there before the scene is.
        picture = functools.partial(view.screenshot, style="#axes { visibility: hidden }")
        if not self.until(lambda: contrast(picture()) >= CONTRAST):
            self.trouble(f"{name} draws nothing")
            return
        last = slider.evaluate("s => Number(s.max)")
        slider.fill(str(round(0.2 * last)))
        first = self._when_still(picture)
        slider.fill(str(round(0.7 * last)))
        if not self.until(lambda: picture() != first):
            self.trouble(f"{name} shows the same picture wherever its slider stands")

    def check_dreams(self) -> None:
        if self.page.evaluate(EARLY):
            self.trouble("weights of a network came with the page; a click loads them")
        for number in range(self.page.locator(DREAM).count()):
            self._check_dream(number)

    def _check_dream(self, number: int) -> None:
        figure = self.page.locator(DREAM).nth(number)
        name = f"network {number + 1}"
        figure.scroll_into_view_if_needed()
        try:
            figure.locator("canvas").wait_for(timeout=PATIENCE)
            figure.get_by_role("button", name="Load the network").click(timeout=PATIENCE)
            figure.and_(self.page.locator("[data-live]")).wait_for(timeout=PATIENCE)
        except TimeoutError:
            said = figure.locator("p[role=status]").all_inner_texts()
            self.trouble(f"{name} did not load: {' '.join(said)}")
            return
        frame = functools.partial(figure.evaluate, "f => f.motionlab.player.frame")
        self._play(figure, True)
        if not self.until(lambda: frame() > 10):
            self.trouble(f"{name} does not move")
        best = figure.evaluate(FASTEST_STEP)
        if best > STEP:
            self.trouble(f"{name} takes {best:.0f} ms for a frame")
        size = figure.evaluate(
            "f => JSON.stringify(motionlabWeights[f.motionlab.live.name] ?? '').length"
        )
        if size > WEIGHTS_BYTES:
            self.trouble(f"{name} weighs {size / 1e6:.1f} MB")

    def check_paths(self) -> None:
        for number in range(self.page.locator(PATH).count()):
            self._check_path(number)

    def _check_path(self, number: int) -> None:
        """Draw a line with the mouse, let it be walked, and look for how far from it that was."""
        figure = self.page.locator(PATH).nth(number)
        name = f"path {number + 1}"
        figure.scroll_into_view_if_needed()
        try:
            board = figure.locator("svg[role=application]")
            board.scroll_into_view_if_needed(timeout=PATIENCE)
            box = board.bounding_box()
            for step, (x, y) in enumerate(STROKE):
                place = box["x"] + x * box["width"], box["y"] + y * box["height"]
                self.page.mouse.move(*place, steps=8)
                if step == 0:
                    self.page.mouse.down()
            self.page.mouse.up()
            figure.get_by_role("button", name="Walk").click(timeout=PATIENCE)
            figure.and_(self.page.locator("[data-walked]")).wait_for(timeout=3 * PATIENCE)
            frame = functools.partial(figure.evaluate, "f => f.motionlab.player.frame")
            before = frame()
            if not self.until(lambda: frame() != before):
                self.trouble(f"{name}: who walks does not move")
            if " cm from the line" not in (told := figure.inner_text()):
                self.trouble(f"{name} does not say how far from the line it went: {told}")
        except TimeoutError:
            said = figure.locator("[aria-live=polite]").all_inner_texts()
            self.trouble(f"{name} is not walked: {' '.join(said)}")

    def until(self, done: Callable[[], bool]) -> bool:
        """Whether it was done in time: drawing in software may take its while."""
        end = time.monotonic() + PATIENCE / 1000
        while not (was_done := done()) and time.monotonic() < end:
            self.page.wait_for_timeout(300)
        return was_done

    def _when_still(self, picture: Callable[[], bytes]) -> bytes:
        """The picture once it no longer changes."""
        seen = [picture()]

        def still() -> bool:
            self.page.wait_for_timeout(600)
            seen.append(picture())
            return seen[-1] == seen[-2]

        self.until(still)
        return seen[-1]

    def _play(self, player, on: bool) -> None:
        button = player.get_by_role("button", name="Play" if on else "Pause", exact=True)
        if button.count():
            button.first.click()

    def _picture(self, player) -> bytes:
        return player.locator("canvas").first.screenshot()


def contrast(png: bytes) -> int:
    """Levels of grey, of 255, between the darkest and the lightest spot."""
    darkest, lightest = Image.open(io.BytesIO(png)).convert("L").getextrema()
    return lightest - darkest


def chromium() -> str:
    found = find_chromium()
    if not found:
        sys.exit(
            "No Chromium found. Install it (Debian: apt-get install chromium) or set CHROMIUM."
        )
    return found


def check_search(window: BrowserContext, base: str) -> list[str]:
    """The search page finds a page of the book."""
    visit = Visit(window, f"{base}search.html?q=rotation")
    try:
        visit.page.wait_for_selector("#search-results li a", timeout=PATIENCE)
    except TimeoutError:
        visit.trouble("search finds nothing for 'rotation'")
    visit.page.wait_for_timeout(500)
    visit.page.close()
    return visit.troubles


def check_page(window: BrowserContext, base: str, path: Path, folder: Path) -> list[str]:
    visit = Visit(window, base + path.relative_to(folder).as_posix())
    visit.check_math()
    visit.check_width()
    if visit.page.viewport_size["width"] == DESKTOP[0]:
        from_disk = base.startswith("file:")  # scripts may do less there
        visit.check_players(EACH if from_disk else 1)  # from a server they are the same
        visit.check_scenes(EACH if from_disk else 1)
        if from_disk:
            check_access(visit)
            visit.check_dreams()
            visit.check_paths()
            check_steered(visit, PATIENCE)
    weight = own_weight(visit.loaded, base, folder)
    if weight > PAGE_BYTES:
        visit.trouble(f"weighs {weight / 1e6:.1f} MB, allowed {PAGE_BYTES / 1e6} MB")
    visit.page.close()
    return visit.troubles


def own_weight(loaded: set[str], base: str, folder: Path) -> int:
    """Bytes of the files that a page loads beyond the ones all pages share (_static)."""
    paths = {url.removeprefix(base) for url in loaded if url.startswith(base)}
    own = [folder / path for path in paths if not path.startswith(("_static/", "searchindex"))]
    return sum(path.stat().st_size for path in own if path.is_file())


def check(folder: Path, served: bool = True, at_once: int = 1) -> list[str]:
    """All troubles of the book in this folder, one line each; from disk alone, or from a server, too.

    at_once : browsers that share the pages.
    """
    pages = sorted(p for p in folder.rglob("*.html") if "_static" not in p.parts)
    troubles = [line for p in pages if (line := leads_nowhere(p, folder))]
    # Who visits a page that sends on would look at the next one before it is whole.
    pages = [p for p in pages if not SENDS_ON.search(p.read_text(encoding="utf-8"))]
    listings = {p for p in pages if "_modules" in p.parts}
    longest = sorted(listings, key=lambda p: p.stat().st_size)[-LISTINGS:]
    pages = [p for p in pages if p not in listings]
    with local_server(folder) as server:
        disk = folder.as_uri() + "/"
        tasks = []
        for base, size in ((disk, DESKTOP), (disk, PHONE), (server, DESKTOP))[: 2 + served]:
            opened = pages + longest * (size == PHONE)
            tasks += [(folder, base, size, opened[i::at_once], not i) for i in range(at_once)]
        if at_once == 1:
            return troubles + [trouble for task in tasks for trouble in check_pages(*task)]
        with ProcessPoolExecutor(at_once) as pool:
            waiting = [pool.submit(check_pages, *task) for task in tasks]
            return troubles + [trouble for task in waiting for trouble in task.result()]


def leads_nowhere(path: Path, folder: Path) -> str | None:
    """A line if this page only sends on, to a page that there is not."""
    found = SENDS_ON.search(path.read_text(encoding="utf-8"))
    lost = found and not (path.parent / found[1]).is_file()
    return (
        f"{path.relative_to(folder)}: sends on to {found[1]}, which there is not" if lost else None
    )


def check_pages(
    folder: Path, base: str, size: tuple[int, int], pages: list[Path], search: bool
) -> list[str]:
    """Troubles of some pages in a window of one size, and of the search."""
    width, height = size
    where, troubles = f"{base.split(':')[0]}, {width} px", []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
        window = browser.new_context(viewport={"width": width, "height": height})
        if search:
            troubles += [f"{where}: search: {t}" for t in check_search(window, base)]
        for path in pages:
            found = check_page(window, base, path, folder)
            troubles += [f"{where}: {path.relative_to(folder)}: {t}" for t in found]
        browser.close()
    print(f"{where}: {len(pages)} pages opened", flush=True)
    return troubles


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "book/_build/html").resolve()
    if not (folder / "index.html").exists():
        sys.exit(f"{folder} holds no built book; run `make book` first.")
    troubles = check(folder, at_once=2)
    for trouble in troubles:
        print("TROUBLE", trouble)
    print(f"{len(troubles)} troubles")
    sys.exit(1 if troubles else 0)


if __name__ == "__main__":
    main()
