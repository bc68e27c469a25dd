"""Loops: found where they were planted, not in walking; at any rate, scale and phase."""

import math

import pytest
import torch
from planted_failures import plant

from motionlab import Skeleton
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.io.bvh import parse_bvh
from motionlab.metrics import converged, loop, loop_tolerance, repetition

SKELETON = Skeleton.canonical()


def walk(seconds=8.0, noise=1.0, fps=30, seed=0, **options):
    return gaits.make(seconds=seconds, noise=noise, fps=fps, seed=seed, **options).positions()


def looped(clip, start, period, times, shift=0):
    """The clip up to frame `start`, then its next `period` frames again and again, from `shift`."""
    order = torch.arange(period * times) % period
    return torch.cat([clip[:start], clip[start + (order + shift) % period]])


@pytest.fixture(scope="module")
def captured(real_clips):
    found = []
    for source in ("bandai-locomotion", "accad", "aclstm-cmu"):
        motions = [
            parse_bvh(data, path, units=0.01, tpose_first=True)
            for path, data in real_clips[source].items()
        ]
        motions = [m[7:].resample(30) for m in motions]
        found += [(m.positions()[:450], m.skeleton) for m in motions if m.seconds > 3]
    return found


def test_planted_loop_is_found():
    clip = walk(12, seed=2)
    for period in (20, 37, 75):
        found = loop(looped(clip, 100, period, 7), fps=30, skeleton=SKELETON)
        assert found.period == pytest.approx(period / 30, abs=0.005)
        # a jump back breaks what was there before: the cycle is entered where it begins
        assert found.start == pytest.approx(100 / 30, abs=0.2)


def test_noise_far_below_strides_does_not_hide_a_loop():
    noise = 0.001 * torch.randn(300, 26, 3, generator=torch.Generator().manual_seed(0))
    broken = looped(walk(12), 90, 30, 7) + noise
    assert loop(broken, fps=30, skeleton=SKELETON).period == pytest.approx(1, abs=0.01)


def test_a_machine_walks_in_a_loop_and_a_person_does_not():
    """Its period is not a whole number of frames, and it is found to a thousandth of a second."""
    strike = gaits.make(seconds=8, noise=0, phase=0.0, fps=1000).contacts[:, 0].int().diff()
    stride = float((strike == 1).nonzero().diff(dim=0).double().mean()) / 1000
    found = loop(walk(noise=0), fps=30, skeleton=SKELETON)
    assert found.period == pytest.approx(stride, abs=0.002)
    assert found.start == pytest.approx(0, abs=0.1)
    assert math.isinf(loop(walk(noise=1), fps=30, skeleton=SKELETON).period)


def test_turning_in_circles_is_a_loop_too():
    assert loop(walk(noise=0, turn_rate=0.6), fps=30, skeleton=SKELETON).period < 1.2


def test_real_motion_is_in_no_loop_and_loops_planted_in_it_are_found(captured):
    for clip, skeleton in captured:
        assert math.isinf(loop(clip, fps=30, skeleton=skeleton).period)
        length = min(45, len(clip) - 31)
        broken = looped(clip, 30, length, 6)
        found = loop(broken, fps=30, skeleton=skeleton)
        assert found.period <= length / 30 + 0.01  # steps within may repeat faster


def test_tolerance_of_real_walks(captured):
    """Real strides differ by more than three times the default tolerance."""
    walks = [(clip, skeleton) for clip, skeleton in captured if skeleton.joints < 43]
    for _, skeleton in walks[:1]:
        clips = [c for c, s in walks if s.matches(skeleton)]
        tolerance = loop_tolerance(clips, fps=30, skeleton=skeleton)
        assert tolerance >= 0.03
        assert tolerance == pytest.approx(
            0.3 * min(float(repetition(c, fps=30, skeleton=skeleton)) for c in clips)
        )


def test_frozen_bodies_are_in_no_loop():
    for kind in ("freeze", "tremble"):
        broken = plant(walk(), kind, 2.0, 30)
        assert math.isinf(loop(broken, fps=30, skeleton=SKELETON).period)
        both = torch.stack([broken, plant(walk(), kind, 2.0, 30)])
        assert converged(both, fps=30, skeleton=SKELETON).tolist() == [0, 1]


def test_repetition_against_brute_force():
    from motionlab.metrics import heading_frame

    clip = walk(5.0, seed=4).double()
    pose = heading_frame(clip - clip[:, :1], SKELETON)[0]
    last, best = pose[-30:], math.inf
    for start in range(len(pose) - 30 - 13):
        for part in torch.linspace(0, 1, 21).tolist():
            lag = len(pose) - 30 - start - part
            if lag < 12:
                continue
            past = (1 - part) * pose[start : start + 30] + part * pose[start + 1 : start + 31]
            cycle = pose[-max(30, round(lag)) :]
            extent = (cycle - cycle.mean(0)).norm(dim=-1).square().mean().sqrt()
            best = min(best, float((last - past).norm(dim=-1).square().mean().sqrt() / extent))
    found = float(repetition(clip, fps=30, skeleton=SKELETON))
    assert found == pytest.approx(best, rel=0.01) and found <= best * 1.0001


