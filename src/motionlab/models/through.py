"""LSTM layers read a stretch of known inputs, with the gradient in these inputs alone.

A solver looks for motion and leaves the weights alone. torch's LSTM remembers, frame by frame, what
their gradient would need. Here the gradient is written out (Werbos 1990, *Backpropagation through
time*) for the inputs and the memory before them. All inputs are known, so what a layer makes of them
is one product for all frames, forwards and backwards; only what comes from its own h goes frame by
frame, by weights that lie in memory as the product reads them, which for a dozen characters takes half
the time. And what does not depend on the blame that comes back is worked out for all frames at once.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from .unchanged import made_of


def through(
    lstm: nn.LSTM, inputs: Tensor, hidden: Tensor, cell: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """What an LSTM says to inputs, as the LSTM itself does it.

    Parameters
    ----------
    lstm : one direction, with biases; its weights get no gradient.
    inputs : (frames, batch, in).
    hidden, cell : (layers, batch, width), the memory before.

    Returns
    -------
    outputs (frames, batch, width), and hidden and cell (layers, batch, width) after the last frame.
    """
    after = []
    for layer, weights in enumerate(made_of(lstm, "through", lambda: _weights(lstm))):
        inputs, last = _Layer.apply(inputs, hidden[layer], cell[layer], *weights)
        after.append((inputs[-1], last))
    return inputs, *(torch.stack(part) for part in zip(*after, strict=True))


@torch.no_grad()
def _weights(lstm: nn.LSTM) -> list[tuple[Tensor, Tensor, Tensor, Tensor]]:
    """Of each layer those of its input, those of h, these as the product reads them, and biases."""
    found = []
    for of_input, of_hidden, bias, bias_too in lstm.all_weights:
        across = of_hidden.T.contiguous()
        width = len(across)
        across[:, 2 * width : 3 * width].mul_(2)  # see `_Layer.forward`
        found.append((of_input.detach(), of_hidden.detach(), across, bias + bias_too))
    return found


class _Layer(torch.autograd.Function):
    @staticmethod
    def forward(ctx, inputs, hidden, cell, of_input, of_hidden, across, bias):
        frames, batch, width = len(inputs), inputs.shape[1], hidden.shape[1]
        gates = torch.addmm(bias, inputs.flatten(0, 1), of_input.T).view(frames, batch, 4 * width)
        cells = cell.new_empty(frames + 1, batch, width)
        bent, outputs = cell.new_empty(2, frames, batch, width)
        cells[0] = cell
        # one sigmoid does for all four: tanh(x) = 2 sigmoid(2 x) - 1 is the third's
        gates[..., 2 * width : 3 * width].mul_(2)
        enter, keep, new, show = _four(gates)
        new = new.unbind()
        for t in range(frames):
            gates[t].addmm_(hidden, across).sigmoid_()
            new[t].mul_(2).sub_(1)
            torch.mul(keep[t], cells[t], out=cells[t + 1]).addcmul_(enter[t], new[t])
            torch.tanh(cells[t + 1], out=bent[t])
            hidden = torch.mul(bent[t], show[t], out=outputs[t])
        ctx.save_for_backward(gates, cells, bent, of_input, of_hidden)
        return outputs, cells[-1].clone()

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, to_outputs, to_cell):
        gates, cells, bent, of_input, of_hidden = ctx.saved_tensors
        enter, keep, new, show = _four(gates)
        of_cell = torch.addcmul(
            show, show * bent, bent, value=-1
        )  # blame of a cell, per blame of h
        # blame of each gate before it was squashed, per blame of its cell, or of h: the last
        blame = torch.sub(1, gates).mul_(gates)
        of_enter, of_keep, of_new, of_show = _four(blame)
        of_enter.mul_(new)
        of_keep.mul_(cells[:-1])
        of_new.copy_(torch.addcmul(enter, enter * new, new, value=-1))
        of_show.mul_(bent)
        by_cell = blame.unflatten(2, (4, -1))[:, :, :3]
        to_hidden, to_cell = torch.zeros_like(to_cell), to_cell.clone()
        for t in reversed(range(len(gates))):
            to_hidden.add_(to_outputs[t])
            to_cell.addcmul_(to_hidden, of_cell[t])
            by_cell[t].mul_(to_cell[:, None])
            of_show[t].mul_(to_hidden)
            to_hidden = blame[t] @ of_hidden
            to_cell.mul_(keep[t])
        to_inputs = (blame.flatten(0, 1) @ of_input).view(*blame.shape[:2], -1)
        return to_inputs, to_hidden, to_cell, None, None, None, None


def _four(gates: Tensor) -> tuple[Tensor, ...]:
    """Input, forget, new and output gate (frames, batch, width) of gates side by side."""
    return gates.chunk(4, -1)
