"""Who is steered: what a page carries, what a kernel answers, bad input."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest
import torch
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

from motionlab.errors import ViewerError
from motionlab.feet.contacts import foot_points, rest_heights
from motionlab.models import Refiner
from motionlab.solvers.live_control import LiveControl
from motionlab.viewer import steer
from motionlab.viewer.live.network_figure import NetworkFigure
from motionlab.viewer.live.steer_kernel import SteerWidget


@pytest.fixture(scope="module")
def refiner(model):
    return Refiner(model.encoding, model.normalizer, width=20).requires_grad_(False)


@pytest.fixture
def in_page(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")


def content_of(figure: NetworkFigure) -> dict:
    data = re.search(r'<script type="application/json">(.*?)</script>', figure.html, re.DOTALL)
    return json.loads(data.group(1))


def values(content: dict) -> dict:
    return {each["name"]: each["value"] for each in content["networks"][0]["controls"]}


# -- in a page --------------------------------------------------------------------------------------


def test_a_page_carries_body_and_choices(in_page, model, refiner):
    figure = steer(model, refiner=refiner, speed=1.5, futures=4, caption="a < b")
    content = content_of(figure)
    assert 'class="motionlab-steer"' in figure.html and "a &lt; b" in figure.html
    (network,) = content["networks"]
    chosen = values(content)
    assert (chosen["speed"], chosen["futures"], chosen["temperature"]) == (1.5, 4, 0.3)
    assert network["starts"][chosen["start"]] == "stand"
    skeleton = model.encoding.skeleton
    assert network["body"]["feet"] == foot_points(skeleton)
    np.testing.assert_allclose(network["body"]["low"], rest_heights(skeleton)[[1, 3]])
    assert len(network["body"]["ranges"]["low"]) == model.encoding.slices["pose"].stop - 3
    assert network["clip"]["frames"] == 61


def test_a_book_gets_the_weights_of_all_networks_once(
    in_page, model, refiner, tmp_path, monkeypatch
):
    monkeypatch.setenv("MOTIONLAB_SCRIPTS", str(tmp_path))
    plain = steer(model, others=[(model, refiner)])
    assert plain._repr_html_() == plain.html
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {plain.weights.file, plain.others[0].file} and len(names) == 2
    alone = steer(model, refiner=refiner)
    assert alone.weights.file == plain.others[0].file


def test_a_model_without_a_stand_begins_with_its_first_start(in_page):
    content = content_of(steer(tiny_lstm(tiny_clips("walk_1.2", "run_3.0"))))
    assert values(content)["start"] == 0


def test_characters_beside_each_other_have_their_own_futures(in_page, model):
    cast = content_of(steer(model, beside=(1, 16)))["beside"]
    assert [each["futures"] for each in cast] == [1, 16]
    assert len({each["color"] for each in cast}) == 2


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"speed": 9}, "from 0.4 to 3.2"),
        ({"speed": math.nan}, "speed is nan"),
        ({"futures": 0}, "from 1 to 16"),
        ({"beside": (4,)}, "2 to 4"),
        ({"beside": (1, 99)}, "from 1 to 16"),
        ({"height": 3}, "pixels"),
    ],
)
def test_what_makes_no_sense_is_said(in_page, model, wrong, said):
    with pytest.raises(ViewerError, match=said):
        steer(model, **wrong)


def test_who_can_not_be_steered_is_refused(in_page, model, monkeypatch):
    with pytest.raises(ViewerError, match="AcLstm"):
        steer(tiny_aclstm(tiny_clips("walk_1.2")))
    other = tiny_lstm(tiny_clips("run_3.0"))
    with pytest.raises(ViewerError, match="can't refine"):
        steer(model, refiner=Refiner(other.encoding, other.normalizer, width=20))
    monkeypatch.delenv("MOTIONLAB_VIEWER")
    with pytest.raises(ViewerError, match="LiveControl"):
        steer(model)


# -- in a kernel ------------------------------------------------------------------------------------


@pytest.fixture
def asked(model, refiner, monkeypatch):
    """A widget, and what it answers when the page asks."""
    monkeypatch.delenv("MOTIONLAB_VIEWER", raising=False)
    made = steer(model, LiveControl, refiner=refiner, futures=2)
    heard: list[dict] = []
    monkeypatch.setattr(made, "send", heard.append)
    settings = {each["name"]: each["value"] for each in made.content["networks"][0]["controls"]}

    def ask(what="go", wish=None, **changed):
        message = {"do": what, "run": "a", "settings": settings | changed, "wish": wish or {}}
        made._asked(message)
        json.dumps(heard[-1])  # fit to be sent
        return heard[-1]

    return made, ask


def test_a_kernel_answers_window_by_window(asked):
    made, ask = asked
    assert isinstance(made, SteerWidget)
    first = ask("begin", lock=0)
    (character,) = first["characters"]
    assert first["run"] == "a" and first["seconds"] > 0
    assert np.shape(character["rows"]) == (5, made.live[0].model.encoding.dim)
    later = [ask(wish={"speed": 1.0, "direction": math.pi / 2}, lock=0) for _ in range(20)]
    assert later[-1]["characters"][0]["asked"] == {"speed": 1.0, "direction": math.pi / 2}
    told = np.concatenate([np.array(each["characters"][0]["places"]) for each in (first, *later)])
    root = made.motion().root_positions
    np.testing.assert_allclose(told[:, :2], root[:, [0, 2]], atol=1e-4)
    assert root[-1, 0] > root[0, 0] + 0.5  # where it was asked to


def test_what_the_page_draws_is_what_was_done(asked, model):
    made, ask = asked
    (character,) = ask("begin", lock=0)["characters"]
    rows = torch.tensor(character["rows"])
    for row, place, pose in zip(rows, character["places"], made.motion().positions(), strict=True):
        standing = row.clone()
        standing[:3] = 0
        drawn = model.encoding.positions(standing[None], torch.tensor(place))[0]
        assert (drawn - pose).abs().max() < 1e-3


def test_sliders_count_from_the_next_window_on(asked):
    made, ask = asked
    ask("begin")
    ask(futures=3, temperature=0.2, memory=0.5)
    how = made.live[0].how
    assert (how.futures, how.chance.temperature, how.chance.memory) == (3, 0.2, 0.5)
    assert how.way == "futures"
    ask(**{"gradient": 1, "term poses": 0})
    assert made.live[0].how.way == "gradient" and made.live[0].how.weights == {"poses": 0.0}


def test_beginning_again_gives_the_same_and_a_lock_waits(asked):
    made, ask = asked
    first, other, again = (ask("begin", seed=seed)["characters"] for seed in (3, 4, 3))
    assert again == first != other
    assert made.live[0].behind.late > 0


def test_feet_are_locked_or_let_go_while_he_walks_and_all_that_was_done_stays(asked):
    made, ask = asked
    assert made.content["restarts"] == ["start", "seed"]
    told = [ask("begin"), ask(lock=0), ask(lock=0, refined=0), ask(refined=0), ask()]
    counts = [len(each["characters"][0]["rows"]) for each in told]
    assert counts == [5, 10, 5, 5, 5] and made.motion().frames == 30
    assert [each["characters"][0]["late"] for each in told] == [5, 0, 0, 5, 5]
    places = np.concatenate([np.array(each["characters"][0]["places"]) for each in told])
    assert np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1).max() < 0.1  # nobody jumps


def test_what_a_cell_asks_counts_until_the_page_asks_for_something_else(asked):
    made, ask = asked
    stand, walk = {"speed": 0.0, "direction": 0.0}, {"speed": 1.0, "direction": 0.0}
    ask("begin", wish=stand)
    made.live[0].steer(1.2, target=[2.0, 0.0])
    told = [ask(wish=stand) for _ in range(4)]
    assert made.live[0].aim.target[0].tolist() == [2.0, 0.0]
    said = told[-1]["characters"][0]["asked"]  # the arrow points to the place
    assert said["speed"] > 0.2 and said["direction"] == pytest.approx(math.pi / 2, abs=0.5)
    ask(wish=walk)
    assert made.live[0].aim.target.isnan().all() and float(made.live[0].aim.speed[0]) == 1.0
    ask("begin", wish=stand)  # heard again by who begins again
    assert float(made.live[0].aim.speed[0]) == 0.0


def test_who_is_far_from_a_line_goes_to_its_beginning_and_then_along_it(asked):
    made, ask = asked
    ask("begin", lock=0)
    line = [[0.0, 3.0], [0.0, 5.0], [1.0, 6.0]]
    first = ask(wish={"speed": 1.2, "line": line}, lock=0)["characters"][0]
    assert first["asked"]["direction"] == pytest.approx(0, abs=0.2)
    assert int(made.live[0].aim.which[0]) == -1
    for _ in range(60):
        (last,) = ask(wish={"speed": 1.2, "line": line}, lock=0)["characters"]
        assert abs(last["asked"]["direction"]) <= math.pi
    assert int(made.live[0].aim.which[0]) == 0 and float(made.live[0].aim.arcs[0]) > 1
    assert math.hypot(last["places"][-1][0] - 1, last["places"][-1][1] - 6) < 1.2
    ask(wish={"speed": 1.2, "direction": 0.0}, lock=0)
    assert int(made.live[0].aim.which[0]) == -1
    assert "at least" in ask(wish={"speed": 1.0, "line": [[0.0, 0.0]]})["failed"]


def test_a_wish_that_leads_nowhere_is_told(asked):
    _, ask = asked
    ask("begin")
    assert "NaN" in ask(wish={"speed": 1.0, "direction": math.nan})["failed"]
    assert "characters" in ask(wish={"speed": 1.0, "direction": 0.0})


def test_a_kernel_steers_several_beside_each_other(model):
    made = steer(model, LiveControl, beside=(1, 2))
    heard = []
    made.send = heard.append
    settings = {each["name"]: each["value"] for each in made.content["networks"][0]["controls"]}
    made._asked({"do": "begin", "run": "b", "settings": settings, "wish": {}})
    assert len(heard[0]["characters"]) == 2
    assert [live.how.futures for live in made.live] == [1, 2]
