"""Knobs: the same settings in a kernel, where they are computed, and in a page, where they were."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import ipywidgets
import pytest
import torch

from motionlab.datasets import gaits
from motionlab.errors import MotionError, ViewerError
from motionlab.viewer import knobs
from motionlab.viewer.live.player import Player

WALK = gaits.make(seconds=1, speed=1.4)
VALUES = {"rise": (0.0, 0.1, 0.3), "still": (False, True)}


def make(rise, still):
    """A walk lifted by so many metres, or a body that stays in its first pose."""
    lifted = WALK.root_positions + torch.tensor([0.0, rise, 0.0])
    motion = replace(WALK, root_positions=lifted)
    if still:
        motion = replace(WALK[:1].resample(30), contacts=None)
    return motion, f"rise {rise:g}, still {still}"


@pytest.fixture
def box():
    return knobs(make, VALUES, start={"rise": 0.1}, labels={"rise": "Rise (m)"}, caption="Up")


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    return knobs(make, VALUES, start={"rise": 0.1}, labels={"rise": "Rise < (m)"}, caption="a < b")


def fields(box) -> dict[str, ipywidgets.Widget]:
    return {field.description: field for field in box.children[1].children}


def test_in_a_kernel_every_turn_makes_another_motion_and_back_the_same(box):
    player, said = box.children[0], box.children[2]
    assert isinstance(player, Player) and player.caption == "Up"
    assert said.value == "rise 0.1, still False"
    before, player.frame = player.payload, 9
    fields(box)["Rise (m)"].value = 0.2  # any value, not only those of a page
    assert said.value == "rise 0.2, still False"
    assert player.payload["tracks"] != before["tracks"]
    assert player.frame == 9  # its clock goes on
    fields(box)["Rise (m)"].value = 0.1
    assert player.payload == before
    fields(box)["still"].value = True
    assert player.payload["frames"] == 1 and player.frame == 0
    assert "kernel" in box.children[3].value


def test_no_label_is_cut_off(box):
    """8 pixels a letter are enough in JupyterLab, 7 are not."""
    for label, field in fields(box).items():
        assert 8 * len(label) <= int(field.style.description_width.removesuffix("px"))


def test_a_slider_reaches_every_value_of_a_page(box):
    slider = fields(box)["Rise (m)"]
    assert (slider.min, slider.max) == (0.0, 0.3)
    for value in VALUES["rise"]:
        assert (value / slider.step) % 1 == pytest.approx(0, abs=1e-6)


def test_words_are_a_list_to_choose_from(monkeypatch):
    """In any order; the function is given the word."""
    values = {"who": ("the walk", "a < b", "again")}
    which = lambda who: make(0.1 * len(who), False)
    box = knobs(which, values, start={"who": "again"})
    field = fields(box)["who"]
    assert field.options == values["who"] and field.value == "again"
    field.value = "a < b"
    assert box.children[2].value == "rise 0.5, still False"
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    text = knobs(which, values, start={"who": "again"})._repr_html_()
    assert '<option value="1">a &lt; b</option><option value="2" selected>again</option>' in text
    assert 'class="said" aria-live="polite">rise 0.5, still False</output>' in text
    for bad in (("one", "one"), ("one", 2.0)):
        with pytest.raises(ViewerError, match="different words"):
            knobs(which, {"who": bad})


def test_what_cannot_be_made_is_said_and_the_last_motion_stays():
    def picky(rise):
        if rise > 0.2:
            raise MotionError("that high?")
        return make(rise, False)

    box = knobs(picky, {"rise": (0.0, 0.3)})
    before = box.children[0].payload
    fields(box)["rise"].value = 0.3
    assert box.children[2].value == "that high?" and box.children[0].payload == before


def test_a_page_holds_all_settings_and_each_motion_once(page):
    text = page._repr_html_()
    names, made = json.loads(re.search(r"const \[names, made\] = (.*);", text)[1])
    assert names[0] == ["0", "0.1", "0.3"] and len(made) == 6
    content = json.loads(re.search(r'<script type="application/json">(.*?)</script>', text)[1])
    assert len(content["tracks"]) == 4  # a body that stays in its pose is one for all rises
    assert [made[f"{i},1"][0] for i in range(3)] == [made["0,1"][0]] * 3
    assert content["chosen"] == made["1,0"][0]
    for number, said in made.values():
        still = content["tracks"][number]["frames"] == 1
        assert said.endswith(f"still {still}")


def test_a_page_says_where_its_knobs_stand_without_scripts(page):
    text = page.html
    assert 'max="2" value="1"><output>0.1</output>' in text
    assert "Rise &lt; (m)" in text and "<figcaption>a &lt; b</figcaption>" in text
    assert '<output class="said" aria-live="polite">rise 0.1, still False</output>' in text
    assert "Computed beforehand" in text and "<noscript><img" in text
    assert "checked" not in text.partition("<script>")[0].partition('type="checkbox"')[2][:30]


def test_a_page_is_the_motion_of_the_kernel(page, monkeypatch):
    monkeypatch.delenv("MOTIONLAB_VIEWER")
    text = page.html
    content = json.loads(re.search(r'<script type="application/json">(.*?)</script>', text)[1])
    box = knobs(make, VALUES, start={"rise": 0.1})
    live = box.children[0].payload["tracks"][0]
    assert live["turns"] == content["tracks"][content["chosen"]]["turns"]


@pytest.mark.parametrize(
    ("values", "start", "message"),
    [
        ({}, None, "values for"),
        ({"rise": (0.1,)}, None, "two or more"),
        ({"rise": ()}, None, "two or more"),
        ({"rise": (0.3, 0.1)}, None, "rising"),
        ({"rise": (0.1, 0.3)}, {"rise": 0.2}, "start at one"),
        ({"rise": (0.1, 0.3)}, {"fall": 0.2}, "start for"),
    ],
)
def test_settings_that_make_no_sense(values, start, message):
    with pytest.raises(ViewerError, match=message):
        knobs(make, values, start=start)


def test_a_function_that_makes_no_motion():
    with pytest.raises(ViewerError, match="a Motion and a line"):
        knobs(lambda rise: WALK, {"rise": (0.0, 1.0)})


def test_too_many_settings_for_a_page(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    with pytest.raises(ViewerError, match="too many"):
        knobs(make, {"rise": tuple(range(31)), "still": (False, True)})
