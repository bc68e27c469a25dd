"""LSTM layers unrolled over frames, some of whose inputs are the network's own outputs.

`torch.nn.LSTM` wants all inputs beforehand. Where an output is the next input, only a loop over
frames is left, and under autograd such a loop is slow: it remembers a dozen tensors a frame, and
adds up the gradient of every weight frame by frame. Here the loop's gradient is written out
(Werbos 1990, *Backpropagation through time*): going back in time it finds how much each gate is to
blame, and only then, for all frames in one product, what that means for the weights.
"""

from __future__ import annotations

import torch
from torch import Tensor


def unroll(
    inputs: Tensor,
    real: Tensor | None,
    hidden: Tensor,
    cell: Tensor,
    gates: list[tuple[Tensor, Tensor]],
    leave: tuple[Tensor, Tensor],
    staircase: bool = False,
) -> tuple[Tensor, Tensor, Tensor]:
    """Outputs (frames, batch, dim) after each frame, and the memory after the last.

    Parameters
    ----------
    inputs : (frames, batch, dim).
    real : (frames, batch) bool: where the input is used. Elsewhere the network sees the output it
        made one frame before; at frame 0 there is none, and the input is used. None: everywhere.
    hidden, cell : (layers, batch, width), the memory before frame 0.
    gates : weight (4 width, in + width) and bias (4 width) of each layer, for what comes from below
        beside the layer's own h, in the order of torch: input, forget, new, output.
    leave : weight (dim, width) and bias (dim) of the linear layer that makes outputs.
    staircase : each layer sees what the one below it said one frame before.
    """
    flat = [part for pair in (*gates, leave) for part in pair]
    return _Unroll.apply(inputs, real, hidden, cell, staircase, *flat)


class _Unroll(torch.autograd.Function):
    @staticmethod
    def forward(ctx, inputs, real, hidden, cell, staircase, *flat):
        pairs = list(zip(flat[::2], flat[1::2], strict=True))
        (*gates, leave), frames, width = pairs, len(inputs), hidden.shape[-1]
        batch, layers = inputs.shape[1], len(gates)
        # What each layer multiplies, [from below, own h], for all frames, and its four gates.
        seen = [inputs.new_empty(frames + 1, batch, w.shape[1]) for w, _ in gates]
        opened = [inputs.new_empty(frames, batch, 4 * width) for _ in gates]
        cells = cell.new_empty(layers, frames + 1, batch, width)  # may have more digits
        top, outputs = inputs.new_empty(frames, batch, width), torch.empty_like(inputs)
        cells[:, 0] = cell
        for layer, h in enumerate(hidden):
            seen[layer][0, :, -width:] = h
            if staircase and layer:
                seen[layer][0, :, :width] = hidden[layer - 1]
        for t in range(frames):
            below = inputs[t]
            if real is not None and t:
                below = torch.where(real[t, :, None], below, outputs[t - 1])
            seen[0][t, :, :-width] = below
            for layer, (weight, bias) in enumerate(gates):
                torch.addmm(bias, seen[layer][t], weight.T, out=opened[layer][t])
                enter, keep, new, show = opened[layer][t].chunk(4, -1)
                new.tanh_()
                for gate in (enter, keep, show):
                    gate.sigmoid_()
                torch.addcmul(keep * cells[layer, t], enter, new, out=cells[layer, t + 1])
                h = (cells[layer, t + 1].tanh() * show).to(show.dtype)
                seen[layer][t + 1, :, -width:] = h
                if layer + 1 < layers:
                    seen[layer + 1][t + staircase, :, :width] = h
            top[t] = h
            torch.addmm(leave[1], h, leave[0].T, out=outputs[t])
        ctx.save_for_backward(cells, top, *seen, *opened, *(pair[0] for pair in pairs))
        ctx.real, ctx.staircase, ctx.layers = real, staircase, layers
        after = torch.stack([part[frames, :, -width:] for part in seen])
        return outputs, after, cells[:, frames].clone()

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, to_outputs, to_hidden, to_cell):
        cells, top, *rest = ctx.saved_tensors
        layers = ctx.layers
        seen, opened, weights = rest[:layers], rest[layers : 2 * layers], rest[2 * layers :]
        *gates, leave = weights
        frames, width = len(top), top.shape[-1]
        blamed = [torch.empty_like(part) for part in opened]  # gradient of gates before squashing
        fed = torch.zeros_like(to_outputs[0])  # from the frame after, through the fed-back output
        to_outputs = to_outputs.clone()
        to_inputs = torch.zeros_like(to_outputs)
        to_hidden, to_cell = [*to_hidden.clone().unbind()], [*to_cell.clone().unbind()]
        for t in reversed(range(frames)):
            to_outputs[t] += fed
            to_hidden[-1] = to_hidden[-1].addmm(to_outputs[t], leave)
            late = [None] * layers  # what layers below get one frame earlier, on a staircase
            for layer in reversed(range(layers)):
                enter, keep, new, show = opened[layer][t].chunk(4, -1)
                bent = cells[layer, t + 1].tanh()
                dh, dc = to_hidden[layer], to_cell[layer]
                dc = dc + dh * show * (1 - bent.square())
                of_enter, of_keep, of_new, of_show = blamed[layer][t].chunk(4, -1)
                of_enter.copy_(dc * new * enter * (1 - enter))
                of_keep.copy_(dc * cells[layer, t] * keep * (1 - keep))
                of_new.copy_(dc * enter * (1 - new.square()))
                of_show.copy_(dh * bent * show * (1 - show))
                to_cell[layer] = dc * keep
                below = blamed[layer][t] @ gates[layer]
                to_hidden[layer] = below[:, -width:]
                below = below[:, :-width]
                if layer == 0:
                    to_inputs[t] = below
                elif ctx.staircase:
                    late[layer - 1] = below
                else:
                    to_hidden[layer - 1] = to_hidden[layer - 1] + below
            for layer, below in enumerate(late):
                if below is not None:
                    to_hidden[layer] = to_hidden[layer] + below
            fed = torch.zeros_like(fed)
            if ctx.real is not None and t:
                from_itself = ~ctx.real[t, :, None]
                fed = to_inputs[t] * from_itself
                to_inputs[t].masked_fill_(from_itself, 0)
        flat = []
        for what, into in zip(blamed, seen, strict=True):
            what = what.flatten(0, 1)
            flat += [what.T @ into[:frames].flatten(0, 1), what.sum(0)]
        rows = to_outputs.flatten(0, 1)
        flat += [rows.T @ top.flatten(0, 1), rows.sum(0)]
        return to_inputs, None, torch.stack(to_hidden), torch.stack(to_cell), None, *flat
