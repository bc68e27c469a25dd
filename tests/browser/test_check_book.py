"""The browser check must find what it is there to find: each fault is planted in a tiny book."""

import pytest

check_book = pytest.importorskip("check_book", exc_type=ImportError)

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def scene(view: str) -> str:
    """A page with a frame such as a scene's; its slider does nothing."""
    inner = f"<div id=view style='height: 100px'>{view}</div><input id=frame type=range>"
    return (
        f'<figure class="motionlab-scene"><iframe loading=lazy srcdoc="{inner}"></iframe></figure>'
    )


FAULTS = {
    "asks for": '<img src="http://example.invalid/a.png">',
    "console: broken": "<script>console.error('broken')</script>",
    "script: ": "<script>undefinedFunction()</script>",
    "scrolls sideways": '<div style="width: 800px">wide</div>',
    "weighs": f"<!-- {'x' * 2_600_000} -->",
    "none drawn": '<span class="math">\\(x\\)</span>',
    "did not start": '<figure class="motionlab-player"></figure>',
    "does not move": (
        '<figure class="motionlab-player"><canvas></canvas><button>Play</button>'
        '<input type="range" max="100"></figure>'
    ),
    "network 1 did not load: nothing beside": (
        '<figure class="motionlab-dream"><canvas></canvas><button>Load the network</button>'
        '<p role="status">nothing beside this page</p></figure>'
    ),
    "network 1 takes": (
        '<figure class="motionlab-dream" data-live><canvas></canvas>'
        "<button>Load the network</button><script>motionlabWeights = {};"
        "document.currentScript.parentElement.motionlab = {live: {}, player: {frame: 99}, dreamer: "
        "{advance() { for (const t = Date.now() + 60; Date.now() < t; ); }}}</script></figure>"
    ),
    "path 1 is not walked: nothing beside": (
        '<figure class="motionlab-path"><svg role="application" width="99" height="99"></svg>'
        '<button>Walk</button><p aria-live="polite">nothing beside this page</p></figure>'
    ),
    "path 1: who walks does not move": (
        '<figure class="motionlab-path" data-walked><svg role="application" width="99" height="99">'
        "</svg><button>Walk</button><script>document.currentScript.parentElement.motionlab = "
        "{player: {frame: 3}}</script></figure>"
    ),
    "path 1 does not say how far": (
        '<figure class="motionlab-path" data-walked><svg role="application" width="99" height="99">'
        "</svg><button>Walk</button><script>document.currentScript.parentElement.motionlab = "
        "{player: {get frame() { return Date.now(); }}}</script></figure>"
    ),
    "steered 1 did not load: nothing beside": (
        '<figure class="motionlab-steer"><canvas></canvas><button>Load the network</button>'
        '<p role="status">nothing beside this page</p></figure>'
    ),
    "steered 1 does not turn": (
        '<figure class="motionlab-steer" data-live><canvas tabindex="0"></canvas>'
        "<button>Load the network</button><script>document.currentScript.parentElement.motionlab = "
        "{steered: {characters: [{before: {going: {bearing: 0}}}]}}</script></figure>"
    ),
    "image-alt, 1 times, first at img": '<img src="data:,">',
    "scene 1 did not start": scene("The script of this scene is missing beside the page."),
    "scene 1 draws nothing": scene("<canvas></canvas>"),
    "scene 1 shows the same picture": scene("<canvas width=50 style='background: black'></canvas>"),
}
SEARCH = '<ul id="search-results"><li><a href="index.html">found</a></li></ul>'
GOOD = {"index": "<p>fine</p>", "search": SEARCH}
AWAY = '<meta http-equiv="Refresh" content="0; url={}.html" />'


def write(folder, pages):
    """A tiny book."""
    for name, body in pages.items():
        html = (
            f"<!doctype html><html lang=en><link rel=icon href=data:,><title>{name}</title>{body}"
        )
        (folder / f"{name}.html").write_text(html, encoding="utf-8")


@pytest.fixture(scope="module")
def troubles(tmp_path_factory):
    try:
        check_book.chromium()
    except SystemExit as missing:
        pytest.skip(str(missing))
    folder = tmp_path_factory.mktemp("book")
    away = {"away": AWAY.format("index"), "lost": AWAY.format("nowhere")}
    write(folder, {f"fault{i}": body for i, body in enumerate(FAULTS.values())} | away | GOOD)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(check_book, "PATIENCE", 1_000)  # nothing here will ever appear
        return check_book.check(folder, served=False)


@pytest.mark.parametrize("number, expected", list(enumerate(FAULTS)))
def test_planted_fault_is_found(troubles, number, expected):
    assert any(f"fault{number}.html" in line and expected in line for line in troubles), troubles


def test_a_player_that_saves_nothing_is_found(troubles):
    assert any("player 1 can't be saved" in line for line in troubles), troubles


def test_good_pages_pass(troubles, tmp_path):
    assert not [line for line in troubles if "index.html" in line or "search" in line]
    write(tmp_path, GOOD)
    assert check_book.check(tmp_path, at_once=2) == []


def test_a_page_that_sends_on_is_checked_where_it_leads(troubles):
    assert [line for line in troubles if "away" in line or "lost" in line] == [
        "lost.html: sends on to nowhere.html, which there is not"
    ]
