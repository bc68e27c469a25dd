"""Acceleration and jerk of curves whose derivatives are known."""

import pytest
import torch

from motionlab.errors import MetricError
from motionlab.metrics.smoothness import acceleration, jerk


def along(curve, fps, seconds=2.0):
    """Two points: one on curve(time) along (0.6, 0, 0.8), one at rest; (frames, 2, 3)."""
    time = torch.arange(int(seconds * fps) + 1, dtype=torch.float64) / fps
    moving = curve(time)[:, None] * torch.tensor([0.6, 0, 0.8], dtype=torch.float64)
    return torch.stack([moving, torch.zeros_like(moving)], 1)


@pytest.mark.parametrize("fps", [24, 30, 45, 60, 100, 120])
def test_falling_and_a_cubic(fps):
    falling = along(lambda t: 9.81 / 2 * t**2, fps)
    torch.testing.assert_close(
        acceleration(falling, fps, per_point=True),
        torch.tensor([9.81, 0]).double(),
        atol=1e-8,
        rtol=1e-6,
    )
    assert acceleration(falling, fps).item() == pytest.approx(9.81 / 2)  # the mean of both points
    assert jerk(falling, fps).item() == pytest.approx(0, abs=1e-6)
    cubic = along(lambda t: 7 * t**3, fps)
    assert jerk(cubic, fps, per_point=True)[0].item() == pytest.approx(42)


def test_an_oscillation_within_two_percent_at_every_rate():
    """x = sin(wt) at 1 Hz: mean |x''| is 2/pi w², mean |x'''| 2/pi w³."""
    for fps in (30, 60, 120):
        swing = along(lambda t: torch.sin(2 * torch.pi * t), fps, seconds=20)
        for order, metric in ((2, acceleration), (3, jerk)):
            expected = (2 * torch.pi) ** order * 2 / torch.pi
            assert metric(swing, fps, per_point=True)[0].item() == pytest.approx(expected, rel=0.02)


def test_trembling_is_jerky():
    torch.manual_seed(0)
    smooth = along(lambda t: torch.sin(t), 30)
    trembling = smooth + 0.005 * torch.randn_like(smooth)
    assert jerk(trembling, 30) > 50 * jerk(smooth, 30)


def test_a_knock_counts_alike_at_every_rate():
    """Speed jumps by 2 m/s twice a second or so, anywhere between frames: one frame's difference would grow with the rate."""
    found = [
        [
            metric(along(lambda t: (t % 0.9731 - 0.4866).abs(), fps, 60), fps).item()
            for metric in (acceleration, jerk)
        ]
        for fps in (30, 60, 120)
    ]
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=0.05)


def test_batches_and_step():
    points = torch.randn(2, 4, 30, 5, 3)
    assert jerk(points, 30).shape == (2, 4) and jerk(points, 30, per_point=True).shape == (2, 4, 5)
    twice = acceleration(points[..., ::2, :, :], 15)
    even_and_odd = acceleration(points, 30, step=1 / 15)
    assert even_and_odd.mean().item() == pytest.approx(twice.mean().item(), rel=0.2)


@pytest.mark.parametrize(
    ("positions", "options", "message"),
    [
        (torch.zeros(3, 5, 3), {}, "has 3 frames; this needs at least 4"),
        (torch.zeros(6, 5, 3), {"fps": 60}, "at least 7"),
        (torch.zeros(9, 5, 3), {"step": 0}, "step is 0"),
        (torch.zeros(9, 5, 2), {}, "(9, 5, 2)"),
        (torch.full((9, 5, 3), float("nan")), {}, "NaN"),
    ],
    ids=["short", "short at 60 fps", "step", "flat", "nan"],
)
def test_bad_input(positions, options, message):
    with pytest.raises(MetricError) as error:
        jerk(positions, **({"fps": 30} | options))
    assert message in str(error.value)
