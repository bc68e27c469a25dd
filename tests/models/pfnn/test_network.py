"""The spline of weights, against scipy's; and the layers, against weights blended one by one."""

import json
import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from motionlab import Skeleton
from motionlab.encodings import Normalizer
from motionlab.errors import ModelError
from motionlab.models.pfnn.layout import Layout, join, size, split
from motionlab.models.pfnn.network import CONTROLS, Pfnn, PhaseLinear, shares

TURN = 2 * math.pi
LAYOUT = Layout(Skeleton.canonical(), fps=30, reach=30, stride=5)


def network(**settings) -> Pfnn:
    torch.manual_seed(0)
    return Pfnn(LAYOUT, **{"width": 16, "drop": 0.0, **settings})


def test_the_spline_goes_through_the_four_sets():
    at = torch.arange(CONTROLS, dtype=torch.float64) * TURN / CONTROLS
    assert torch.equal(shares(at), torch.eye(CONTROLS, dtype=torch.float64))


def test_a_turn_later_it_is_where_it_was():
    start = torch.zeros(1, dtype=torch.float64)
    assert torch.equal(shares(start), shares(start + TURN))
    model, x = network(), torch.randn(1, size(LAYOUT.seen))
    assert torch.allclose(model(x, torch.zeros(1)), model(x, torch.full((1,), TURN)), atol=1e-6)


@given(st.floats(-3, 3))
def test_between_them_it_is_the_cubic_of_scipy(turns):
    """A Catmull-Rom spline is the cubic with slopes of half the way from before to after."""
    points = np.array([0.3, -1.0, 2.0, 0.7])
    closed = points[np.arange(CONTROLS + 1) % CONTROLS]
    slopes = (np.roll(points, -1) - np.roll(points, 1)) / 2
    cubic = CubicHermiteSpline(
        np.arange(CONTROLS + 1), closed, slopes[np.arange(CONTROLS + 1) % CONTROLS]
    )
    found = shares(torch.tensor(turns * TURN, dtype=torch.float64)) @ torch.from_numpy(points)
    assert float(found) == pytest.approx(float(cubic(turns % 1 * CONTROLS)), abs=1e-9)


def test_a_layer_is_the_blend_of_its_weights():
    torch.manual_seed(0)
    layer, x, phase = PhaseLinear(5, 3), torch.randn(7, 5), TURN * torch.rand(7)
    with torch.no_grad():
        layer.bias.normal_()
    weight, bias = layer.at(phase)
    assert weight.shape == (7, 3, 5)
    wanted = (weight @ x[..., None])[..., 0] + bias
    assert torch.allclose(layer(x, shares(phase)), wanted, atol=1e-6)


def test_at_a_control_point_it_is_a_plain_network():
    """Three linear layers, ELU after the first two, of the third set alone."""
    model, x = network(), torch.randn(4, size(LAYOUT.seen))
    wanted = x
    for number, layer in enumerate(model.layers):
        wanted = torch.nn.functional.linear(wanted, layer.weight[2], layer.bias[2])
        wanted = torch.nn.functional.elu(wanted) if number < 2 else wanted
    assert len(model.layers) == 3
    assert torch.allclose(model(x, torch.full((4,), math.pi)), wanted, atol=1e-5)


def test_inputs_and_outputs_are_in_raw_units():
    seen, said = Normalizer(size(LAYOUT.seen)), Normalizer(size(LAYOUT.said))
    seen.mean.fill_(2.0), seen.std.fill_(3.0), said.mean.fill_(-1.0), said.std.fill_(0.5)
    plain, scaled = network(), network(seen=seen, said=said)
    x, phase = torch.randn(4, size(LAYOUT.seen)), torch.rand(4)
    assert torch.allclose(scaled(2 + 3 * x, phase), plain(x, phase) / 2 - 1, atol=1e-5)


def test_lots_decide_what_is_dropped():
    """A layer's input is left out below the share, and the others are louder by as much."""
    model, x, phase = network(drop=0.25), torch.randn(2, size(LAYOUT.seen)), torch.zeros(2)
    lots = torch.ones(2, size(LAYOUT.seen) + 2 * model.width)
    lots[:, :30] = 0.2
    quieter = x.clone()
    quieter[:, :30] = 0
    for layer in model.layers:  # undo the loudness
        layer.weight.data *= 0.75
    dropped = model.answer(x, phase, lots)
    for layer in model.layers:
        layer.weight.data /= 0.75
    assert torch.allclose(dropped, model.answer(quieter, phase), atol=1e-5)


def test_the_loss_is_the_error_and_in_training_the_size_of_weights():
    model = network(sparsity=2.0)
    row = torch.randn(3, 1, 1 + size(LAYOUT.seen) + size(LAYOUT.said))
    phase, seen, said = row[:, 0].split([1, size(LAYOUT.seen), size(LAYOUT.said)], dim=-1)
    error = (model(seen, phase[:, 0]) - said).square().mean()
    assert torch.allclose(model.loss(row), error)
    weights = sum(layer.weight.abs().mean() for layer in model.layers) / 3
    lots = torch.ones(3, 1, row.shape[-1] + 2 * model.width)
    assert torch.allclose(model.loss(row, lots), error + 2 * weights)
    lots[..., 0] = lots[..., -model.width - size(LAYOUT.said) - model.width : -2 * model.width] = 0
    assert torch.allclose(model.loss(row, lots), error + 2 * weights)  # nobody drops what is said


def test_what_config_says_builds_it_again():
    model = network(drop=0.2)
    again = Pfnn.from_config(json.loads(json.dumps(model.config())))
    again.load_state_dict(model.state_dict())
    x = torch.randn(2, size(LAYOUT.seen))
    assert torch.equal(again(x, torch.ones(2)), model(x, torch.ones(2)))
    assert again.config() == model.config()


def test_parts_come_back_from_rows():
    layout = Layout(Skeleton.canonical(), 60, 60, 10, gaits=6, grounds=3)
    for parts in (layout.seen, layout.said):
        rows = torch.randn(2, 5, size(parts))
        assert torch.equal(join(parts, split(parts, rows)), rows)
    assert layout.points == 12 and layout.said["places"] == (2, 6)


@pytest.mark.parametrize(
    "wrong",
    [
        {"width": 0},
        {"width": 1.5},
        {"drop": 1.0},
        {"drop": -0.1},
        {"sparsity": -1.0},
        {"sparsity": math.nan},
    ],
)
def test_settings_that_make_no_sense(wrong):
    with pytest.raises(ModelError, match=f"{next(iter(wrong))} is"):
        network(**wrong)


def test_a_normalizer_of_something_else():
    with pytest.raises(ModelError, match="is for 7 numbers, the layout has"):
        network(seen=Normalizer(7))


def test_a_stride_that_leaves_a_rest():
    with pytest.raises(ModelError, match="7 does not divide a reach of 30"):
        Layout(Skeleton.canonical(), 30, 30, 7)
