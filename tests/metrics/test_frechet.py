"""Fréchet distance: closed forms, invariances, what it sees."""

import numpy as np
import pytest
import torch
from scipy.linalg import sqrtm

from motionlab import MotionLabError, Skeleton
from motionlab.datasets import gaits
from motionlab.errors import MetricError
from motionlab.metrics import Frechet, effector_motion, frechet_distance, jackknife
from motionlab.metrics.frechet import Moments, gaussian_distance

SKELETON = Skeleton.canonical()
OPTIONS = dict(fps=30, skeleton=SKELETON)


def walks(seeds, fps=30, seconds=6.0, **options):
    return [gaits.make(seed=s, fps=fps, seconds=seconds, **options).positions() for s in seeds]


REAL = walks(range(4))
OTHERS = walks(range(10, 14))


def test_gaussians_in_closed_form():
    random = np.random.default_rng(0)
    a, b = (random.normal(size=(40, 6)) for _ in range(2))
    one, two = a.T @ a, b.T @ b
    mean, shift = random.normal(size=6), random.normal(size=6)
    expected = shift @ shift + np.trace(one + two - 2 * sqrtm(one @ two).real)
    tensors = map(torch.from_numpy, (mean, one, mean + shift, two))
    assert gaussian_distance(*tensors) == pytest.approx(expected, rel=1e-9)
    # one dimension: (m1 - m2)² + (s1 - s2)²
    numbers = (
        torch.tensor([0.0]),
        torch.tensor([[4.0]]),
        torch.tensor([3.0]),
        torch.tensor([[25.0]]),
    )
    assert gaussian_distance(*numbers) == pytest.approx(9 + 9)


def test_sampled_gaussians():
    """Moments of drawn windows come to the distance of what they were drawn from."""
    random = torch.Generator().manual_seed(0)
    draw = lambda scale, shift: torch.randn(20000, 3, generator=random).double() * scale + shift
    moments = [
        Moments(len(v), v.sum(0), v.mT @ v)
        for v in (draw(1, 0), draw(2, torch.tensor([3.0, 0, 0])))
    ]
    empty = torch.zeros(0)
    reference = Frechet(SKELETON, 1, 30, empty, empty, torch.zeros(5, 3), moments[0])
    assert reference.distance([moments[1]]) == pytest.approx(9 + 3, rel=0.03)


def test_the_same_motion_is_at_no_distance():
    assert frechet_distance(REAL, REAL, **OPTIONS) == pytest.approx(0, abs=1e-6)
    turned = [c @ torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]) + 5 for c in REAL]
    turned = [c - torch.tensor([0.0, 5, 0]) for c in turned]  # elsewhere, and facing elsewhere
    assert frechet_distance(turned, REAL, **OPTIONS) == pytest.approx(0, abs=1e-5)


def test_it_sees_what_it_should():
    floor = frechet_distance(OTHERS, REAL, **OPTIONS)
    faster = frechet_distance(walks(range(10, 14), speed=1.8), REAL, **OPTIONS)
    still = frechet_distance([c[:1].expand(180, -1, -1) for c in OTHERS], REAL, **OPTIONS)
    mild = [
        c + 0.02 * torch.randn(c.shape, generator=torch.Generator().manual_seed(0)) for c in OTHERS
    ]
    assert floor < 0.3 * faster
    assert faster < still
    assert floor < frechet_distance(mild, REAL, **OPTIONS)
    one_sample = frechet_distance([OTHERS[0]] * 4, REAL, **OPTIONS)  # no variety
    assert one_sample > floor


def test_rate_and_scale_do_not_matter():
    """Clips are brought to one rate: frames that are there in both are taken as they are."""
    fine = frechet_distance(
        walks(range(10, 14), fps=60), walks(range(4), fps=60), fps=60, skeleton=SKELETON
    )
    coarse = frechet_distance(OTHERS, REAL, **OPTIONS)
    assert fine == pytest.approx(coarse, rel=1e-4)
    other = frechet_distance(
        walks(range(10, 14), fps=45), walks(range(4), fps=45), fps=45, skeleton=SKELETON
    )
    assert other == pytest.approx(coarse, rel=0.15)
    scaled = frechet_distance([100 * c for c in OTHERS], [100 * c for c in REAL], **OPTIONS)
    assert scaled == pytest.approx(coarse, rel=1e-3)


def test_effectors_at_known_places():
    """A statue that slides forward at 2 m/s, facing +x."""
    rest = gaits.make(seconds=1, speed=0).positions()[:1]
    turn = torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # +z to +x
    slide = torch.arange(30)[:, None, None] / 30 * torch.tensor([2.0, 0, 0])
    motion = effector_motion(rest @ turn.T + slide, fps=30, skeleton=SKELETON)
    assert motion.shape == (30, 2, 15)
    torch.testing.assert_close(
        motion[:, 1].unflatten(-1, (5, 3)),
        torch.tensor([0, 0, 2.0]).expand(30, 5, 3),
        atol=1e-3,
        rtol=0,
    )
    places = motion[:, 0].unflatten(-1, (5, 3))
    head = rest[0, SKELETON.index("head")] - rest[0, 0] * torch.tensor([1.0, 0, 1])
    torch.testing.assert_close(places[0, 4], head, atol=0.02, rtol=0)
    assert (places[:, 0, 0] > 0.1).all() and (places[:, 1, 0] < -0.1).all()  # left hand, right hand
    torch.testing.assert_close(places[0], places[-1], atol=1e-4, rtol=0)


def test_an_interval_over_clips():
    reference = Frechet.fit(REAL, **OPTIONS)
    moments = [reference.moments(clip, fps=30) for clip in OTHERS]
    interval = jackknife(moments, reference.distance)
    assert interval.value == pytest.approx(frechet_distance(OTHERS, REAL, **OPTIONS), rel=1e-9)
    assert interval.low < interval.value < interval.high and interval.clips == 4


def test_bad_input_is_named():
    with pytest.raises(MetricError, match="more or longer clips"):
        frechet_distance(REAL, REAL[:2], **OPTIONS)
    with pytest.raises(MetricError, match="components"):
        frechet_distance(OTHERS[:1], REAL, **OPTIONS)
    with pytest.raises(MetricError, match="30"):
        frechet_distance([OTHERS[0][:20]], REAL, **OPTIONS)
    with pytest.raises(MetricError, match="empty"):
        frechet_distance([], REAL, **OPTIONS)
    with pytest.raises(MetricError, match="NaN"):
        frechet_distance([OTHERS[0] * float("nan")], REAL, **OPTIONS)
    with pytest.raises(MetricError, match="shape"):
        frechet_distance([OTHERS[0][None]], REAL, **OPTIONS)
    with pytest.raises(MetricError, match="empty"):
        Frechet.fit(REAL, SKELETON, 30).distance([])
    for positions, skeleton, fps, words in (
        (REAL[0], SKELETON, "30", "fps"),
        (REAL[0], None, 30, "skeleton is None"),
        (REAL[0][:1], SKELETON, 30, "at least 2"),
        (REAL[0][:, :7], SKELETON, 30, "7 points"),
    ):
        with pytest.raises(MetricError, match=words):
            effector_motion(positions, skeleton, fps)
    stick = Skeleton(tuple(f"joint {i}" for i in range(26)), (-1, *range(25)), torch.zeros(26, 3))
    with pytest.raises(MotionLabError, match="left_hand"):
        frechet_distance(OTHERS, REAL, fps=30, skeleton=stick)
