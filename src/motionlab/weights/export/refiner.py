"""A step of a refiner as a graph: one frame as a generator made it, corrected.

The same calculation as in models/refiner_step.py, where what it means is said.
"""

from __future__ import annotations

import numpy as np
import torch

from ...encodings.effectors import effector_chains
from ...errors import ModelError
from ...models import Refiner
from .graph import Graph

_TINY = 1e-6  # radians
_CROSS = np.zeros((3, 9), np.float32)  # vector to the matrix that takes the cross product with it
_CROSS[[0, 1, 2], [7, 2, 3]], _CROSS[[0, 1, 2], [5, 6, 1]] = 1, -1


def refiner(graph: Graph, model: Refiner) -> None:
    """One frame of `Refiner.refine`.

    In: features and before (batch, dim), raw: the frame to correct, and the one before it as the
    generator made it; hidden and cell (batch, 1, width). Out: refined (batch, dim) and the state after
    it. At the beginning `before` is the frame itself, and the memory zeros.

    Raises ModelError for rotations that are no rotation vectors.
    """
    encoding, dim = model.encoding, model.encoding.dim
    if encoding.rotation != "vector":
        raise ModelError(
            f"A refiner of rotations as {encoding.rotation!r} can't be exported; of 'vector' it can."
        )
    now, before = graph.input("features", dim), graph.input("before", dim)
    state = [graph.input(name, 1, model.width) for name in ("hidden", "cell")]
    hidden, cell = (graph.pick(part, 0) for part in state)
    normalized = graph.normal(now, model.normalizer)
    seen = graph.add("Concat", normalized, *_felt(graph, model, now, before), axis=1)
    below = graph.add("Relu", graph.linear(seen, model.enter[0]))
    of_input, of_hidden, bias, bias_too = model.lstm.all_weights[0]
    weight = torch.cat([of_input, of_hidden], 1)
    after = graph.lstm(below, hidden, cell, weight, bias + bias_too)

    correction = graph.linear(after[0], model.leave)
    refined = graph.raw(graph.add("Add", normalized, correction), model.normalizer)
    if model.reach is not None:
        _, rest = graph.split(refined, [3, dim - 3], axis=1)
        steps = _steps(graph, model, now, hidden, after[0])
        refined = graph.add("Concat", *steps, rest, axis=1)
    graph.output("refined", refined, dim)
    for name, part in zip(("hidden_after", "cell_after"), after, strict=True):
        graph.output(name, graph.stack([part]), 1, model.width)


def _felt(graph: Graph, model: Refiner, now: str, before: str) -> list[str]:
    """What the network sees of end effectors: their places and velocities, (batch, numbers) each."""
    here, there = (_ends(graph, model, row) for row in (now, before))  # (batch, effectors, 3)
    step = [_column(graph, now, i) for i in range(3)]
    x, y, z = (_entry(graph, there, i) for i in range(3))  # (batch, effectors) each
    x, z = graph.add("Sub", x, step[0]), graph.add("Sub", z, step[1])
    sine, cosine = graph.add("Sin", step[2]), graph.add("Cos", step[2])
    mul = lambda a, b: graph.add("Mul", a, b)
    left = graph.add("Sub", mul(x, cosine), mul(z, sine))
    ahead = graph.add("Add", mul(z, cosine), mul(x, sine))
    seen_from_here = [graph.add("Unsqueeze", part, [2]) for part in (left, y, ahead)]
    moved = graph.add("Sub", here, graph.add("Concat", *seen_from_here, axis=2))
    velocity = mul(moved, model.encoding.fps)
    both = graph.add("Concat", here, velocity, axis=2)  # (batch, effectors, 6)
    count = len(model.encoding.effector_names)
    felt = [graph.normal(graph.reshape(both, 6 * count), model.effectors)]
    if model.slow is not None:
        toes, _ = graph.split(velocity, [2, count - 2], axis=1)
        felt.append(graph.add("Asinh", graph.reshape(mul(toes, 1 / model.slow), 6)))
    return felt


