"""A study as a rater meets it: one page from disk, by keys, that loses nothing; its file is analysed."""

from __future__ import annotations

import json

import pytest
from study_cases import sources

from motionlab.studies.analysis import analyse
from motionlab.studies.answers import read_answers
from motionlab.studies.build import build
from motionlab.studies.page import study_here, study_page
from motionlab.studies.report import in_words

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]
PATIENCE = 60_000  # milliseconds, on a busy machine
STATE = "document.querySelector('.ml-study').motionlab"
NO_STORE = (
    "Object.defineProperty(globalThis, 'localStorage', { get() { throw new Error('refused'); } });"
)
NO_HISTORY = "History.prototype.replaceState = () => { throw new Error('refused'); };"
NO_WEBGL = (
    "HTMLCanvasElement.prototype.getContext = OffscreenCanvas.prototype.getContext = () => null;"
)


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """Two methods, one gait, two short clips each, one check; as ratings and as pairs."""
    folder = tmp_path_factory.mktemp("study")
    motions = sources(methods=("RNN", "mocap"), kinds=("walk",), seconds=1.0)
    found = {}
    for design in ("ratings", "pairs"):
        built = build(motions, design=design, checks=1, replays=1, contact="a@b.example")
        page = study_page(built, reveal=design == "pairs")
        (folder / f"{design}.html").write_text(page, encoding="utf-8")
        found[design] = built.study
    return folder, found


@pytest.fixture
def folder(studies):
    return studies[0]


@pytest.fixture
def ratings(studies):
    return studies[1]["ratings"]


def state(page, what: str):
    return page.evaluate(f"{STATE}.{what}")


def begin(page):
    page.get_by_label("I am an adult").focus()
    page.keyboard.press(" ")
    page.get_by_role("button", name="Begin").focus()
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Practice").wait_for()


def watch(page):
    page.keyboard.press(" ")
    page.wait_for_function(f"{STATE}.state.now.seen && !{STATE}.question.clip.player.playing", timeout=PATIENCE)  # fmt: skip


def answer(page, key: str):
    """See what is asked to its end, and answer by keys alone."""
    watch(page)
    page.keyboard.press(key)
    page.keyboard.press("Enter")


def asked(page) -> int | None:
    return page.evaluate(f"{STATE}.task().asks")


def answer_all(page, key_of=lambda page: "4"):
    while page.get_by_role("heading", name="That was all").count() == 0:
        answer(page, key_of(page))


def save(page, folder, button="Save my answers"):
    with page.expect_download(timeout=PATIENCE) as waiting:
        page.get_by_role("button", name=button).click()
    folder.mkdir(exist_ok=True)
    file = folder / waiting.value.suggested_filename
    waiting.value.save_as(file)
    return file


def test_a_rater_takes_it_by_keys_reloads_saves_and_is_analysed(visit, ratings, tmp_path):
    page = visit("ratings.html").page
    begin(page)
    answer(page, "3")  # practice
    keys = iter("12345")
    rate = lambda page: str(asked(page) or next(keys))
    for _ in range(2):
        answer(page, rate(page))
    watch(page)  # seen, but not answered
    before = state(page, "state")
    page.reload()
    page.get_by_role("heading", name="3 of 5").wait_for()
    after = state(page, "state")
    assert after["answers"] == before["answers"] and len(after["answers"]) == 2
    assert after["now"]["plays"] == 1 and after["now"]["seen"]
    page.keyboard.press(rate(page))
    page.keyboard.press("Enter")
    answer_all(page, rate)
    file = save(page, tmp_path / "answers")
    answers, out = read_answers(file.parent, ratings)
    assert not out and len(answers) == 1 and not answers[0].simulated
    given = [one["value"] for one in json.loads(file.read_text())["body"]["answers"]]
    checks = [item.id for item in ratings.items if item.asks is not None]
    of = dict(
        zip([ratings.items[i].id for i in ratings.orders[answers[0].order]], given, strict=True)
    )
    assert answers[0].values == of and all(of.pop(name) for name in checks)
    assert list(of.values()) == [1, 2, 3, 4]
    assert set(answers[0].plays.values()) == {1}
    text = in_words(analyse(ratings, answers), out)
    assert "1 rater" in text and "imulated" not in text
    page.get_by_role("button", name="Another person").click()
    page.get_by_role("heading", name="Before you begin").wait_for()
    assert state(page, "state.answers") == []


