"""Pace, of models whose pace is known."""

from types import SimpleNamespace

import pytest
import torch

from experiments.rnn_gan import keeping_pace
from motionlab import metrics
from motionlab.errors import DataError
from motionlab.training import prepare


@pytest.fixture(scope="module")
def gaits():
    return prepare("gaits")


def going_on(data, factor, lost=0):
    """A model whose body glides straight on, in the pose and `factor` times the pace of the last
    frame that it saw."""

    def generate(frames, state, generator=None):
        steps = state[:, -1:].expand(-1, frames, -1).clone()
        steps[..., [0, 2]] = 0.0
        steps[..., 1] *= factor
        steps[:lost, frames // 2 :] = torch.nan
        return steps

    return SimpleNamespace(
        fps=data.encoding.fps, encoding=data.encoding, observe=lambda f: f, generate=generate
    )


@pytest.fixture(scope="module", params=["walk", "run"])
def begun(gaits, request):
    gait = request.param
    some, speeds, _ = keeping_pace.starts(gaits, gait, "train", 4)
    glides = some[:, -1, 1] * gaits.encoding.fps
    return gait, some, speeds, glides


def test_starts_are_steady_and_of_their_gait(gaits, begun):
    gait, some, speeds, _ = begun
    least, most = keeping_pace.GAITS[gait]
    assert 1 <= len(some) <= 4 and some.shape[1] == 30
    assert ((speeds >= least) & (speeds < most)).all()
    within = metrics.speed(gaits.encoding.positions(some), 30.0)
    torch.testing.assert_close(within.mean(-1), speeds, rtol=0.01, atol=0)  # cut off, ends differ
    assert (within[:, :10].mean(-1) / speeds - 1).abs().max() <= keeping_pace.STEADY + 0.01


def test_no_start_is_of_a_clip_that_stops(gaits):
    whole, *_ = keeping_pace.starts(gaits, "run", "train", 10_000)
    names = [n for n, s in zip(gaits.names, gaits.splits, strict=True) if s == "train"]
    stops = [c for n, c in zip(names, gaits.clips("train"), strict=True) if "stop" in n]
    assert stops
    windows = torch.cat([clip.unfold(0, 30, 1).mT for clip in stops])
    assert not any((windows == start).all(-1).all(-1).any() for start in whole)


def test_clips_that_last_tell_how_people_go_on(gaits):
    _, speeds, clips = keeping_pace.starts(gaits, "walk", "train", 50)
    found = keeping_pace.people(clips, speeds, 30)
    assert found["1-3 s"].value == pytest.approx(1, abs=0.1)
    assert found["1-3 s"].clips == sum(len(clip) >= 90 for clip in clips) > 0
    assert "30-60 s" not in found
    slower = keeping_pace.people([clip / 2 for clip in clips], speeds, 30)
    assert slower["1-3 s"].value == pytest.approx(found["1-3 s"].value / 2)


def test_where_nobody_keeps_a_pace_it_is_said(gaits, monkeypatch):
    monkeypatch.setitem(keeping_pace.GAITS, "run", (8.0, 9.0))
    with pytest.raises(DataError, match="train: no clip .* of a run"):
        keeping_pace.starts(gaits, "run", "train", 4)


@pytest.mark.parametrize("factor, kept", [(1.0, True), (1.04, True), (0.8, False), (0.4, False)])
def test_the_pace_that_is_kept_and_the_one_that_is_not(gaits, begun, factor, kept, monkeypatch):
    gait, some, speeds, glides = begun
    monkeypatch.setattr(keeping_pace, "SEEDS", (0,))
    found = keeping_pace.told(going_on(gaits, factor), some, glides, gait, {})
    for its in found["spans"].values():
        assert its["speed over the start's"]["value"] == pytest.approx(factor, abs=1e-3)
        assert its["in another gait"] == (factor < keeping_pace.LEFT[gait][0])
        assert its["lost"] == 0
    assert found["keeps its pace"] is kept and found["starts"] == len(some)


def test_who_is_lost_has_not_kept_it(gaits, begun, monkeypatch):
    gait, some, _, glides = begun
    monkeypatch.setattr(keeping_pace, "SEEDS", (0,))
    found = keeping_pace.told(going_on(gaits, 1.0, lost=1), some, glides, gait, {})
    lost = {span: its["lost"] for span, its in found["spans"].items()}
    assert lost.pop("30-60 s") == 1 and not any(lost.values())
    assert not found["keeps its pace"]
