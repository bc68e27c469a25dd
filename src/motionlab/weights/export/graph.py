"""A graph of ONNX, written node by node: what is calculated from what.

torch has exporters of its own. The older one is about to go, the newer one wants more packages, and what
either writes changes from version to version. A step of these networks is a few dozen nodes: written
out, they are the same with every torch, have names, and are of kinds that engines know.
"""

from __future__ import annotations

import numpy as np
import torch
from onnx import ModelProto, TensorProto, checker, helper, numpy_helper
from torch import Tensor, nn

from ...encodings import Normalizer

OPSET, IR = 13, 7  # of 2020: older engines read it, too


class Graph:
    """What is made so far; its methods give the name of what they add.

    half : keep matrices in half precision where that loses nothing, as in weights that are shipped so;
        they are float32 again before anything is multiplied.
    """

    def __init__(self, half: bool = True) -> None:
        self.half = half
        self.inputs: dict[str, tuple[int, ...]] = {}  # shapes without the batch
        self.outputs: dict[str, tuple[int, ...]] = {}
        self.nodes, self.constants = [], []
        self._known: dict[bytes, str] = {}

    # -- what goes in and comes out ---------------------------------------------------------------

    def input(self, name: str, *shape: int) -> str:
        """A float32 input (batch, *shape)."""
        self.inputs[name] = shape
        return name

    def output(self, name: str, value: str, *shape: int) -> None:
        """Let a value (batch, *shape) come out under a name."""
        self.nodes.append(helper.make_node("Identity", [value], [name], name))
        self.outputs[name] = shape

    def constant(self, values: object) -> str:
        """Numbers that never change: int64 if they are a list or array of whole numbers, else float32."""
        array = values.numpy(force=True) if isinstance(values, Tensor) else np.asarray(values)
        whole = array.dtype.kind == "i" and not isinstance(values, int)  # a setting may be 0, or 30
        array = array.astype(np.int64 if whole else np.float32)
        key = repr((array.dtype, array.shape)).encode() + array.tobytes()
        if key not in self._known:
            self._known[key] = self._kept(array)
        return self._known[key]

    def _kept(self, array: np.ndarray) -> str:
        name = f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.array(array, order="C"), name))
        return name

    # -- nodes ------------------------------------------------------------------------------------

    def add(self, kind: str, *values: object, **options: object) -> str:
        """A node of one output; values that are no names become constants."""
        return self._node(kind, values, 1, options)[0]

    def split(self, value: str, sizes: list[int], axis: int) -> list[str]:
        """Pieces of a value along an axis."""
        return self._node("Split", [value, np.array(sizes)], len(sizes), {"axis": axis})

    def _node(self, kind: str, values: object, outputs: int, options: dict) -> list[str]:
        inputs = [v if isinstance(v, str) else self.constant(v) for v in values]
        name = f"{kind}_{len(self.nodes)}"
        names = [name] if outputs == 1 else [f"{name}_{i}" for i in range(outputs)]
        self.nodes.append(helper.make_node(kind, inputs, names, name, **options))
        return names

    def pick(self, value: str, index: int, axis: int = 1) -> str:
        """One entry along an axis, which is gone then."""
        return self.add("Gather", value, np.array(index), axis=axis)

    def stack(self, values: list[str]) -> str:
        """Values (batch, n) to one (batch, values, n)."""
        return self.add("Concat", *(self.add("Unsqueeze", v, [1]) for v in values), axis=1)

    def reshape(self, value: str, *shape: int) -> str:
        """Of (batch, ...) to (batch, *shape)."""
        return self.add("Reshape", value, [0, *shape])

    # -- layers -----------------------------------------------------------------------------------

    def linear(self, value: str, layer: nn.Linear) -> str:
        """(batch, in) to (batch, out)."""
        return self.product(value, layer.weight, layer.bias)

    def product(self, value: str, weight: Tensor, bias: Tensor) -> str:
        """weight (out, in) times value (batch, in), and the bias (out)."""
        return self.add("Gemm", value, self._matrix(weight.detach().T), bias)

    def _matrix(self, weight: Tensor) -> str:
        if not self.half or not torch.equal(weight.half().to(weight), weight):
            return self.constant(weight)
        return self.add("Cast", self._kept(weight.half().numpy(force=True)), to=TensorProto.FLOAT)

    def lstm(self, below: str, hidden: str, cell: str, weight: Tensor, bias: Tensor) -> list[str]:
        """h and C (batch, width) of an LSTM layer after it has seen what is below it.

        weight, bias : (4 width, in + width) and (4 width) of [below, h], gates in torch's order.
        """
        both = self.add("Concat", below, hidden, axis=1)
        gates = self.split(self.product(both, weight, bias), [len(bias) // 4] * 4, axis=1)
        bends = "Sigmoid", "Sigmoid", "Tanh", "Sigmoid"
        enter, keep, new, show = map(self.add, bends, gates)
        cell = self.add("Add", self.add("Mul", keep, cell), self.add("Mul", enter, new))
        return [self.add("Mul", show, self.add("Tanh", cell)), cell]

    def normal(self, features: str, normalizer: Normalizer) -> str:
        """Normalised features (batch, kept) of raw ones (batch, dim)."""
        kept = normalizer.kept
        from_mean = self.add(
            "Sub", self.add("Gather", features, kept, axis=1), normalizer.mean[kept]
        )
        return self.add("Div", from_mean, normalizer.std[kept])

    def raw(self, normalized: str, normalizer: Normalizer) -> str:
        """Raw features (batch, dim) of normalised ones (batch, kept), constant channels put back."""
        spread = torch.diag(normalizer.std)[:, normalizer.kept]  # (dim, kept)
        return self.product(normalized, spread, normalizer.mean)

    # -- the whole --------------------------------------------------------------------------------

    def model(self, name: str, producer: str, version: str, about: str) -> ModelProto:
        """The finished graph, checked; about : read by people, such as a model card."""
        ends = [[_value(*pair) for pair in side.items()] for side in (self.inputs, self.outputs)]
        graph = helper.make_graph(self.nodes, name, *ends, self.constants)
        made = helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR,
            producer_name=producer, producer_version=version, doc_string=about,
        )  # fmt: skip
        checker.check_model(made, full_check=True)
        return made


def _value(name: str, shape: tuple[int, ...]) -> object:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", *shape])
