"""Motion change of motions whose speed is known."""

import pytest
import torch

from motionlab.errors import MetricError
from motionlab.metrics.change import feature_change, motion_change


def gliding(speed, fps, points=9, seconds=2):
    """All points along x at the same speed."""
    time = torch.arange(int(seconds * fps), dtype=torch.float64) / fps
    way = torch.stack([speed * time, 0 * time, 0 * time], -1)
    return way[:, None] + torch.randn(points, 3, dtype=torch.float64)


@pytest.mark.parametrize("fps", [30, 60, 120])
def test_a_gliding_body(fps):
    change = motion_change(gliding(1.2, fps), fps)
    assert change.shape == (2 * fps - 1,)
    torch.testing.assert_close(change, torch.full_like(change, 3 * 1.2))  # root of 9 points
    per_frame = motion_change(gliding(1.2, fps), fps, per_frame=True)
    torch.testing.assert_close(per_frame, change / fps)


def test_a_freeze_is_seen_when_it_happens():
    points = gliding(1.0, 30)
    points[20:40] = points[20]
    change = motion_change(points[None].repeat(3, 1, 1, 1), 30)
    assert change.shape == (3, 59)
    assert (change[:, 20:39] == 0).all() and (change[:, :20] > 1).all()


def test_of_features():
    features = torch.tensor([[0.0, 0.0], [3.0, 4.0], [3.0, 4.0]])
    assert feature_change(features, 10).tolist() == [50, 0]
    assert feature_change(features, 10, per_frame=True).tolist() == [5, 0]


@pytest.mark.parametrize(
    ("positions", "fps", "message"),
    [
        (torch.zeros(1, 5, 3), 30, "has 1 frame; this needs at least 2"),
        (torch.zeros(5, 3), 30, "(..., frames, points, 3)"),
        (torch.zeros(4, 5, 3), 0, "fps is 0"),
        (torch.full((4, 5, 3), float("nan")), 30, "NaN"),
    ],
    ids=["short", "flat", "rate", "nan"],
)
def test_bad_input(positions, fps, message):
    with pytest.raises(MetricError) as error:
        motion_change(positions, fps)
    assert message in str(error.value)
