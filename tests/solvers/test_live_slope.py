"""Root and feet of short windows in numpy, and the slope written out, against the encoding's and torch's."""

import pytest
import torch
from tiny_lstm import tiny_clips

from motionlab.encodings import JointAngles
from motionlab.feet.contacts import foot_points
from motionlab.solvers.live_slope import ROWS, points_with_slope


@pytest.fixture(scope="module")
def world():
    """An encoding, features (2, 6, dim) of bodies in any pose, and where they stand."""
    clips = tiny_clips("walk_1.2", "walk_0.8_turn_left_0.5")
    encoding = JointAngles(clips[0].skeleton, clips[0].fps, contacts=True)
    features = torch.stack([encoding.encode(clip)[8:14] for clip in clips])
    chance = torch.Generator().manual_seed(0)
    features[..., 4:] += 0.5 * torch.randn(features[..., 4:].shape, generator=chance)
    features[0, 2, 6:] = 0  # joints at rest, where a sine over its angle is no number
    features[1, 3, 4:] = 1e-3
    return encoding, features, torch.tensor([[1.0, 2.0, 0.5], [0.0, -1.0, 3.0]])


def test_points_and_slopes_are_those_of_torch(world):
    encoding, features, place = world
    seen = sorted({0, *foot_points(encoding.skeleton)})
    weights = torch.randn(2, 6, len(seen), 3, generator=torch.Generator().manual_seed(1))
    found = []
    for way in (
        lambda rows: encoding.positions(rows, place, points=seen),
        lambda rows: points_with_slope(encoding, rows, place, frozenset(seen)),
    ):
        rows = features.clone().requires_grad_()
        points = way(rows)[:, :, seen]
        found.append((points, *torch.autograd.grad((points * weights).sum(), rows)))
    for theirs, ours in zip(*found, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-5, atol=2e-5)
    assert found[0][1].abs().amax((0, 1)).count_nonzero() > 20  # it says something of many channels


def test_what_is_not_calculated_here_is_left_to_others(world):
    encoding, features, place = world
    feet = frozenset(foot_points(encoding.skeleton))
    assert points_with_slope(encoding, features, place, feet).isnan().any()  # of a hand, nothing
    assert points_with_slope(encoding, features, place, None) is None
    assert points_with_slope(encoding, features, place, frozenset({3})) is None
    assert points_with_slope(encoding, features.double(), place, feet) is None
    many = features.repeat(1 + ROWS // 12, 1, 1)
    assert points_with_slope(encoding, many, place.repeat(len(many) // 2, 1), feet) is None
    euler = JointAngles(encoding.skeleton, encoding.fps, rotation="euler")
    assert points_with_slope(euler, features[..., : euler.dim], place, feet) is None
