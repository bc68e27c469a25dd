"""The written-out gradient against autograd's, through a loop of torch's own cells."""

import pytest
import torch
from torch import nn

from motionlab.models.unrolled import unroll

FRAMES, BATCH, DIM, WIDTH = 9, 3, 5, 4


@pytest.fixture
def network():
    torch.manual_seed(0)
    sizes = [DIM, WIDTH, WIDTH]
    cells = [nn.LSTMCell(size, WIDTH).double() for size in sizes]
    return cells, nn.Linear(WIDTH, DIM).double()


def by_hand(network, inputs, real, hidden, cell, staircase):
    """The loop of the published code, with the feeding and the delay as options."""
    cells, leave = network
    hidden, cell, outputs = list(hidden), list(cell), []
    for t, frame in enumerate(inputs):
        below = frame if t == 0 else torch.where(real[t, :, None], frame, outputs[-1])
        before = list(hidden)
        for i, layer in enumerate(cells):
            hidden[i], cell[i] = layer(below, (hidden[i], cell[i]))
            below = before[i] if staircase else hidden[i]
        outputs.append(leave(hidden[-1]))
    return torch.stack(outputs), torch.stack(hidden), torch.stack(cell)


def ours(network, inputs, real, hidden, cell, staircase):
    cells, leave = network
    gates = [
        (torch.cat([c.weight_ih, c.weight_hh], 1), c.bias_ih + c.bias_hh) for c in cells
    ]  # fmt: skip
    return unroll(inputs, real, hidden, cell, gates, (leave.weight, leave.bias), staircase)


MASKS = {
    "teacher": torch.ones(FRAMES, BATCH, dtype=torch.bool),
    "2 and 3": (torch.arange(FRAMES) % 5 < 2)[:, None].expand(FRAMES, BATCH),
    "all fed": torch.zeros(FRAMES, BATCH, dtype=torch.bool),
    "mixed": torch.rand(FRAMES, BATCH, generator=torch.Generator().manual_seed(3)) < 0.5,
}


@pytest.mark.parametrize("staircase", [False, True], ids=["direct", "staircase"])
@pytest.mark.parametrize("mask", MASKS)
def test_values_and_gradients_are_those_of_the_loop(network, mask, staircase):
    torch.manual_seed(1)
    shapes = [(FRAMES, BATCH, DIM), (3, BATCH, WIDTH), (3, BATCH, WIDTH)]
    given = [torch.randn(shape, dtype=torch.double, requires_grad=True) for shape in shapes]
    weights = [torch.randn(shape, dtype=torch.double) for shape in shapes]  # of a made-up loss
    parameters = [*given, *(p for part in (*network[0], network[1]) for p in part.parameters())]
    found = []
    for way in (by_hand, ours):
        outputs = way(network, given[0], MASKS[mask], *given[1:], staircase)
        loss = sum((w * part.tanh()).sum() for w, part in zip(weights, outputs, strict=True))
        found.append((outputs, torch.autograd.grad(loss, parameters)))
    (values, gradients), (mine, my_gradients) = found
    for theirs, its in [
        *zip(values, mine, strict=True),
        *zip(gradients, my_gradients, strict=True),
    ]:
        torch.testing.assert_close(its, theirs, rtol=1e-9, atol=1e-11)


def test_no_mask_is_teacher_forcing(network):
    inputs = torch.randn(FRAMES, BATCH, DIM, dtype=torch.double)
    zero = torch.zeros(3, BATCH, WIDTH, dtype=torch.double)
    without = ours(network, inputs, None, zero, zero, False)
    masked = ours(network, inputs, MASKS["teacher"], zero, zero, False)
    assert all(torch.equal(a, b) for a, b in zip(without, masked, strict=True))
    (out, _), _ = _torch_lstm(network)(inputs), None
    torch.testing.assert_close(without[0], network[1](out))


def _torch_lstm(network):
    lstm = nn.LSTM(DIM, WIDTH, num_layers=3).double()
    for i, cell in enumerate(network[0]):
        for name, parameter in cell.named_parameters():
            getattr(lstm, f"{name}_l{i}").data.copy_(parameter.data)
    return lstm


def test_memory_may_have_more_digits_than_weights(network):
    inputs = torch.randn(FRAMES, BATCH, DIM).bfloat16()
    half = lambda tensor: tensor.detach().bfloat16().requires_grad_()
    cells, leave = network
    gates = [
        (half(torch.cat([c.weight_ih, c.weight_hh], 1)), half(c.bias_ih + c.bias_hh)) for c in cells
    ]
    zero = torch.zeros(3, BATCH, WIDTH)
    out, hidden, cell = unroll(inputs, MASKS["2 and 3"], zero.bfloat16(), zero, gates,
                               (half(leave.weight), half(leave.bias)))  # fmt: skip
    assert out.dtype == hidden.dtype == torch.bfloat16 and cell.dtype == torch.float32
    exact = by_hand(network, inputs.double(), MASKS["2 and 3"], zero.double(), zero.double(), False)
    assert (out - exact[0]).abs().max() < 0.05
    found = torch.autograd.grad(out.float().square().sum(), [w for w, _ in gates])
    parameters = [p for c in network[0] for p in (c.weight_ih, c.weight_hh)]
    wanted = torch.autograd.grad(exact[0].square().sum(), parameters)
    for i, mine in enumerate(found):
        both = torch.cat(wanted[2 * i : 2 * i + 2], 1)
        assert (mine - both).norm() < 0.05 * both.norm()
