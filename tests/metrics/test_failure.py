"""Freeze and divergence: found where they were planted, nowhere else, at any rate and scale."""

import math

import numpy as np
import pytest
import torch
from planted_failures import ENDS, KINDS, pause, plant, slowed
from scipy.stats import binomtest

from motionlab import MotionLabError, Skeleton
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.io.bvh import parse_bvh
from motionlab.metrics import (
    Limits,
    frechet_distance,
    pose_extent,
    repetition,
    stagnations,
    survival,
    time_to_divergence,
    time_to_freeze,
)

SKELETON = Skeleton.canonical()
FPS = 30.0


def walk(seconds=6.0, speed=1.3, fps=FPS, seed=0):
    return gaits.make(seconds=seconds, speed=speed, fps=fps, seed=seed).positions()


@pytest.fixture(scope="module")
def limits():
    return Limits.fit([walk(speed=s) for s in (0.8, 1.3, 3.0)], fps=FPS, skeleton=SKELETON)


@pytest.fixture(scope="module")
def captured(real_clips):
    """Real clips, each with limits from the others of its source: styles of walks, and dances."""
    found = []
    for source in ("bandai-locomotion", "aclstm-cmu"):
        motions = [
            parse_bvh(data, path, units=0.01, tpose_first=True)
            for path, data in real_clips[source].items()
        ]
        motions = [m[7:].resample(30) for m in motions]
        clips = [m.positions()[:600] for m in motions]
        for i, clip in enumerate(clips):
            others = clips[:i] + clips[i + 1 :]
            skeleton = motions[0].skeleton
            found.append((clip, Limits.fit(others, fps=30, skeleton=skeleton)))
    return found


# -- freezes ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_planted_freeze_is_found(limits, kind):
    for at in (1.0, 2.5, 4.0):
        broken = plant(walk(), kind, at, FPS)
        assert float(time_to_freeze(broken, fps=FPS, limits=limits)) == pytest.approx(at, abs=0.15)
        assert math.isinf(time_to_divergence(broken, fps=FPS, limits=limits))


def test_intact_motion_does_not_freeze(limits):
    for speed in (0.7, 1.6, 4.0):
        assert math.isinf(time_to_freeze(walk(speed=speed), fps=FPS, limits=limits))


def test_slow_motion_is_no_freeze(limits):
    assert math.isinf(time_to_freeze(slowed(walk(), 0.3), fps=FPS, limits=limits))
    assert stagnations(slowed(walk(), 0.3), fps=FPS, limits=limits) == []


def test_a_pause_is_a_stagnation_and_no_freeze(limits):
    paused = pause(walk(), at=2.0, seconds=1.0, fps=FPS)
    assert math.isinf(time_to_freeze(paused, fps=FPS, limits=limits))
    [(start, end)] = stagnations(paused, fps=FPS, limits=limits)
    assert start == pytest.approx(2.0, abs=0.15) and end == pytest.approx(3.0, abs=0.15)


def test_a_stop_just_before_the_end_is_undecided(limits):
    assert limits.patience == 1.0  # nothing in the walks stands still
    for seconds, frozen in ((0.8, False), (1.2, True)):
        broken = plant(walk(), "freeze", 2.0, FPS, seconds)
        assert math.isfinite(time_to_freeze(broken, fps=FPS, limits=limits)) == frozen


def test_data_that_rests_teaches_patience():
    resting = plant(walk(), "freeze", 2.0, FPS, seconds=3.0)
    limits = Limits.fit([walk(), resting], fps=FPS, skeleton=SKELETON)
    assert limits.patience == pytest.approx(6.0, abs=0.4)
    assert math.isinf(time_to_freeze(resting, fps=FPS, limits=limits))
    for_good = plant(walk(), "freeze", 2.0, FPS, seconds=8.0)
    assert float(time_to_freeze(for_good, fps=FPS, limits=limits)) == pytest.approx(2.0, abs=0.15)


