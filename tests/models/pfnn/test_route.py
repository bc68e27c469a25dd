"""Lines on the ground by their length: where, which way, and what is nearest."""

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from motionlab.errors import ModelError
from motionlab.models.pfnn.route import Routes, upright

CORNER = torch.tensor([[0.0, 0.0], [0.0, 2.0], [3.0, 2.0]])


def eight(radius: float = 1.0) -> torch.Tensor:
    """A figure eight that crosses itself in the origin."""
    a = torch.linspace(0, 2 * math.pi, 500, dtype=torch.float64)
    return radius * torch.stack([(2 * a).sin(), 2 * a.sin()], dim=-1)


def test_a_line_by_its_length():
    routes = Routes([CORNER], beyond=1.0)
    places, ways = routes.at(torch.tensor([[0.0, 0.505, 3.0, 5.0, 5.75]]))
    wanted = [[0, 0], [0, 0.505], [1, 2], [3, 2], [3.75, 2]]  # the last one is after its end
    assert torch.allclose(places[0, :, [0, 2]], torch.tensor(wanted), atol=1e-5)
    assert torch.allclose(
        ways[0, :, [0, 2]], torch.tensor([[0.0, 1], [0, 1], [1, 0], [1, 0], [1, 0]]), atol=1e-4
    )
    assert torch.equal(places[..., 1], torch.zeros(1, 5))
    assert routes.lengths.tolist() == pytest.approx([5.0])


@given(st.floats(0.0, 5.0), st.floats(-0.15, 0.15))
def test_what_lies_on_it_is_nearest_to_itself(along, off):
    routes, where = Routes([CORNER], beyond=1.0), torch.tensor([along])
    place = routes.at(where[:, None])[0][:, 0]
    found = routes.nearest(place, (where + off).clamp(min=0))
    assert float(found) == pytest.approx(along, abs=2e-3)


def test_who_crosses_the_own_way_goes_on_along_it():
    line = eight()
    routes, half = Routes([line], 1.0), float(line.diff(dim=0).norm(dim=-1).sum()) / 2
    crossing = torch.zeros(1, 3)
    assert float(routes.nearest(crossing, torch.tensor([0.1]))) == pytest.approx(0.0, abs=0.01)
    assert float(routes.nearest(crossing, torch.tensor([half - 0.1]))) == pytest.approx(
        half, abs=0.01
    )


def test_lines_of_several_lengths_keep_apart():
    short, long = torch.tensor([[0.0, 0], [1, 0]]), torch.tensor([[5.0, 5], [5, 25]])
    routes = Routes([short, long], beyond=0.5)
    places, _ = routes.at(torch.tensor([[1.5], [20.0]]))
    assert torch.allclose(places[:, 0, [0, 2]], torch.tensor([[1.5, 0], [5, 25]]), atol=1e-4)


def test_a_point_given_twice_is_one():
    doubled = CORNER.repeat_interleave(3, dim=0)
    some = torch.tensor([[0.7, 2.6]])
    for one, other in zip(
        Routes([CORNER], 1.0).at(some), Routes([doubled], 1.0).at(some), strict=True
    ):
        assert torch.equal(one, other)


@pytest.mark.parametrize(
    "path, said",
    [
        ([[0.0, 0.0]], "two different points"),
        ([[1.0, 1.0]] * 4, "two different points"),
        (torch.zeros(0, 2), "two different points"),
        ([[0.0, 0.0], [float("nan"), 1.0]], "Point 1 of a path is NaN"),
        ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], r"shape \(2, 3\); it must be \(n, 2\)"),
        ([[0.0, 0.0], [0.0, 3000.0]], "3000 m long, above 2000 m; cut it"),
        ("a line", "array of numbers"),
    ],
)
def test_what_is_no_path(path, said):
    with pytest.raises(ModelError, match=said):
        Routes([path], 1.0)


def test_flat_places_lie_on_the_ground():
    assert upright(torch.tensor([[1.0, 2.0]])).tolist() == [[1.0, 0.0, 2.0]]