def _ends(graph: Graph, model: Refiner, row: str) -> str:
    """End effectors (batch, effectors, 3), metres from the ground below the root."""
    encoding, chains = model.encoding, effector_chains(model.encoding.skeleton)
    local = _turns(graph, model, row, chains.joints)
    count, steps = len(encoding.effector_names), len(chains.levels)
    ends = chains.offsets[steps][..., None]  # (effectors, 3, 1)
    for level in reversed(range(steps)):
        turn = graph.add("Gather", local, np.array(chains.levels[level]), axis=1)
        ends = graph.add("Add", graph.add("MatMul", turn, ends), chains.offsets[level][..., None])
    upwards = np.float32([0, 1, 0])
    lifted = graph.add("Mul", graph.add("Unsqueeze", _column(graph, row, 3), [2]), upwards)
    return graph.add("Add", graph.reshape(ends, count, 3), lifted)


def _turns(graph: Graph, model: Refiner, row: str, joints: list[int]) -> str:
    """Rotations (batch, joints, 3, 3) of those joints, the root first, relative to their parents."""
    encoding, pose = model.encoding, model.encoding.slices["pose"].start
    columns = [[4, 4, 5], *([pose + 3 * (j - 1) + k for k in range(3)] for j in joints[1:])]
    told = np.ones((len(joints), 3), np.float32)
    told[0, 1] = 0  # the root tilts and does not turn
    vectors = graph.add("Gather", row, np.array(columns), axis=1)  # (batch, joints, 3)
    vectors = graph.add("Mul", vectors, told)
    square = graph.add("ReduceSum", graph.add("Mul", vectors, vectors), [2], keepdims=1)
    angle = graph.add("Max", graph.add("Sqrt", square), np.float32(_TINY))
    sine, cosine = graph.add("Sin", angle), graph.add("Cos", angle)
    half = graph.add("Div", graph.add("Sin", graph.add("Mul", angle, 0.5)), angle)
    part = graph.add("Mul", graph.add("Mul", half, half), 2.0)  # (1 - cos) / angle²

    shape = len(joints), 3, 3
    sized = graph.add("Mul", vectors, graph.add("Div", sine, angle))
    cross = graph.reshape(graph.add("MatMul", sized, _CROSS), *shape)
    long = graph.add("Unsqueeze", vectors, [3])
    wide = graph.add("Unsqueeze", graph.add("Mul", vectors, part), [2])
    still = graph.add("Mul", graph.add("Unsqueeze", cosine, [3]), np.eye(3, dtype=np.float32))
    turns = graph.add("Add", graph.add("Add", graph.add("MatMul", long, wide), cross), still)
    mean = encoding.mean_pose[joints].clone()
    mean[0] = torch.eye(3)
    return graph.add("MatMul", mean, turns)


def _steps(graph: Graph, model: Refiner, now: str, hidden: str, after: str) -> list[str]:
    """Steps aside and ahead, and turn, (batch, 1) each, of a root that may leave its place a little."""
    offset = lambda felt: graph.add(
        "Mul", graph.add("Tanh", graph.linear(felt, model.aside)), model.reach
    )
    then, here = offset(hidden), offset(after)  # (batch, 2) each
    x, z, turn = (_column(graph, now, i) for i in range(3))
    aside, ahead = (_column(graph, here, i) for i in range(2))
    sine, cosine = graph.add("Sin", turn), graph.add("Cos", turn)
    mul = lambda a, b: graph.add("Mul", a, b)
    left = graph.add("Add", mul(aside, cosine), mul(ahead, sine))
    forth = graph.add("Sub", mul(ahead, cosine), mul(aside, sine))
    moved = lambda step, to, i: graph.add(
        "Sub", graph.add("Add", step, to), _column(graph, then, i)
    )
    return [moved(x, left, 0), moved(z, forth, 1), turn]


def _column(graph: Graph, row: str, index: int) -> str:
    """One number (batch, 1) of each row (batch, n)."""
    return graph.add("Gather", row, np.array([index]), axis=1)


def _entry(graph: Graph, points: str, index: int) -> str:
    """One coordinate (batch, points) of each point (batch, points, 3)."""
    return graph.pick(points, index, axis=2)
