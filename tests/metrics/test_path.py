"""Distance from curves that it is known for."""

from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab.errors import MetricError
from motionlab.metrics import path
from motionlab.metrics.path import root_path_error


def body(root):
    """Points whose first is the root, (..., frames, 2, 3); the other is anywhere."""
    root = torch.as_tensor(root, dtype=torch.float64)
    three = torch.stack([root[..., 0], torch.full_like(root[..., 0], 0.9), root[..., 1]], -1)
    return torch.stack([three, torch.full_like(three, 7.0)], -2)


def circle(radius, corners):
    angle = torch.linspace(0, 2 * torch.pi, corners, dtype=torch.float64)
    return radius * torch.stack([angle.sin(), angle.cos()], -1)


def test_beside_a_line():
    line = torch.tensor([[0.0, 0.0], [0.0, 10.0]])
    root = torch.stack([torch.tensor([0.03, -0.04, 0.0, 0.05]), torch.arange(4.0)], -1)
    error = root_path_error(body(root), line)
    assert error.mean_square.item() == pytest.approx((9 + 16 + 0 + 25) / 4)
    assert error.rms.item() == pytest.approx(12.5**0.5)


def test_ends_corners_and_a_corner_given_twice():
    curve = torch.tensor([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    root = [[-0.3, 0.4], [1.3, -0.4], [0.5, 0.1], [1.0, 2.0]]  # 50, 50, 10, 100 cm off
    error = root_path_error(body(root)[:, None], curve)
    assert error.rms.tolist() == pytest.approx([50, 50, 10, 100])


def test_a_circle_inside_a_circle():
    error = root_path_error(body(circle(1.98, 500)), circle(2, 2000))
    assert error.rms.item() == pytest.approx(2, abs=0.001)
    assert error.mean_square.item() == pytest.approx(4, abs=0.004)


def test_height_and_pace_do_not_count():
    on_it = body(circle(2, 50))
    on_it[:, 0, 1] += torch.arange(50)
    assert root_path_error(on_it, circle(2, 50)).rms.item() == pytest.approx(0, abs=1e-9)
    standing = on_it[:1].repeat(30, 1, 1)
    assert root_path_error(standing, circle(2, 50)).rms.item() == pytest.approx(0, abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_against_a_dense_sampling_of_the_curve(seed):
    rng = np.random.default_rng(seed)
    curve = rng.normal(size=(6, 2))
    root = rng.normal(size=(9, 2))
    dense = np.concatenate(
        [a + np.linspace(0, 1, 2000)[:, None] * (b - a) for a, b in pairwise(curve)]
    )
    nearest = np.linalg.norm(root[:, None] - dense, axis=-1).min(1)
    error = root_path_error(body(root), torch.tensor(curve))
    assert error.mean_square.item() == pytest.approx(1e4 * (nearest**2).mean(), rel=1e-3, abs=1)


def test_in_pieces_as_at_once(monkeypatch):
    root = torch.randn(3, 40, 2)
    whole = root_path_error(body(root), circle(1, 30))
    monkeypatch.setattr(path, "_AT_ONCE", 100)
    pieces = root_path_error(body(root), circle(1, 30))
    assert whole.rms.shape == (3,)
    torch.testing.assert_close(pieces.rms, whole.rms)


@pytest.mark.parametrize(
    ("positions", "curve", "message"),
    [
        (torch.zeros(5, 3), torch.zeros(4, 2), "positions has shape (5, 3)"),
        (torch.zeros(5, 1, 3), torch.zeros(1, 2), "at least two corners"),
        (torch.zeros(5, 1, 3), torch.zeros(4, 3), "x and z in metres"),
        (torch.zeros(5, 1, 3), torch.full((4, 2), float("nan")), "curve[0, 0] is NaN"),
        (torch.full((5, 1, 3), float("inf")), torch.zeros(4, 2), "positions[0, 0, 0]"),
    ],
    ids=["root alone", "one corner", "3D curve", "nan curve", "infinite"],
)
def test_bad_input(positions, curve, message):
    with pytest.raises(MetricError) as error:
        root_path_error(positions, curve)
    assert message in str(error.value)
