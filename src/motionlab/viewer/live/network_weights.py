"""A network as a script that a page can load: weights rounded to a byte each, encoding, starts.

web/src/network/ is the other side: weights.js reads the script; each kind of network and of
encoding that stands in a table here has a file of its own there.
"""

from __future__ import annotations

import base64
import copy
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ...encodings import Encoding, JointAngles, RootRelative
from ...errors import ViewerError

GLOBAL = "motionlabWeights"  # where the page looks for what a script of weights brings

_STATE = "frame", "hidden", "cell", "noise"  # what a page knows of a start

# Matrices, side by side, and bias of a layer. An LSTM's two biases are only ever added.
Layer = tuple[list[Tensor], Tensor]


@dataclass(frozen=True)
class WeightsScript:
    """Weights as a script that a page, also one opened from disk, can load."""

    name: str  # the page knows them by it
    text: str

    @property
    def file(self) -> str:
        return f"motionlab-weights-{self.name}.js"

    def write(self, folder: str | Path) -> Path:
        path = Path(folder) / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self.text, encoding="utf-8")
        return path


def weights_script(
    model: nn.Module, name: str, rounded: bool = True, refiner: nn.Module | None = None
) -> WeightsScript:
    """All that web/src/network/weights.js reads; `rounded` to a byte a weight, or float32.

    `refiner`: of what the model makes, a `Refiner` on the same features, to be run with it.

    Raises ViewerError if the browser can't run the model, or the refiner isn't for it.
    """
    check_known(model)
    settings, layers = _taken_apart(model)
    packed = {part: [_pack(*layer, rounded) for layer in group] for part, group in layers.items()}
    normalizer, starts = model.normalizer, model.starts
    content = ({} if refiner is None else {"refiner": _refiner(model, refiner, rounded)}) | {
        "kind": type(model).__name__,
        "settings": settings,
        "fps": model.fps,
        "kept": normalizer.kept.tolist(),
        "mean": _base64(normalizer.mean),
        "std": _base64(normalizer.std),
        "layers": {**packed, "leave": packed["leave"][0]},
        "encoding": encoding_of(model.encoding),
        "starts": [
            {"name": label, **{key: _base64(getattr(starts, key)[i]) for key in _STATE}}
            for i, label in enumerate(model.start_names)
        ],
    }
    data = json.dumps(content, separators=(",", ":"))
    name = f"{name}-{hashlib.sha256(data.encode()).hexdigest()[:8]}"  # no stale copy from a cache
    key = json.dumps(name)
    text = f"globalThis.{GLOBAL} = globalThis.{GLOBAL} || {{}};\n{GLOBAL}[{key}] = {data};\n"
    return WeightsScript(name, text)


def as_in_browser(model: nn.Module) -> nn.Module:
    """A copy whose weights are rounded as they are for the browser, to measure what that costs."""
    model = copy.deepcopy(model)
    for group in _taken_apart(model)[1].values():
        for matrices, _ in group:
            whole, scales = _round(torch.cat([m.detach() for m in matrices], dim=1))
            parts = (whole * scales[:, None]).split([m.shape[1] for m in matrices], dim=1)
            for matrix, part in zip(matrices, parts, strict=True):
                matrix.data.copy_(part)
    return model


def check_known(model: nn.Module) -> None:
    """Raise ViewerError if the browser can't run a model, or knows nothing of its features."""
    kind = type(model).__name__
    if kind not in ("AcLstm", "LstmGmm"):
        raise ViewerError(f"The browser can run an AcLstm or an LstmGmm, not a {kind}.")
    encoding = model.encoding
    angles = isinstance(encoding, JointAngles) and encoding.rotation == "vector"
    points = isinstance(encoding, RootRelative) and encoding.height == "absolute"
    if not angles and not points:
        raise ViewerError(
            "The browser knows features of JointAngles with rotation='vector' and of RootRelative "
            f"with height='absolute' only; this model has another {type(encoding).__name__}."
        )


def check_refiner(model: nn.Module, refiner: nn.Module) -> None:
    """Raise ViewerError if it is none, or refines other features than those of a model."""
    same = type(refiner).__name__ == "Refiner"
    same = same and refiner.encoding.config() == model.encoding.config()
    parts = ("mean", "std", "kept")
    for part in parts if same else ():
        its, own = (getattr(each.normalizer, part) for each in (refiner, model))
        same = same and torch.equal(its, own)
    if not same:
        raise ViewerError(
            f"{type(refiner).__name__} can't refine what this model makes: it must be a Refiner on "
            "the same features, normalised alike."
        )


