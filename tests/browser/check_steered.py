"""The part of check_book.py that steers: load the network, hold a key, and look which way he goes."""

from playwright.sync_api import TimeoutError

STEERED = ".motionlab-steer"
ROUNDS = 3  # of patience: two networks and their pictures are a lot for a busy machine
WITHIN = 0.6  # radians off the way that is asked, by which he obeys

OFF = """f => Math.max(...f.motionlab.steered.characters.map(({ before: { going } }) =>
  Math.abs(Math.atan2(Math.sin(going.bearing - Math.PI / 2), Math.cos(going.bearing - Math.PI / 2)))))"""

EARLY = """'motionlabWeights' in globalThis &&
  ![...document.querySelectorAll('.motionlab-steer')].some(f => f.motionlab?.content.at_once)"""
ASK = "all => all.filter(button => !button.disabled && !button.hidden).forEach(button => button.click())"


def check_steered(visit, patience: float) -> None:
    """Every character of a page turns to the left when he is asked to; `visit` is check_book's."""
    for number in range(visit.page.locator(STEERED).count()):
        figure, name = visit.page.locator(STEERED).nth(number), f"steered {number + 1}"
        figure.scroll_into_view_if_needed()
        try:
            button = figure.get_by_role("button", name="Load the network", include_hidden=True)
            button.first.wait_for(state="attached", timeout=patience)
            button.evaluate_all(ASK)  # some figures load theirs by themselves
            figure.and_(visit.page.locator("[data-live]")).wait_for(timeout=patience)
        except TimeoutError:
            said = figure.locator("p[role=status]").all_inner_texts()
            visit.trouble(f"{name} did not load: {' '.join(said)}")
            continue
        figure.locator("canvas").focus()
        visit.page.keyboard.down("ArrowLeft")
        turned = lambda figure=figure: figure.evaluate(OFF) < WITHIN
        if not any(visit.until(turned) for _ in range(ROUNDS)):
            visit.trouble(f"{name} does not turn to where he is asked to go")
        visit.page.keyboard.up("ArrowLeft")
