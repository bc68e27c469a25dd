"""The network of an `LstmGmm` in ONNX Runtime: one frame of one character, nothing drawn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import onnx
import onnxruntime
import torch
from onnx import TensorProto, helper, numpy_helper

from motionlab.models import LstmGmm


def bare_steps(model: LstmGmm, n: int) -> Callable[[], np.ndarray]:
    """A job of n frames on one thread, h and C fed back; it gives what the mixture is made of."""
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = settings.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        _Graph(model).bytes(), settings, providers=["CPUExecutionProvider"]
    )

    def steps() -> np.ndarray:
        row = lambda size: np.zeros((1, size), np.float32)
        memory = {name: row(model.width) for name in ("h0", "c0", "h1", "c1")}
        x = row(model.kept)
        for _ in range(n):
            said, *after = session.run(None, {"x": x, **memory})
            memory = dict(zip(memory, after, strict=True))
        return said

    return steps


class _Graph:
    def __init__(self, model: LstmGmm) -> None:
        self.model, self.nodes, self.weights = model, [], []
        self._layer("x", model.enter[0].weight, model.enter[0].bias, "a_")
        self._node("Relu", ["a_"], "a")
        self._layer("a", model.enter[2].weight, model.enter[2].bias, "b_")
        self._node("Relu", ["b_"], "in0")
        for i, (of_input, of_hidden, bias, bias_too) in enumerate(model.lstm.all_weights):
            self._node("Concat", [f"in{i}", f"h{i}"], f"both{i}", axis=1)
            weight = torch.cat([of_input, of_hidden], 1)
            self._layer(f"both{i}", weight, bias + bias_too, f"gates{i}")
            self._node("Split", [f"gates{i}"], *(f"{k}{i}_" for k in "efns"), axis=1, num_outputs=4)
            for gate, bend in zip("efns", ("Sigmoid", "Sigmoid", "Tanh", "Sigmoid"), strict=True):
                self._node(bend, [f"{gate}{i}_"], f"{gate}{i}")
            self._node("Mul", [f"f{i}", f"c{i}"], f"kept{i}")
            self._node("Mul", [f"e{i}", f"n{i}"], f"new{i}")
            self._node("Add", [f"kept{i}", f"new{i}"], f"C{i}")
            self._node("Tanh", [f"C{i}"], f"bent{i}")
            self._node("Mul", [f"s{i}", f"bent{i}"], f"in{i + 1}")
        self._layer("in2", model.leave.weight, model.leave.bias, "said")

    def _node(self, kind: str, inputs: list[str], *outputs: str, **options: int) -> None:
        self.nodes.append(helper.make_node(kind, inputs, outputs, **options))

    def _layer(self, x: str, weight: torch.Tensor, bias: torch.Tensor, y: str) -> None:
        for name, tensor in ((f"{y}_w", weight.T), (f"{y}_b", bias)):
            array = np.ascontiguousarray(tensor.numpy(force=True))
            self.weights.append(numpy_helper.from_array(array, name))
        self._node("Gemm", [x, f"{y}_w", f"{y}_b"], y)

    def bytes(self) -> bytes:
        model = self.model
        row = lambda name, size: helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size])
        memory = [row(name, model.width) for name in ("h0", "c0", "h1", "c1")]
        after = [row(name, model.width) for name in ("in1", "C0", "in2", "C1")]
        said = row("said", model.leave.out_features)
        graph = helper.make_graph(
            self.nodes, "step", [row("x", model.kept), *memory], [said, *after], self.weights
        )
        made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
        onnx.checker.check_model(made)
        return made.SerializeToString()