# -- networks ---------------------------------------------------------------------------------------


def _taken_apart(model: nn.Module) -> tuple[dict[str, Any], dict[str, list[Layer]]]:
    """A network's few settings, and all of its layers."""
    leave = [([model.leave.weight], model.leave.bias)]
    if type(model).__name__ == "AcLstm":
        gates = [([layer.weight], layer.bias) for layer in model.gates]
        return {"staircase": model.staircase}, {"enter": [], "lstm": gates, "leave": leave}
    enter = [([layer.weight], layer.bias) for layer in (model.enter[0], model.enter[2])]
    parts = model.lstm.all_weights  # [W_ih, W_hh, b_ih, b_hh] a layer
    lstm = [([w_ih, w_hh], b_ih + b_hh) for w_ih, w_hh, b_ih, b_hh in parts]
    settings = {
        "components": model.components,
        "skip": model.skip,
        "reach": model.reach,
        "floor": model.floor.tolist(),
    }
    return settings, {"enter": enter, "lstm": lstm, "leave": leave}


def _refiner(model: nn.Module, refiner: nn.Module, rounded: bool) -> dict[str, Any]:
    """What refiner.js needs beside the model's own encoding and normaliser."""
    check_refiner(model, refiner)
    leave = [layer for layer in (refiner.leave, refiner.aside) if layer is not None]
    weight, bias = (
        torch.cat([getattr(layer, part) for layer in leave]) for part in ("weight", "bias")
    )
    w_ih, w_hh, b_ih, b_hh = refiner.lstm.all_weights[0]
    enter = refiner.enter[0]
    return {
        "settings": {"reach": refiner.reach, "slow": refiner.slow},
        "layers": {
            "enter": [_pack([enter.weight], enter.bias, rounded)],
            "lstm": [_pack([w_ih, w_hh], b_ih + b_hh, rounded)],
            "leave": _pack([weight], bias, rounded),
        },
        "effectors": {
            "joints": [
                refiner.encoding.skeleton.role(role) for role in refiner.encoding.effector_names
            ],
            "mean": _base64(refiner.effectors.mean),
            "std": _base64(refiner.effectors.std),
        },
    }


def _pack(matrices: list[Tensor], bias: Tensor, rounded: bool) -> dict[str, Any]:
    matrix = torch.cat(matrices, dim=1).detach()
    packed = {"columns": matrix.shape[1], "bias": _base64(bias)}
    if not rounded:
        return packed | {"weight": _base64(matrix)}
    whole, scales = _round(matrix)
    return packed | {"weight": _base64(whole, "i1"), "scales": _base64(scales)}


def _round(matrix: Tensor) -> tuple[Tensor, Tensor]:
    """Whole numbers from -127 to 127 (rows, columns) and what one of them stands for, (rows,)."""
    scales = matrix.abs().amax(1).clamp(min=1e-12) / 127
    return (matrix / scales[:, None]).round(), scales


def _base64(values: Tensor, kind: str = "<f4") -> str:
    array = values.detach().cpu().numpy().astype(kind)
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


# -- encodings --------------------------------------------------------------------------------------


def encoding_of(encoding: Encoding) -> dict[str, Any]:
    """What turns rows into points."""
    skeleton = encoding.skeleton
    if isinstance(encoding, RootRelative):
        # a row of ones has the root at a height of one unit
        metres = encoding.positions(torch.ones(1, encoding.dim, dtype=torch.float64))[0, 0, 1]
        legs = [skeleton.role(f"{side}_upper_leg") for side in ("left", "right")]
        return {
            "kind": "RootRelative",
            "points": encoding.points,
            "metres": float(metres),
            "legs": legs,
        }
    return {
        "kind": "JointAngles",
        "parents": list(skeleton.parents),
        "offsets": skeleton.offsets.tolist(),
        "end_parents": list(skeleton.end_parents),
        "end_offsets": skeleton.end_offsets.tolist(),
        "mean_pose": encoding.mean_pose.flatten(1).tolist(),
        "contacts": "contacts" in encoding.slices,
    }
