"""A path to draw: what a page carries, what a kernel does when somebody presses walk, bad input."""

from __future__ import annotations

import json
import re
import threading
from functools import partial

import numpy as np
import pytest
import torch
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

import motionlab
from motionlab.errors import SolverError, ViewerError
from motionlab.models import Refiner
from motionlab.paths import Path
from motionlab.viewer import draw_path
from motionlab.viewer.live.draw_path_kernel import PathWidget
from motionlab.viewer.live.draw_path_page import page_figure
from motionlab.viewer.live.network_figure import NetworkFigure

CORNERS = [[0, 0], [0, 3], [2, 3]]


@pytest.fixture(scope="module")
def solved(clips):
    record = {"timing": {"asked (m/s)": 9.0}, "start": "run_3.0"}
    return [
        ("corners", CORNERS, clips[0][:40]),
        ("curve", Path.through(CORNERS, spline=True), clips[1][:40], record),
    ]


# -- in a page --------------------------------------------------------------------------------------


def test_a_page_carries_network_choices_and_solved_paths(model, solved):
    figure = page_figure(model, solved, 1.5, caption="a < b")
    data = re.search(r'<script type="application/json">(.*?)</script>', figure.html, re.DOTALL)
    content = json.loads(data.group(1))
    assert 'class="motionlab-path"' in figure.html and "a &lt; b" in figure.html
    assert {c["name"]: c["value"] for c in content["controls"]} == {
        "speed": 1.5, "start": -1, "seed": 0,
    }  # fmt: skip
    assert content["starts"] == list(model.start_names)
    assert content["live"]["settings"] == {
        "temperature": 0.5, "component_temperature": 1, "memory": 0, "noise": 0,
    }  # fmt: skip
    first, second = content["solved"]
    assert first == {"name": "corners", "points": CORNERS, "speed": None, "start": None}
    assert second["speed"] == 4 and second["start"] == 1  # as fast as the slider goes
    curve = Path.through(CORNERS, spline=True).drawn
    np.testing.assert_allclose(second["points"], curve, atol=1e-3)
    assert len(curve) > 100
    assert [track["frames"] for track in content["walks"]["tracks"]] == [40, 40]
    assert len(content["walks"]["bodies"]) == 1  # they share it


def test_twelve_solved_paths_weigh_little(model, clips):
    walk = clips[0][:40]
    long = type(walk)(walk.skeleton, walk.root_positions.repeat(7, 1), walk.rotations.repeat(7, 1, 1, 1),
                      walk.fps)  # fmt: skip
    figure = page_figure(model, [(f"path {i}", CORNERS, long) for i in range(12)])
    assert len(figure.html) < 1e6


