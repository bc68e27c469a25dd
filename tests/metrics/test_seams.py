"""Jumps at seams, planted and not."""

import pytest
import torch

from motionlab.errors import MetricError
from motionlab.metrics import seam_jumps


def waving(frames=120, points=5):
    """Points that go round in circles, each at the same pace."""
    time = torch.arange(frames, dtype=torch.float64) / 7
    angle = time[:, None] + torch.arange(points)
    return torch.stack([angle.cos(), angle.sin(), 0 * angle], -1)


def test_smooth_motion_has_no_seams():
    found = seam_jumps(waving(), 20)
    assert float(found.steps) == pytest.approx(1) and float(found.accelerations) == pytest.approx(1)


def test_a_planted_jump_is_counted_once_as_step_and_twice_as_acceleration():
    line = torch.zeros(60, 2, 3).double()
    line[..., 0] = torch.arange(60)[:, None]
    line[20:, :, 0] += 2  # at both seams a step of 3 and not of 1
    line[40:, :, 0] += 2
    jumps = seam_jumps(line, 20)
    assert float(jumps.steps) == pytest.approx(3) and float(jumps.accelerations) == torch.inf
    off = seam_jumps(line, 15)  # where there are none
    assert float(off.steps) < 1 and float(off.accelerations) == 0


def test_a_batch_is_a_loop():
    motion = torch.stack([waving(), waving()[:, [1, 0, 2, 3, 4]] ** 3])
    both = seam_jumps(motion, 12)
    for one, *together in zip(motion, *both, strict=True):
        torch.testing.assert_close(torch.stack(together), torch.stack([*seam_jumps(one, 12)]))


@pytest.mark.parametrize(
    ("positions", "window", "message"),
    [(waving(39), 20, "at least 40"), (waving(), 3, "4 frames"), (waving(), 5.0, "4 frames"),
     (waving()[..., :2], 20, "points, 3")],
)  # fmt: skip
def test_bad_input(positions, window, message):
    with pytest.raises(MetricError, match=message):
        seam_jumps(positions, window)