def test_slow_decay_freezes_when_little_is_left(limits):
    clip, rest = walk(8.0), walk(8.0)[60]
    fade = torch.exp(-torch.arange(len(clip) - 60) / FPS / 0.3)[:, None, None]
    clip[60:] = rest + fade * (clip[60:] - clip[60:, :1] + rest[:1] - rest)
    assert 2.3 < float(time_to_freeze(clip, fps=FPS, limits=limits)) < 3.5


def test_extent_of_a_swinging_arm_is_known():
    clip = SKELETON_REST.repeat(61, 1, 1).double()
    phase = 2 * math.pi * torch.arange(61) / 15  # one period in half a second
    clip[:, SKELETON.index("left_hand"), 2] += 0.3 * torch.sin(phase)
    extent = pose_extent(clip, fps=30, skeleton=SKELETON)
    # variance of a sine of amplitude a is a² / 2, times 15/16 for the frame that closes the window
    expected = 0.3 * math.sqrt(0.5 * 15 / 16 / SKELETON.points)
    torch.testing.assert_close(
        extent[:40:15], torch.full((3,), expected).double(), rtol=0.01, atol=0
    )


# -- divergence ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ENDS)
def test_planted_divergence_is_found(limits, kind):
    within = dict(zip(ENDS, (0, 0.3, 0.15, 0.8, 1.5), strict=True))[kind]
    broken = plant(walk(), kind, 2.0, FPS)
    found = float(time_to_divergence(broken, fps=FPS, limits=limits))
    assert 2.0 <= found <= 2.0 + within
    assert math.isinf(time_to_divergence(walk(), fps=FPS, limits=limits))


def test_one_long_bone_is_divergence(limits):
    clip = walk()
    clip[75:, SKELETON.index("left_hand"), 0] += 0.4
    assert float(time_to_divergence(clip, fps=FPS, limits=limits)) == 2.5


@pytest.mark.parametrize(("seconds", "found"), [(0.5, math.inf), (1.5, 2.0)])
def test_a_bone_may_stretch_for_less_than_it_must_last(limits, seconds, found):
    clip, begin = walk().clone(), round(2.0 * FPS)
    clip[begin : begin + round(seconds * FPS), 3] += 2.0
    assert float(time_to_divergence(clip, limits, FPS)) == 2.0
    assert float(time_to_divergence(clip, limits, FPS, lasting=1.0)) == found
    clip[-1] = math.nan  # which is for good
    last = min(found, (len(clip) - 1) / FPS)
    assert float(time_to_divergence(clip, limits, FPS, lasting=1.0)) == pytest.approx(last)


@pytest.mark.parametrize("lasting", [-1.0, math.inf, math.nan])
def test_a_time_to_last_that_makes_no_sense(limits, lasting):
    with pytest.raises(MetricError, match="lasting"):
        time_to_divergence(walk(), limits, FPS, lasting)


def test_infinite_values_are_divergence_not_freeze(limits):
    clip = plant(walk(), "nan", 2.0, FPS)
    clip[70:] = float("inf")
    assert float(time_to_divergence(clip, fps=FPS, limits=limits)) == 2.0
    assert math.isinf(time_to_freeze(clip, fps=FPS, limits=limits))


# -- real motion --------------------------------------------------------------------------------


def test_real_clips_raise_no_alarm_and_planted_failures_do(captured):
    for clip, limits in captured:
        assert math.isinf(time_to_divergence(clip, fps=30, limits=limits))
        at = 1.0
        for kind in KINDS:
            broken = plant(clip, kind, at, 30, seconds=limits.patience + 2)
            assert float(time_to_freeze(broken, fps=30, limits=limits)) <= at + 0.1
        for kind in ENDS[:3]:
            broken = plant(clip, kind, at, 30)
            found = float(time_to_divergence(broken, fps=30, limits=limits))
            assert at <= found <= at + 0.6
    alarms = [bool(time_to_freeze(clip, fps=30, limits=limits) < 1e9) for clip, limits in captured]
    assert not any(alarms)


