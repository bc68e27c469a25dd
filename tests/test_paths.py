"""Ways over the ground: lengths, nearest places, timetables, and what is no way."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab.errors import WayError
from motionlab.metrics import root_path_error
from motionlab.paths import CHANGE, SIDEWAYS, Curves, Path, Piece, flat, upright

SQUARE = [[0, 0], [3, 0], [3, 3], [0, 3], [0, 0]]


def circle(radius, turns=1.0, n=200):
    angle = np.linspace(0, 2 * math.pi * turns, n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)


def whole(path):
    """All of a path as a piece, twice over."""
    zero = torch.zeros(2, dtype=torch.float64)
    return Curves([path]).piece(zero, zero + path.length, torch.tensor([0, 0]))


def test_gentle_ways_are_left_as_they_are():
    found = Path.through(circle(1.5))
    assert found.length == pytest.approx(3 * math.pi, rel=1e-3)
    assert (found.places.norm(dim=1) - 1.5).abs().max() < 1e-3
    steps = found.places.diff(dim=0).norm(dim=1)
    assert steps.max() < 0.031 and steps.max() - steps.min() < 1e-3


def test_corners_are_rounded_as_people_do_and_the_rest_is_not():
    rounded, sharp = Path.through(SQUARE), Path.through(SQUARE, corner=0)
    assert sharp.length == pytest.approx(12) and 11 < rounded.length < 12
    away = root_path_error(rounded.places[:, None, [0, 0, 1]], rounded.drawn)
    assert 1 < float(away.rms) < 2
    corner = (rounded.places - torch.tensor([3.0, 0.0])).norm(dim=1).min()
    assert 0.1 < corner < 0.2
    middle = (rounded.places - torch.tensor([1.5, 0.0])).norm(dim=1).min()
    assert middle < 0.02


def test_a_spline_leads_through_its_places():
    places = torch.tensor([[0, 0], [1, 1], [2, 0], [3, 1], [3, 3]], dtype=torch.double)
    near = whole(Path.through(places, spline=True, corner=0)).nearest(places.expand(2, -1, -1))
    assert (near.places[0] - places).norm(dim=1).max() < 0.01
    assert (near.arcs[0].diff() > 0.5).all()


def test_who_walks_a_gentle_spline_is_on_the_line_that_was_drawn():
    path = Path.through([[0, 0], [0, 3], [3, 6], [3, 9]], spline=True)
    off = root_path_error(path.places[:, None, [0, 0, 1]], path.drawn)
    assert float(off.rms) < 0.1  # cm


@given(st.lists(st.tuples(*[st.floats(-4, 4)] * 2), min_size=1, max_size=5), st.floats(0.2, 3))
@settings(max_examples=25, deadline=None)
def test_nearest_is_no_farther_than_any_place(points, bend):
    x = np.linspace(0, 5, 60)
    path = Path.through(np.stack([x, np.sin(bend * x)], 1), corner=0)
    piece, points = whole(path), torch.tensor(points, dtype=torch.double).expand(2, -1, 2)
    near = piece.nearest(points)
    found = (near.places - points).norm(dim=-1)
    all_of_them = torch.cdist(points, piece.places).amin(-1)
    assert (found <= all_of_them + 1e-9).all() and (found >= all_of_them - 0.06).all()
    assert ((near.arcs >= -1e-9) & (near.arcs <= path.length + 1e-9)).all()
    at = Curves([path]).at(near.arcs, torch.tensor([0, 0]))
    assert (at - near.places).norm(dim=-1).max() < 0.02


def test_metres_behind_have_the_slope_of_the_way():
    piece = Piece(torch.tensor([[[0.0, 0.0], [0.0, 4.0]]]).double(), torch.tensor([[1.0, 5.0]]))
    point = torch.tensor([[[0.5, 2.0]]], dtype=torch.double, requires_grad=True)
    near = piece.nearest(point)
    assert near.arcs.item() == pytest.approx(3)
    (slope,) = torch.autograd.grad(near.arcs.sum(), point)
    torch.testing.assert_close(slope, torch.tensor([[[0.0, 1.0]]]).double())


def test_a_crossing_is_told_by_the_stretch():
    """At the middle of a figure eight one stretch leads one way and another the other."""
    angle = np.linspace(0, 2 * math.pi, 300)
    path = Path.through(np.stack([np.sin(2 * angle), 2 * np.sin(angle)], 1))
    first, last = torch.tensor([0.0, path.length / 2 - 1]), torch.tensor([1, path.length / 2 + 1])
    near = Curves([path]).piece(first, last, torch.tensor([0, 0])).nearest(torch.zeros(2, 1, 2))
    assert near.places.abs().max() < 0.05
    assert abs(near.arcs[0]) < 0.05 and near.arcs[1] == pytest.approx(path.length / 2, abs=0.05)


def test_paths_of_any_length_lie_side_by_side_and_go_on_straight():
    short, long = Path.through([[0, 0], [0, 1]]), Path.through([[1, 0], [1, 9]])
    both = Curves([short, long])
    found = both.at(torch.tensor([[-1.0, 0.5, 3], [-1, 0.5, 12]]), torch.tensor([0, 1]))
    expected = torch.tensor([[[0, -1], [0, 0.5], [0, 3]], [[1, -1], [1, 0.5], [1, 12]]]).double()
    torch.testing.assert_close(found, expected, atol=1e-6, rtol=0)


CORNERED = Path.through([[0, 0], [0, 2], [3, 2]], corner=0)


def test_ways_lead_from_corner_to_corner_and_on():
    curves, arcs = Curves([CORNERED], beyond=1.0), torch.tensor([[0.0, 0.5, 3, 5, 5.75]])
    which = torch.tensor([0])
    wanted = torch.tensor([[0, 0], [0, 0.5], [1, 2], [3, 2], [3.75, 2]]).double()
    torch.testing.assert_close(curves.at(arcs, which)[0], wanted, atol=0.01, rtol=0)
    wanted = torch.tensor([[0, 1], [0, 1], [1, 0], [1, 0], [1, 0]]).double()
    torch.testing.assert_close(curves.ways(arcs, which)[0], wanted, atol=1e-5, rtol=0)


@given(st.floats(0.0, 5.0), st.floats(-0.15, 0.15))
@settings(max_examples=40, deadline=None)
def test_who_is_on_a_way_is_found_there(along, off):
    curves, which = Curves([CORNERED], beyond=1.0), torch.tensor([0])
    arcs = torch.tensor([along], dtype=torch.double)
    place = curves.at(arcs[:, None], which)[:, 0]
    found = float(curves.onward(place, arcs + off, which))
    assert found == pytest.approx(along, abs=0.02)


def test_who_crosses_the_own_way_goes_on_along_it():
    angle = np.linspace(0, 2 * math.pi, 500)
    path = Path.through(np.stack([np.sin(2 * angle), 2 * np.sin(angle)], 1), corner=0)
    curves, half = Curves([path, path]), path.length / 2
    was = torch.tensor([0.1, half - 0.1], dtype=torch.double)
    found = curves.onward(torch.zeros(2, 2), was, torch.tensor([0, 1]))
    assert found.tolist() == pytest.approx([0, half], abs=0.01)


def test_flat_places_lie_on_the_ground():
    place = torch.tensor([1.0, 2.0])
    assert upright(place).tolist() == [1, 0, 2] and torch.equal(flat(upright(place)), place)


# -- timetables -----------------------------------------------------------------------------------


def test_a_straight_way_is_walked_at_its_speed():
    table = Path.through([[0, 0], [0, 6]]).timetable(1.2, 4.0, 30.0)
    assert len(table) == 151 and table[-1] == pytest.approx(6)
    torch.testing.assert_close(table.diff(), torch.full((150,), 0.04).double())


def test_bends_slow_down_and_braking_is_gentle():
    pace = 30 * Path.through(SQUARE).timetable(1.5, 4.0, 30.0).diff()[:-1]
    assert pace.max() == pytest.approx(1.5) and 0.7 < pace.min() < 1.1
    assert 30 * pace.diff().abs().max() < 1.2 * CHANGE
    wide = 30 * Path.through(circle(5)).timetable(3.0, 4.0, 30.0).diff()[:-1]
    assert wide.min() == pytest.approx(3.0) and 3**2 / 5 < SIDEWAYS


def test_times_are_kept_waits_too_but_not_at_any_speed():
    path = Path.through([[0, 0], [2, 0], [2, 0], [4, 0]], times=[1, 3, 4, 6])
    table = path.timetable(9, 4.0, 30.0)
    assert len(table) == 151
    expected = torch.tensor([0, 1, 2, 2, 3, 4]).double()
    torch.testing.assert_close(table[::30], expected, atol=0.02, rtol=0)
    late = Path.through([[0, 0], [20, 0]], times=[0, 1]).timetable(1, 3.0, 30.0)
    assert len(late) == 31 and late[-1] == pytest.approx(3)


# -- what is no way -------------------------------------------------------------------------------

BAD = [
    ([[0, 0]], {}, "at least two places"),
    ([[1, 2], [1, 2], [1, 2]], {}, "all at (1, 2)"),
    ([[0, 0], [1, math.nan]], {}, "Place 2 of the path"),
    ([[0, 0], [math.inf, 1]], {}, "Place 2 of the path"),
    ([[0, 0, 0], [1, 1, 1]], {}, "must be (n, 2)"),
    ("walk", {}, "array (n, 2)"),
    ([], {}, "at least two"),
    ([[0, 0], [0.01, 0]], {}, "Are the numbers metres?"),
    ([[0, 0], [9000, 0]], {}, "Are the numbers metres?"),
    ([[0, 0], [1, 0], [2, 0]], {"times": [0, 2, 1]}, "Place 3 has time 1 s"),
    ([[0, 0], [1, 0], [2, 0]], {"times": [0, 1, 1]}, "must rise"),
    ([[0, 0], [1, 0]], {"times": [0, 1, 2]}, "one each"),
    ([[0, 0], [1, 0]], {"times": [0, math.nan]}, "no NaN"),
    ([[0, 0], [1, 0]], {"corner": -1}, "0 or more"),
]


@pytest.mark.parametrize(("points", "options", "said"), BAD, ids=lambda v: str(v)[:24])
def test_what_is_no_way_is_told(points, options, said):
    with pytest.raises(WayError) as error:
        Path.through(points, **options)
    assert said in str(error.value)


def test_repeated_places_count_once_and_hairpins_end():
    again = Path.through([[0, 0], [0, 0], [0, 4], [0, 4]])
    assert again.length == pytest.approx(4) and len(again.drawn) == 2
    back = Path.through([[0, 0], [3, 0], [0, 0]])
    assert 5 < back.length <= 6 and back.places.isfinite().all()
    table = back.timetable(1.2, 4.0, 30.0)
    assert table.isfinite().all() and (table.diff() > 0).all()
