"""The network of an `LstmGmm` in ONNX Runtime: one frame of one character, nothing drawn."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import torch

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # too late once it is imported
import onnxruntime  # noqa: E402

from motionlab.models import LstmGmm
from motionlab.weights.export.graph import Graph


def on_one_thread(network: bytes) -> onnxruntime.InferenceSession:
    """What runs a network given as ONNX."""
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = settings.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(network, settings, providers=["CPUExecutionProvider"])


def bare_steps(model: LstmGmm, n: int) -> Callable[[], np.ndarray]:
    """A job of n frames on one thread, h and C fed back; it gives what the mixture is made of."""
    session = on_one_thread(bare(model))

    def steps() -> np.ndarray:
        row = lambda size: np.zeros((1, size), np.float32)
        memory = {name: row(model.width) for name in ("h0", "c0", "h1", "c1")}
        x = row(model.kept)
        for _ in range(n):
            said, *after = session.run(None, {"x": x, **memory})
            memory = dict(zip(memory, after, strict=True))
        return said

    return steps


def bare(model: LstmGmm) -> bytes:
    """The network as an ONNX file: of x, h0, c0, h1, c1 (1, ...) each what is said, and the memories after."""
    graph = Graph(half=False)
    below, after = graph.input("x", model.kept), []
    for layer in (model.enter[0], model.enter[2]):
        below = graph.add("Relu", graph.linear(below, layer))
    for i, (of_input, of_hidden, bias, bias_too) in enumerate(model.lstm.all_weights):
        memory = [graph.input(f"{part}{i}", model.width) for part in "hc"]
        weight = torch.cat([of_input, of_hidden], 1)
        after += graph.lstm(below, *memory, weight, bias + bias_too)
        below = after[-2]
    graph.output("said", graph.linear(below, model.leave), model.leave.out_features)
    for name, value in zip(("h0_after", "c0_after", "h1_after", "c1_after"), after, strict=True):
        graph.output(name, value, model.width)
    return graph.model("step", "motionlab", "", "").SerializeToString()