# -- rates, scales, batches ---------------------------------------------------------------------


def test_rests_are_timed_alike_at_twice_the_rate_and_at_any_scale(limits):
    scaled = Limits.fit([100 * walk(speed=s) for s in (0.8, 1.3, 3.0)], SKELETON, FPS)
    rests = [
        stagnations(scale * pause(walk(fps=fps), 2.0, 1.0, fps), its, fps)
        for fps, scale, its in ((30, 1, limits), (60, 1, limits), (30, 100, scaled))
    ]
    assert [len(some) for some in rests] == [1, 1, 1]
    assert rests[1][0] == pytest.approx(rests[0][0], abs=0.05)
    assert rests[2] == rests[0]


def test_twice_the_frame_rate_changes_little(limits):
    for kind, detector in (("freeze", time_to_freeze), ("explosion", time_to_divergence)):
        times = [
            float(detector(plant(walk(fps=fps), kind, 2.0, fps), fps=fps, limits=limits))
            for fps in (30.0, 60.0)
        ]
        assert times[0] == pytest.approx(times[1], abs=0.05)
    clips = [[walk(fps=fps, speed=s) for s in (0.8, 3.0)] for fps in (30.0, 60.0)]
    a, b = (Limits.fit(c, fps=f, skeleton=SKELETON) for c, f in zip(clips, (30, 60), strict=True))
    assert a.still == pytest.approx(b.still, rel=0.02)
    assert a.speed == pytest.approx(b.speed, rel=0.02)
    assert a.patience == b.patience


def test_scale_does_not_matter(limits):
    scaled = Limits.fit([100 * walk(speed=s) for s in (0.8, 1.3, 3.0)], fps=FPS, skeleton=SKELETON)
    assert scaled.still == pytest.approx(100 * limits.still, rel=1e-4)
    for kind, detector in (("freeze", time_to_freeze), ("explosion", time_to_divergence)):
        broken = plant(walk(), kind, 2.0, FPS)
        assert detector(100 * broken, fps=FPS, limits=scaled) == detector(
            broken, fps=FPS, limits=limits
        )
    extent = pose_extent(walk(), fps=FPS, skeleton=SKELETON)
    larger = pose_extent(100 * walk(), fps=FPS, skeleton=SKELETON)
    torch.testing.assert_close(larger, 100 * extent, rtol=1e-5, atol=0)


def test_batch_equals_loop(limits):
    kinds = ("freeze", "nan", "explosion", "tremble")
    batch = torch.stack([plant(walk(), kind, 2.0, FPS) for kind in kinds]).unflatten(0, (2, 2))
    for detector in (time_to_freeze, time_to_divergence):
        together = detector(batch, fps=FPS, limits=limits)
        single = [detector(clip, fps=FPS, limits=limits) for clip in batch.flatten(0, 1)]
        assert together.shape == (2, 2)
        assert torch.equal(together, torch.stack(single).reshape(2, 2))


def test_bad_input_is_named(limits):
    with pytest.raises(MetricError, match="16 points"):
        time_to_freeze(walk()[:, :16], fps=FPS, limits=limits)
    with pytest.raises(MetricError, match="from joints, or both from all points"):
        time_to_freeze(walk()[:, :21], fps=FPS, limits=limits)
    with pytest.raises(MetricError, match="frames"):
        time_to_freeze(walk()[:5], fps=FPS, limits=limits)
    with pytest.raises(MetricError, match="one motion"):
        stagnations(walk()[None], fps=FPS, limits=limits)
    with pytest.raises(MotionLabError, match="fps"):
        time_to_divergence(walk(), fps=0, limits=limits)
    with pytest.raises(MetricError, match="0.5 s or longer"):
        Limits.fit([walk()[:4]], fps=FPS, skeleton=SKELETON)
    with pytest.raises(MetricError, match="NaN"):
        Limits.fit([plant(walk(), "nan", 1, FPS)], fps=FPS, skeleton=SKELETON)
    with pytest.raises(MetricError, match="some clips hold joints"):
        Limits.fit([walk(), walk()[:, :21]], SKELETON, FPS)
    for detector in (time_to_freeze, time_to_divergence, stagnations):
        with pytest.raises(MetricError, match="limits is None; make them"):
            detector(walk(), None, FPS)
        with pytest.raises(MetricError, match="positions must be an array"):
            detector("walk", limits, FPS)