def test_a_clip_is_seen_to_its_end_and_a_few_times_at_most(visit):
    page = visit("ratings.html").page
    begin(page)
    answer(page, "3")
    page.keyboard.press("4")  # not before it was seen
    assert state(page, "state.now.value") is None
    assert page.get_by_role("radio").first.is_disabled()
    watch(page)
    assert page.get_by_role("button", name="Play again (1 left)").is_enabled()
    for key in ("Home", "ArrowLeft", "End"):  # no stepping through it
        page.locator("canvas").press(key)
    assert state(page, "question.clip.player.frame") == state(page, "question.clip.player.clock.frames") - 1  # fmt: skip
    page.keyboard.press(" ")
    page.wait_for_function(f"{STATE}.state.now.plays === 2 && !{STATE}.question.clip.player.playing", timeout=PATIENCE)  # fmt: skip
    assert page.get_by_role("button", name="Play again (0 left)").is_disabled()
    page.keyboard.press(" ")
    page.reload()
    page.get_by_role("button", name="Play again (0 left)").wait_for()
    page.keyboard.press(" ")
    assert state(page, "state.now.plays") == 2


def test_pairs_on_a_phone_by_touch(visit, studies, tmp_path):
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    one = visit("pairs.html", **phone)
    page, study = one.page, studies[1]["pairs"]
    page.get_by_text("I am an adult").tap()
    page.get_by_text("I was given a number").tap()
    page.get_by_label("Number").fill("1")
    page.get_by_role("button", name="Begin").tap()
    names = {1: "Left", 0: "No difference", 2: "Right"}
    chosen = iter([1, 0, 1])  # practice, and the two pairs
    while page.get_by_role("heading", name="That was all").count() == 0:
        asks = asked(page) if state(page, "state.practised") else None
        one.check_width()
        page.get_by_role("button", name="Play", exact=True).tap()
        page.wait_for_function(f"{STATE}.state.now.seen", timeout=PATIENCE)
        page.get_by_label(names[next(chosen) if asks is None else asks], exact=True).tap()
        page.get_by_role("button", name="Next").tap()
    answers, out = read_answers(save(page, tmp_path / "answers").parent, study)
    assert not out and answers[0].order == 1
    values = {item: answers[0].values[item.id] for item in study.items if item.clips}
    assert sorted(values.values()) == [0, 1]
    # its own analysis is that of the library: half a win for each, and one for the clip on the left
    left = next(study.sides(1, item)[0] for item, value in values.items() if value == 1)
    winner = study.method_of()[left]
    rows = [row.inner_text().split() for row in page.locator("tbody tr").all()]
    assert rows[0] == [winner, "75", "%"] and rows[1][1:] == ["25", "%"]


def test_where_storage_is_refused_the_window_keeps_answers_and_it_is_told(visit, browser, folder):
    window = browser.new_context(offline=True)
    window.add_init_script(NO_STORE)
    page = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    assert page.get_by_text("for this window only").is_visible()
    begin(page)
    answer(page, "3")
    answer(page, "2")
    page.reload()
    page.get_by_role("heading", name="2 of 5").wait_for()
    assert page.get_by_text("for this window only").is_visible()
    window.close()


def test_where_nothing_is_kept_a_saved_file_goes_on(browser, folder, tmp_path):
    window = browser.new_context(offline=True)
    window.add_init_script(NO_STORE + NO_HISTORY)
    page = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    assert page.get_by_text("keeps nothing").is_visible()
    begin(page)
    answer(page, "3")
    answer(page, "2")
    file = save(page, tmp_path, "Save what I have so far")
    page.reload()
    page.get_by_role("heading", name="Before you begin").wait_for()  # lost, as was told
    page.get_by_text("I was given a number").click()
    edited = tmp_path / "edited.json"
    edited.write_text(file.read_text().replace('"value": 2', '"value": 5'))
    page.get_by_label("Go on from a saved file").set_input_files(edited)
    page.get_by_text("Not taken: this file was changed").wait_for()
    page.get_by_label("Go on from a saved file").set_input_files(file)
    page.get_by_role("heading", name="2 of 5").wait_for()
    assert state(page, "state.answers[0].value") == 2
    window.close()


