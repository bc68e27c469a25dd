"""A step of a generator as a graph: a frame is drawn, and the network sees it.

The same order as in `generate`: what a state expects is drawn first, and then becomes part of the state.
Chance comes from outside, so that whoever has the same numbers has the same motion.
"""

from __future__ import annotations

import torch

from ...models import AcLstm, LstmGmm
from .graph import Graph


def lstm_gmm(graph: Graph, model: LstmGmm) -> None:
    """One step of `LstmGmm.generate`.

    In: frame (batch, kept), normalised, hidden and cell (batch, 2, width); noise (batch, kept), normal
    numbers times the temperature; gumbel (batch, M), Gumbel's numbers times the temperature of the
    components. Zeros: no chance. Out: features (batch, dim), raw; the state after it; and the mixture
    that they were drawn from, log_weights (batch, M), means and stds (batch, M, kept).
    """
    kept, count = model.kept, model.components
    frame, memory = graph.input("frame", kept), _memory(graph, model)
    noise, gumbel = graph.input("noise", kept), graph.input("gumbel", count)

    said = graph.linear(memory[-1][0], model.leave)
    weights, means, log_stds = graph.split(said, [count, count * kept, count * kept], axis=1)
    log_weights = graph.add("LogSoftmax", weights, axis=1)
    means, log_stds = (graph.reshape(part, count, kept) for part in (means, log_stds))
    stays = graph.add("Mul", graph.add("Unsqueeze", frame, [1]), model.skip)
    means = graph.add("Add", graph.add("Mul", means, model.reach), stays)
    stds = graph.add("Mul", graph.add("Exp", log_stds), model.reach)
    stds = graph.add("Add", stds, model.floor)

    chosen = graph.add("ArgMax", graph.add("Add", log_weights, gumbel), axis=1, keepdims=1)
    mean, std = (graph.add("GatherND", part, chosen, batch_dims=1) for part in (means, stds))
    drawn = graph.add("Add", mean, graph.add("Mul", std, noise))

    below = drawn
    for layer in (model.enter[0], model.enter[2]):
        below = graph.add("Relu", graph.linear(below, layer))
    after = []
    for (hidden, cell), weights in zip(memory, model.lstm.all_weights, strict=True):
        of_input, of_hidden, bias, bias_too = weights
        weight = torch.cat([of_input, of_hidden], 1)
        after.append(graph.lstm(below, hidden, cell, weight, bias + bias_too))
        below = after[-1][0]

    graph.output("features", graph.raw(drawn, model.normalizer), model.encoding.dim)
    graph.output("frame_after", drawn, kept)
    _remember(graph, model, after)
    graph.output("log_weights", log_weights, count)
    graph.output("means", means, count, kept)
    graph.output("stds", stds, count, kept)


def aclstm(graph: Graph, model: AcLstm) -> None:
    """One step of `AcLstm.generate`.

    In: hidden and cell (batch, layers, width); noise (batch, kept), normal numbers times that
    argument of `generate`, added to what the network sees; zeros for none. Out: features (batch, dim),
    raw; the state after it.
    """
    memory, noise = _memory(graph, model), graph.input("noise", model.kept)
    named = graph.linear(memory[-1][0], model.leave)
    below, after = graph.add("Add", named, noise), []
    for (hidden, cell), gates in zip(memory, model.gates, strict=True):
        after.append(graph.lstm(below, hidden, cell, gates.weight, gates.bias))
        below = hidden if model.staircase else after[-1][0]
    graph.output("features", graph.raw(named, model.normalizer), model.encoding.dim)
    _remember(graph, model, after)


def _memory(graph: Graph, model: LstmGmm | AcLstm) -> list[list[str]]:
    """h and C (batch, width) of each layer."""
    whole = [graph.input(name, model.layers, model.width) for name in ("hidden", "cell")]
    return [[graph.pick(part, layer) for part in whole] for layer in range(model.layers)]


def _remember(graph: Graph, model: LstmGmm | AcLstm, after: list[list[str]]) -> None:
    for name, parts in zip(("hidden_after", "cell_after"), zip(*after, strict=True), strict=True):
        graph.output(name, graph.stack(list(parts)), model.layers, model.width)