def test_a_book_gets_the_weights_beside_its_pages(model, tmp_path, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    monkeypatch.setenv("MOTIONLAB_SCRIPTS", str(tmp_path / "_static"))
    figure = draw_path(model)
    assert isinstance(figure, NetworkFigure) and figure._repr_html_() == figure.html
    (written,) = (tmp_path / "_static").iterdir()
    assert figure.content["live"]["script"] == f"_static/{written.name}"


def test_without_solved_paths_there_is_no_list_of_them(model):
    content = page_figure(model).content
    assert content["solved"] == [] and content["walks"] is None


# -- in a kernel ------------------------------------------------------------------------------------


class Design:
    """Stands in for motionlab.design: windows of 17 frames of a clip, until it is stopped."""

    def __init__(self, clip, windows: int = 2):
        self.clip, self.windows, self.asked = clip, windows, []
        self.go_on = threading.Event()
        self.go_on.set()

    def __call__(self, points, speed, start, model, *, seed, watch, refiner=None):
        self.refiner = refiner
        self.asked.append((np.asarray(points).tolist(), speed, start, seed))
        if speed > 3:
            raise SolverError("Nobody is as fast as that.")
        if speed < 0.5:
            raise ZeroDivisionError("by nothing")
        if seed == 99:
            raise KeyboardInterrupt
        frames, finished = 0, True
        try:
            for window in range(self.windows):
                frames = 17 * (window + 1)
                watch(self.clip[frames - 17 : frames], frames / (17 * self.windows))
                assert self.go_on.wait(10)
        except KeyboardInterrupt:
            finished = False
        error = {"rms": 0.7, "rms to the drawn line": 1.9}
        return self.clip[:frames], {
            "error (cm)": error, "notes": ["it was cold"], "finished": finished,
        }  # fmt: skip


@pytest.fixture
def design(clips):
    return Design(clips[0])


@pytest.fixture
def widget(model, design):
    made = draw_path(model, design)
    made.told = []
    made.send = made.told.append
    return made


def press(widget, **wish):
    message = {"do": "walk", "id": "a", "points": CORNERS, "speed": 1.2, "start": -1, "seed": 0}
    widget._handle_custom_msg(message | wish, [])


def walked(widget, **wish) -> list[dict]:
    press(widget, **wish)
    widget.join()
    return widget.told


def test_walk_asks_design_and_shows_each_window(widget, design, clips):
    first, second, end = walked(widget, start=1, seed=5)
    assert design.asked == [(CORNERS, 1.2, "1", 5)]
    assert {said["id"] for said in widget.told} == {"a"}
    assert [said["frames"]["frames"] for said in (first, second)] == [17, 17]
    assert [said["share"] for said in (first, second)] == [0.5, 1.0]
    assert end["whole"]["frames"] == 34 and end["notes"] == ["it was cold"] and end["finished"]
    assert end["error"] == {"curve": 0.7, "drawn": 1.9}
    assert end["whole"]["tracks"][0]["name"].startswith("walk along a line")
    json.dumps(widget.told)  # it goes over the wire


def test_a_refiner_is_asked_for_by_a_tick(model, design):
    refiner = Refiner(model.encoding, model.normalizer, width=8)
    widget = draw_path(model, design, refiner=refiner)
    assert [c["name"] for c in widget.content["controls"]][-1] == "refined"
    for tick, expected in ((1, refiner), (0, None)):
        press(widget, refined=tick)
        widget.join()
        assert design.refiner is expected
    other = tiny_lstm(tiny_clips("walk_1.2", "stand"))
    with pytest.raises(ViewerError, match="can't refine"):
        draw_path(other, design, refiner=refiner)


def test_motionlab_design_is_asked_as_it_wants_to_be(model):
    """A short way, and a search that does little."""
    widget = draw_path(model, partial(motionlab.design, steps=2, candidates=1))
    widget.told, widget.send = [], lambda said: widget.told.append(said)
    *windows, end = walked(widget, points=[[0, 0], [0, 2]], start=0)
    assert sum(said["frames"]["frames"] for said in windows) == end["whole"]["frames"]
    assert [said["share"] for said in windows] == sorted(said["share"] for said in windows)
    assert end["error"]["curve"] >= 0
    json.dumps(widget.told)
    assert "leads nowhere" in walked(widget, points=[[0, 0]])[-1]["failed"]
    assert "start '7'" in walked(widget, start=7)[-1]["failed"]


def test_the_start_is_designs_choice_if_nobody_chose(widget, design):
    walked(widget)
    assert design.asked[0][2] is None


def test_stop_ends_it_after_the_window(widget, design):
    design.go_on.clear()
    press(widget)
    widget._handle_custom_msg({"do": "stop"}, [])
    design.go_on.set()
    widget.join()
    assert len(widget.told[-1]["whole"]["tracks"]) == 1
    assert widget.told[-1]["whole"]["frames"] < 35 and not widget.told[-1]["finished"]


def test_who_closes_the_widget_waits_for_no_more(widget, design):
    design.windows = 100
    design.go_on.clear()
    press(widget)
    widget.close()
    design.go_on.set()
    widget.join()
    assert widget.told[-1]["whole"]["frames"] < 35


def test_another_walk_takes_the_place_of_one_under_way(model, clips):
    design = Design(clips[0], windows=100_000)
    design.clip = type("Endless", (), {"__getitem__": lambda _, rows: clips[0][:17]})()
    widget = draw_path(model, design)
    widget.told, widget.send = [], lambda said: widget.told.append(said)
    press(widget)
    design.windows = 1
    press(widget, id="b")
    widget.join()
    assert "whole" in widget.told[-1] and widget.told[-1]["id"] == "b"
    assert [said["id"] for said in widget.told if "whole" in said] == ["a", "b"]


def test_what_can_not_be_walked_is_said(widget, design):
    assert walked(widget, speed=9.0) == [{"id": "a", "failed": "Nobody is as fast as that."}]
    assert "Stopped" in walked(widget, seed=99)[-1]["failed"]
    assert "whole" in walked(widget)[-1]  # and it can be asked again


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("wish", [{"speed": 0.2}, {"points": "no"}])
def test_the_page_never_waits_for_ever(widget, wish):
    assert "The search ended with" in walked(widget, **wish)[-1]["failed"]


def test_nothing_else_it_is_sent_matters(widget):
    widget._handle_custom_msg({"do": "dance"}, [])
    widget._handle_custom_msg({}, [])
    assert widget.told == []


def test_a_kernel_gets_a_widget_with_the_same_choices(model, design, solved):
    widget = draw_path(model, design, solved=solved, caption="c")
    assert isinstance(widget, PathWidget) and widget.kind == "path" and widget.caption == "c"
    page = page_figure(model, solved).content
    assert {k: v for k, v in page.items() if k not in ("live", "facts")} == {
        k: v for k, v in widget.content.items() if k != "facts"
    }


# -- what is given ----------------------------------------------------------------------------------


def test_models_that_can_not_be_led_are_refused(model, clips):
    with pytest.raises(ViewerError, match="AcLstm"):
        page_figure(tiny_aclstm(clips))
    with pytest.raises(ViewerError, match="Linear"):
        page_figure(torch.nn.Linear(2, 2))
    with pytest.raises(ViewerError, match=r"draw_path\(model, motionlab\.design\)"):
        draw_path(model)
    bare = tiny_lstm(clips, updates=1)
    bare.start_names = ()
    with pytest.raises(ViewerError, match=r"model\.starts"):
        page_figure(bare)


@pytest.mark.parametrize(
    ("item", "match"),
    [
        ("circle", "solved path 1 is a str"),
        (("circle", CORNERS), "motionlab.design gives"),
        (("circle", CORNERS, "walk"), "circle.*no Motion"),
        (("circle", [[0, 0], [np.nan, 1]], "clip"), "circle.: Place 2"),
        (("circle", [[0, 0, 0]], "clip"), "shape"),
        (("circle", [[1, 1], [1, 1]], "clip"), "differ"),
        (("circle", "abc", "clip"), "numbers"),
        (("circle", CORNERS, "slow"), "resample"),
    ],
)
def test_solved_paths_that_are_none_are_refused(model, clips, item, match):
    motions = {"clip": clips[0], "slow": clips[0].resample(20)}
    if isinstance(item, tuple) and len(item) == 3:
        item = (*item[:2], motions.get(item[2], item[2]))
    with pytest.raises(ViewerError, match=match):
        page_figure(model, [item])


@pytest.mark.parametrize("more", [{"speed": 0}, {"speed": "fast"}, {"height": 3}, {"color": "wet"}])
def test_settings_that_make_no_sense_are_refused(model, more):
    with pytest.raises(ViewerError):
        page_figure(model, **more)