def test_of_two_windows_one_goes_on_and_the_other_says_so(browser, folder):
    window = browser.new_context(offline=True)
    first = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    begin(first)
    answer(first, "3")
    second = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    second.get_by_role("heading", name="1 of 5").wait_for()
    first.get_by_role("heading", name="open in another window").wait_for()
    answer(second, "2")
    first.bring_to_front()
    first.get_by_role("button", name="Go on here").click()
    first.get_by_role("heading", name="2 of 5").wait_for()
    second.get_by_role("heading", name="open in another window").wait_for()
    window.close()


def test_steps_back_and_windows_that_die_lose_nothing(browser, folder):
    window = browser.new_context(offline=True)
    url = (folder / "ratings.html").as_uri()
    page = check_book.Visit(window, url).page
    begin(page)
    answer(page, "3")
    answer(page, "2")
    page.goto("about:blank")
    page.go_back()
    page.get_by_role("heading", name="2 of 5").wait_for()
    answer(page, "5")
    page.close(run_before_unload=False)
    page = check_book.Visit(window, url).page
    page.get_by_role("heading", name="3 of 5").wait_for()
    assert [one["value"] for one in state(page, "state.answers")] == [2, 5]
    window.close()


def test_a_page_that_was_told_nothing_overwrites_nothing(browser, folder):
    """As one that comes back by a step back, after another went on."""
    window = browser.new_context(offline=True)
    page = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    begin(page)
    answer(page, "3")
    page.evaluate(f"""() => {{
      const store = {STATE}.store;
      const kept = {{ ...store.read(), token: "another window" }};
      const item = {STATE}.study.items[{STATE}.sequence[0]].id;
      kept.answers.push({{ item, value: 4, plays: 1, shown: 1, answered: 2 }});
      kept.now = null;
      localStorage.setItem(store.key, JSON.stringify(kept));
    }}""")
    page.keyboard.press(" ")  # which keeps how often it was played
    page.get_by_role("heading", name="open in another window").wait_for()
    page.get_by_role("button", name="Go on here").click()
    page.get_by_role("heading", name="2 of 5").wait_for()
    assert state(page, "state.answers[0].value") == 4
    window.close()


def test_without_webgl_nobody_judges_what_is_not_seen(browser, folder):
    window = browser.new_context(offline=True)
    window.add_init_script(NO_WEBGL)
    page = check_book.Visit(window, (folder / "ratings.html").as_uri()).page
    begin(page)
    page.get_by_text("please take another one").wait_for()
    assert page.get_by_role("button", name="Play").is_disabled()
    assert page.get_by_role("button", name="Next").is_disabled()
    window.close()


def test_in_a_notebook_it_is_a_page_within_the_page_and_keeps_answers(browser, folder, monkeypatch):
    monkeypatch.delenv("MOTIONLAB_VIEWER", raising=False)
    built = build(sources(methods=("RNN", "mocap"), kinds=("walk",), seconds=1.0), checks=0)
    cell = study_here(built, reveal=True)._repr_html_()
    (folder / "cell.html").write_text(f"<!doctype html><p>a cell</p>{cell}", encoding="utf-8")
    page = browser.new_context(offline=True).new_page()
    page.goto((folder / "cell.html").as_uri())
    inside = page.frame_locator("iframe")
    inside.get_by_label("I am an adult").check()
    inside.get_by_role("button", name="Begin").click()
    inside.get_by_role("heading", name="Practice").wait_for()
    page.reload()
    inside.get_by_role("heading", name="Practice").wait_for()
    page.context.close()
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")  # a built page has the script already
    assert "iframe" not in study_here(built).html