def test_positions_of_a_network_that_still_remembers_gradients(limits):
    """Their numbers can't be differentiated, and asking for them is no error (nor a warning)."""
    clip = walk().requires_grad_()
    assert Limits.fit([clip], SKELETON, FPS).still == pytest.approx(
        Limits.fit([walk()], SKELETON, FPS).still
    )
    assert repetition(clip, SKELETON, FPS) == repetition(walk(), SKELETON, FPS)
    assert frechet_distance([clip] * 4, [clip] * 4, SKELETON, FPS) == pytest.approx(0, abs=1e-6)
    assert math.isinf(time_to_freeze(clip, limits, FPS))


def test_whole_numbers_are_measured_too():
    """Motion in whole millimetres."""
    clip = (1000 * walk()).long()
    limits = Limits.fit([clip], SKELETON, FPS)
    assert math.isinf(time_to_divergence(clip, limits, FPS))
    assert float(time_to_divergence(plant(clip, "speed", 2.0, FPS).long() * 1000, limits, FPS)) < 3


# -- survival -----------------------------------------------------------------------------------


def test_survival_is_the_share_alive_where_none_is_censored_early():
    times = np.array([3.0, 1.0, np.inf, 3.0, 7.0, np.inf])
    curve = survival(times, horizon=10)
    assert curve.times.tolist() == [0, 1, 3, 7, 10]
    for time, share, low, high in zip(*curve, strict=True):
        alive = int((times > time).sum())
        assert share == pytest.approx(alive / 6)
        interval = binomtest(alive, 6).proportion_ci(method="wilson")
        assert (low, high) == pytest.approx((interval.low, interval.high), abs=1e-6)


def test_survival_with_censoring_is_kaplan_meier():
    # by hand: 5 watched; one dies at 1 (4/5); one leaves at 2; one of 3 dies at 4 (2/3 of it)
    curve = survival([1.0, np.inf, 4.0, np.inf, 8.0], horizon=[9, 2, 9, 5, 9])
    share = dict(zip(curve.times.tolist(), curve.share.tolist(), strict=True))
    expected = {0: 1, 1: 4 / 5, 2: 4 / 5, 4: 8 / 15, 5: 8 / 15, 8: 0}
    assert share == pytest.approx(expected)
    assert (curve.low <= curve.share).all() and (curve.share <= curve.high).all()


def test_survival_of_the_immortal_still_has_a_band():
    curve = survival([np.inf] * 12, horizon=300)
    assert curve.times.tolist() == [0, 300] and curve.share.tolist() == [1, 1]
    assert curve.low[-1] == pytest.approx(binomtest(12, 12).proportion_ci(method="wilson").low)


def test_survival_asks_for_times_and_horizon():
    for times, horizon in (([], 1), ([np.nan], 1), ([-1.0], 1), ([1.0], 0), ([1.0], [1, 2]),
                           (["late"], 1), ([1.0], "ten")):  # fmt: skip
        with pytest.raises(MetricError):
            survival(times, horizon)


SKELETON_REST = gaits.make(seconds=0.1, speed=0).positions()[0]


def test_one_pause_that_twitches_is_one_stagnation(limits):
    """Windows before and after a twitch overlap; the body stood from the first to the last."""
    clip = walk().clone()
    clip[30:75] = clip[30]
    twitch = clip.clone()
    twitch[52, 5] += 0.12  # one point, one frame
    whole, found = (stagnations(c, limits, FPS) for c in (clip, twitch))
    assert len(whole) == 1 and len(found) in (1, 2)
    assert all(b < c for (_, b), (c, _) in zip(found, found[1:], strict=False))
