"""The written-out gradient in the inputs against torch's own LSTM."""

import pytest
import torch
from torch import nn

from motionlab.models.through import through


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("frames", [1, 7])
def test_values_and_gradients_are_those_of_torch(layers, frames):
    torch.manual_seed(0)
    lstm = nn.LSTM(5, 4, num_layers=layers).double()
    shapes = [(frames, 3, 5), (layers, 3, 4), (layers, 3, 4)]
    given = [torch.randn(shape, dtype=torch.double, requires_grad=True) for shape in shapes]
    weights = [torch.randn(*shape[:2], 4, dtype=torch.double) for shape in shapes]
    found = []
    for way in (lambda x, h, c: lstm(x, (h, c)), lambda x, h, c: through(lstm, x, h, c)):
        said = way(*given)
        said = (said[0], *said[1]) if len(said) == 2 else said
        loss = sum((w * part.tanh()).sum() for w, part in zip(weights, said, strict=True))
        found.append((*said, *torch.autograd.grad(loss, given)))
    for theirs, ours in zip(*found, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-9, atol=1e-11)


def test_slopes_are_those_of_differences():
    torch.manual_seed(1)
    lstm = nn.LSTM(3, 4, num_layers=2).double().requires_grad_(False)
    given = [torch.randn(s, dtype=torch.double, requires_grad=True)
             for s in ((4, 2, 3), (2, 2, 4), (2, 2, 4))]  # fmt: skip
    assert torch.autograd.gradcheck(lambda *parts: through(lstm, *parts), given)


def test_weights_get_no_gradient():
    lstm, zero = nn.LSTM(3, 4), torch.zeros(1, 2, 4)
    inputs = torch.randn(5, 2, 3, requires_grad=True)
    through(lstm, inputs, zero, zero)[0].sum().backward()
    assert inputs.grad.abs().sum() > 0 and lstm.weight_ih_l0.grad is None


def test_weights_that_change_are_heard():
    lstm, zero, inputs = nn.LSTM(3, 4), torch.zeros(1, 2, 4), torch.randn(5, 2, 3)
    with torch.no_grad():
        first = through(lstm, inputs, zero, zero)[0]
        lstm.weight_hh_l0.mul_(-1)
        second = through(lstm, inputs, zero, zero)[0]
        assert not torch.allclose(first, second)
        torch.testing.assert_close(second, lstm(inputs, (zero, zero))[0])