def test_rollouts_on_one_cycle_are_one_group():
    one, other = walk(10, seed=5), walk(10, seed=6, speed=1.0)
    rollouts = [
        looped(one, 60, 35, 7),
        looped(other, 60, 40, 7),
        torch.cat([other[:60], looped(one, 60, 35, 7, shift=17)[60:]]),  # another way, same cycle
        walk(10.5, seed=7),
    ]
    batch = torch.stack([rollout[:300] for rollout in rollouts])
    assert converged(batch, fps=30, skeleton=SKELETON).tolist() == [0, 1, 0, 2]
    order = [3, 1, 0, 2]
    assert converged(batch[order], fps=30, skeleton=SKELETON).tolist() == [0, 1, 2, 2]


def test_rollouts_may_stand_and_face_anywhere():
    one = looped(walk(10, seed=5), 60, 35, 7)
    turn = torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    batch = torch.stack([one, one @ turn.T + torch.tensor([3.0, 0, -2])])
    assert converged(batch, fps=30, skeleton=SKELETON).tolist() == [0, 0]


def test_rate_and_scale_do_not_matter():
    for noise in (0, 1):
        coarse, fine = walk(noise=noise, fps=30), walk(noise=noise, fps=60)
        here = repetition(coarse, fps=30, skeleton=SKELETON)
        there = repetition(fine, fps=60, skeleton=SKELETON)
        torch.testing.assert_close(here, there, rtol=0, atol=0.01)
        scaled = repetition(100 * coarse, fps=30, skeleton=SKELETON)
        torch.testing.assert_close(here, scaled, rtol=1e-3, atol=0)
        a, b = (
            loop(clip, fps=fps, skeleton=SKELETON).period
            for clip, fps in ((coarse, 30), (fine, 60))
        )
        assert a == b or a == pytest.approx(b, abs=0.002)


def test_a_cycle_is_the_same_at_any_rate_and_scale():
    def rollouts(fps):
        one, other = (gaits.make(seconds=10, fps=fps, seed=s).positions() for s in (5, 6))
        start, period = 2 * fps, round(1.2 * fps)
        clips = (
            looped(one, start, period, 7),
            torch.cat([other[:start], looped(one, start, period, 7, shift=fps // 2)[start:]]),
            looped(other, start, period, 7),
        )
        return torch.stack(clips)

    for fps, scale in ((30, 1), (60, 1), (30, 100)):
        batch = scale * rollouts(fps)
        found = loop(batch[0], SKELETON, fps)
        assert found.period == pytest.approx(1.2, abs=0.01)
        assert found.start == pytest.approx(2, abs=0.2)
        assert converged(batch, SKELETON, fps).tolist() == [0, 0, 1]


def test_a_body_without_any_movement_repeats_nothing():
    """Not 0 / 0 either: all points in one place."""
    assert repetition(torch.zeros(60, 26, 3), SKELETON, 30) == math.inf


def test_batch_equals_loop():
    batch = torch.stack([walk(4, seed=seed) for seed in range(4)]).unflatten(0, (2, 2))
    together = repetition(batch, fps=30, skeleton=SKELETON)
    single = [repetition(clip, fps=30, skeleton=SKELETON) for clip in batch.flatten(0, 1)]
    assert torch.equal(together, torch.stack(single).reshape(2, 2))


def test_bad_input_is_named():
    for call in (loop, repetition):
        with pytest.raises(MetricError, match="frames"):
            call(walk(1.0), fps=30, skeleton=SKELETON)
        with pytest.raises(MetricError, match="NaN"):
            call(plant(walk(), "nan", 1, 30), fps=30, skeleton=SKELETON)
        with pytest.raises(MetricError, match="fps"):
            call(walk(), fps=-30, skeleton=SKELETON)
    with pytest.raises(MetricError, match="one motion"):
        loop(walk()[None], fps=30, skeleton=SKELETON)
    with pytest.raises(MetricError, match="tolerance"):
        loop(walk(), fps=30, skeleton=SKELETON, tolerance=0)
    with pytest.raises(MetricError, match="rollouts, frames"):
        converged(walk(), fps=30, skeleton=SKELETON)
    with pytest.raises(MetricError, match="longer real clips"):
        loop_tolerance([walk(1.0)], fps=30, skeleton=SKELETON)
