"""Judging refiners: a critic that is fair, a score that can go either way, and the choice."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
import torch

from motionlab.errors import TrainingError
from motionlab.models import Refiner
from motionlab.training import GAMES, build, judging
from motionlab.training.checkpoints import load_weights, save_weights
from motionlab.training.judging import Judge, choose, critic


@pytest.fixture(scope="module")
def generator(gaits, smoke):
    model = build(gaits, smoke()).eval().requires_grad_(False)
    model.sampling = {"temperature": 0.1}
    return model


@pytest.fixture(scope="module")
def judge(generator, gaits):
    return Judge(generator, gaits, "train", seconds=3.0)


@pytest.mark.parametrize("said", [None, {"temperature": 0.5, "memory": 0.9}])
def test_samples_are_drawn_as_the_generator_is_used_or_as_is_said(
    generator, gaits, monkeypatch, said
):
    class Drawn(Exception):
        pass

    def generate(_frames, _state, generator, **sampling):
        raise Drawn(sampling)

    monkeypatch.setattr(generator, "generate", generate)
    with pytest.raises(Drawn) as drawn:
        Judge(generator, gaits, "train", seconds=1.0, sampling=said)
    assert drawn.value.args == (said or {"temperature": 0.1},)


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(judging, "UPDATES", 60)
    monkeypatch.setattr(judging, "WIDTH", 16)


def newborn(judge, generator, reach=None):
    return Refiner(judge.encoding, generator.normalizer, 8, reach=reach)


def test_a_critic_cannot_tell_what_does_not_differ(gaits, quick):
    clips = gaits.clips("train")
    told = critic(gaits.encoding, (clips[::2], clips[::2]), (clips[1::2], clips[1::2]))
    assert told.accuracy == pytest.approx(0.5, abs=1e-6)  # right about one is wrong about the other
    assert len(told.real) == len(clips[1::2])


def test_a_critic_tells_feet_that_slide(gaits, quick):
    """The same clips, but a tenth of a metre a second to the left."""
    clips = gaits.clips("train")
    slid = [clip.clone() for clip in clips]
    for clip in slid:
        clip[:, 0] += 0.1 / gaits.encoding.fps
    told = critic(gaits.encoding, (clips[::2], slid[::2]), (clips[1::2], slid[1::2]))
    assert told.accuracy > 0.9
    again = critic(gaits.encoding, (clips[::2], slid[::2]), (clips[1::2], slid[1::2]))
    assert torch.equal(again.real, told.real)


def test_a_critic_does_not_see_contact_channels(gaits, quick):
    clips = gaits.clips("train")
    blurred = [clip.clone() for clip in clips]
    for clip in blurred:
        clip[:, gaits.encoding.slices["contacts"]] = 0.5
    told = critic(gaits.encoding, (clips[::2], blurred[::2]), (clips[1::2], blurred[1::2]))
    assert told.accuracy == pytest.approx(0.5, abs=1e-6)


def test_unrefined_motion_scores_one_for_each_of_four_distances(judge, generator):
    assert judge.score(judge.unrefined) == pytest.approx(4)
    found = judge(newborn(judge, generator))
    assert found["root (m)"] < 1e-5
    for key, value in judge.unrefined.items():
        assert found[key] == pytest.approx(value, rel=1e-2), key
    real = judge.real | {"frechet": 0.0, "critic": 0.5}
    assert judge.score(real) == pytest.approx(0)


def test_whoever_moves_the_root_is_out(judge, generator):
    refiner = newborn(judge, generator)
    refiner.leave.bias.data[1] = 0.1  # ahead, in deviations, every frame
    found = judge(refiner)
    assert found["root (m)"] > judging.STRAYED and found["score"] == math.inf


def test_the_best_of_a_folder_is_chosen(judge, generator, tmp_path, monkeypatch):
    scores = {5: 3.0, 10: 1.0, 15: math.inf}
    for step in scores:
        save_weights(tmp_path / f"at-{step}.safetensors", newborn(judge, generator), {"step": step})
    found = iter(scores.values())
    monkeypatch.setattr(Judge, "__call__", lambda *_: {"score": next(found)})
    best = choose(tmp_path, judge)
    assert best == {"step": 10, "score": 1.0}
    _, about = load_weights(tmp_path / "best.safetensors")
    assert about["step"] == 10 and about["judged"]["score"] == 1.0
    kept = json.loads((tmp_path / judging.JUDGED).read_text())
    assert [row["score"] for row in kept["refined"]] == [3.0, 1.0, None]


def test_nothing_to_choose_is_said(judge, generator, tmp_path, monkeypatch, gaits):
    with pytest.raises(TrainingError, match="no refiner is here"):
        choose(tmp_path, judge)
    save_weights(tmp_path / "at-5.safetensors", newborn(judge, generator), {"step": 5})
    monkeypatch.setattr(Judge, "__call__", lambda *_: {"score": math.inf})
    with pytest.raises(TrainingError, match="heavier root_weight"):
        choose(tmp_path, judge)
    with pytest.raises(TrainingError, match="another kind"):
        Judge(generator, gaits.without_contacts())
    short = [clip[:10] for clip in gaits.clips("train")]
    with pytest.raises(TrainingError, match="looks at 30 frames"):
        critic(gaits.encoding, (short, short), (short, short))


def test_presets_of_games_are_whole():
    for presets in GAMES.values():
        assert list(presets) == ["smoke", "table", "ship", "paper"]
        paper = presets["paper"]
        assert (paper.warmup, paper.turns, paper.history) == (75, 5, 320)
        assert (paper.refiner_rate, paper.discriminator_rate, paper.decay) == (0.002, 0.005, 0.9)
        assert not paper.reach and not paper.piece and not paper.steepness_weight
        assert replace(paper, seed=1).weights == "best.safetensors"
