"""Failures planted in gaits are found, whole gaits are not called failures."""

import math

import pytest
import torch

from experiments.common import rollouts
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles

FPS, SECONDS = 30, 8


@pytest.fixture(scope="module")
def walks():
    make = lambda speed: gaits.make(seconds=SECONDS, speed=speed, fps=FPS, seed=1)
    return [make(speed) for speed in (0.9, 1.2, 1.6, 3.0)]


@pytest.fixture(scope="module")
def judge(walks):
    return rollouts.Judge.fit([w.positions() for w in walks], walks[0].skeleton, FPS)


def moved(points, height):
    """The second half at another height."""
    points = points.clone()
    points[len(points) // 2 :, :, 1] += height
    return points


def test_walks_and_runs_do_not_fail(walks, judge):
    for walk in walks:
        assert all(math.isinf(time) for time in judge.failures(walk.positions()).values())


@pytest.mark.parametrize("height", [0.08, -0.08, 0.3])
def test_off_the_floor(walks, judge, height):
    found = judge.failures(moved(walks[1].positions(), height))
    assert found["off floor"] == pytest.approx(SECONDS / 2, abs=0.7)
    assert math.isinf(found["frozen"])


def test_a_jump_is_not_off_the_floor(walks, judge):
    points = walks[1].positions().clone()
    points[60:80, :, 1] += 0.3
    assert math.isinf(judge.failures(points)["off floor"])


def test_freeze_and_divergence(walks, judge):
    points = walks[1].positions()
    middle = len(points) // 2
    frozen = torch.cat([points[:middle], points[middle - 1 : middle].expand(middle, -1, -1)])
    assert judge.failures(frozen)["frozen"] == pytest.approx(SECONDS / 2, abs=0.5)
    lost = points.clone()
    lost[middle:] *= 100
    assert judge.failures(lost)["diverged"] == pytest.approx(SECONDS / 2, abs=0.2)
    assert judge.failures(lost)["off floor"] == math.inf  # what comes after does not count


def test_features_that_are_no_numbers_diverge(walks, judge):
    encoding = JointAngles(walks[0].skeleton, fps=FPS)
    features = encoding.encode(walks[1])
    features[100, 7] = torch.nan
    points = rollouts.points_of(encoding, features)
    assert points[:100].isfinite().all() and points[100:].isnan().all()
    assert judge.failures(points)["diverged"] == pytest.approx(100 / FPS)


def test_batches_left_out_change_nothing_in_the_others(monkeypatch):
    class Chance(torch.nn.Module):
        """The start, and numbers from the generator."""

        def observe(self, features):
            return features[:, -1]

        def generate(self, n, start, *, generator, **sampling):
            noise = torch.randn(len(start), n, start.shape[1], generator=generator)
            return start[:, None] + noise

    monkeypatch.setattr(rollouts, "AT_ONCE", 30)
    begun = torch.randn(7, 5, 2)
    whole = dict(rollouts.sampled(Chance(), begun, 10, seed=3))
    assert [len(batch) for batch in whole.values()] == [3, 3, 1]
    rest = dict(rollouts.sampled(Chance(), begun, 10, seed=3, done=[1]))
    assert list(rest) == [0, 2] and torch.equal(rest[2], whole[2])
