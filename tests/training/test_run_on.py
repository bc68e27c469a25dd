"""Runs that go on, of runs whose course is known."""

import math

import pytest
import torch

from motionlab.datasets import load
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import TrainingError
from motionlab.metrics import speed
from motionlab.training import prepare
from motionlab.training.run_on import ALIKE, run_on, running, strides


@pytest.fixture(scope="module")
def runs():
    """Features of procedural runs and walks, each with what is to be known of it."""
    motions = [m for m in load("gaits") if float(m.root_positions[:, 0].diff().abs().sum()) > 0]
    encoding = JointAngles(motions[0].skeleton, motions[0].fps, contacts=True)
    clips = [encoding.encode(m) for m in motions]
    return clips, encoding, Normalizer.fit(clips)


def last_speed(clip, encoding):
    return float(speed(encoding.positions(clip), encoding.fps)[-15:].mean())


def test_runs_go_on_and_all_else_ends_as_it_was(runs):
    clips, encoding, normalizer = runs
    short = [clip[:75] for clip in clips]
    longer = run_on(short, encoding, normalizer, 200)
    which = [bool(running(clip, encoding)[-1]) for clip in short]
    assert any(which) and not all(which)
    fast = [last_speed(clip, encoding) for clip in short]
    assert all(its == (v > 2) for its, v in zip(which, fast, strict=True) if abs(v - 2) > 0.2)
    for clip, now, is_run in zip(short, longer, which, strict=True):
        if not is_run:
            assert now is clip
            continue
        assert len(now) == 200
        kept = int((now[:75] == clip).all(-1).cumprod(0).sum())  # up to the end of a stride
        assert kept >= 60
        # it runs as fast as it did, at every moment, and no frame leaps
        was, its = (speed(encoding.positions(c), encoding.fps) for c in (clip[-40:], now[kept:]))
        assert float(its.unfold(0, 20, 1).mean(-1).min()) > 0.9 * float(was.mean())
        steps = lambda c: normalizer(c).diff(dim=0)[:, :-2].norm(dim=-1)  # but for contacts
        assert float(steps(now[60:]).max()) < 1.3 * float(steps(clip).max())
        assert set(now[:, encoding.slices["contacts"]].flatten().tolist()) <= {0.0, 1.0}


def test_a_stride_ends_as_it_begins(runs):
    clips, encoding, normalizer = runs
    values = torch.zeros(90, encoding.dim)
    phase = 2 * math.pi * torch.arange(90) / 20.0  # a stride of 20 frames
    values[:, normalizer.kept[:40]] = phase.sin()[:, None]
    clip = normalizer.inverse(values[:, normalizer.kept])
    found = strides(clip, normalizer, 30.0)
    assert found and all(b - a == 20 for a, b in found)
    still = torch.randn(90, encoding.dim, generator=torch.Generator().manual_seed(0))
    apart = strides(normalizer.inverse(4 * still[:, normalizer.kept]), normalizer, 30.0)
    assert not apart, f"noise is alike within {ALIKE}"
    for frames in range(1, 7):
        assert strides(clip[:frames], normalizer, 30.0) == []


def test_a_run_that_is_long_or_has_no_stride_stays(runs):
    clips, encoding, normalizer = runs
    run = max(clips, key=lambda clip: last_speed(clip, encoding))
    brief = run[:12]
    assert run_on([run], encoding, normalizer, len(run))[0] is run
    assert run_on([brief], encoding, normalizer, 60)[0] is brief
    once, again = (run_on([run[:75]], encoding, normalizer, 150, seed=4)[0] for _ in "ab")
    assert once.equal(again)


def test_frames_of_a_run_are_told_by_the_half_second_before(runs):
    _, encoding, _ = runs
    clip = torch.zeros(90, encoding.dim)
    clip[:, 1] = torch.cat([torch.full((30,), 1.0), torch.full((30,), 3.0), torch.zeros(30)]) / 30
    # the mean of 15 frames passes 2 m/s with the eighth fast one, and falls below it likewise
    assert running(clip, encoding).nonzero()[:, 0].tolist() == list(range(37, 65))
    assert running(clip[30:31], encoding).tolist() == [True]


def test_the_preset_says_so(smoke):
    with pytest.raises(TrainingError, match="runs 1"):
        smoke(runs=1.0)
    with pytest.raises(TrainingError, match="run_on is -1"):
        smoke(run_on=-1)
    data = prepare("gaits")
    preset = smoke(run_on=300, runs=0.5, batch=8, frames=30)
    drawn = preset.windows(data, "train").draw(8, torch.Generator().manual_seed(0))
    fast = drawn[..., :2].norm(dim=-1).mean(-1) * 30 >= 2
    assert int(fast.sum()) >= 4
    assert preset.windows(data, "val").rows.equal(smoke(frames=30).windows(data, "val").rows)
