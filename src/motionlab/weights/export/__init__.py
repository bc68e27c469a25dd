"""A network for other programs: one step of it as a file of ONNX, with all that one needs to go on.

What goes in and comes out is said in `steps` and in `refiner`. The rest is in the file's metadata, as
JSON under the key "motionlab": see `about`. Beside that it has `inputs` and `outputs`, the shape of each by
its name, without the batch.
"""

from __future__ import annotations

import inspect
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from torch import nn

from ...errors import ModelError
from ...training.licence import in_words, of_weights
from ...version import __version__

KEY, FORMAT = "motionlab", 1  # of the metadata
UNITS = {"length": "metre", "angle": "radian", "up": "y", "ahead": "z", "left": "x"}
_WANG = (
    "Wang, Chai and Xia (2021), Combining Recurrent Neural Networks and Adversarial Training for Human "
    "Motion Synthesis and Control, section "
)
_ZHOU = (
    "Zhou, Li, Xiao, He, Huang and Li (2018), Auto-Conditioned Recurrent Networks for Extended Complex "
    "Human Motion Synthesis"
)


class Kind(NamedTuple):
    """What is exported of a kind of network."""

    citation: str
    state: tuple[str, ...] = ()  # what a start gives of the inputs
    sampling: tuple[
        str, ...
    ] = ()  # arguments of its `generate` that the step's chance is made with


KINDS = {
    "LstmGmm": Kind(
        _WANG + "4.1",
        ("frame", "hidden", "cell"),
        ("temperature", "component_temperature", "memory"),
    ),
    "AcLstm": Kind(_ZHOU, ("hidden", "cell"), ("noise",)),
    "Refiner": Kind(_WANG + "4.2"),
}


def export_onnx(model: nn.Module, path: str | os.PathLike, half: bool = True) -> Path:
    """Write one step of a network as ONNX: state in, a drawn frame and the state after it out.

    The file holds the network, body, features, starts, licence and citation: whoever has it and a
    runtime needs neither motionlab nor torch. The chance is an input, so that the same numbers give the
    same motion. `examples/onnx_walk.py` and `.mjs` are the loop around it.

    Parameters
    ----------
    model : from `motionlab.load`: an `LstmGmm`, an `AcLstm` or a `Refiner`.
    path : file to write; one that is there is replaced.
    half : keep weights in half precision where it loses nothing, as in all that ship: half the bytes,
        the same numbers. For runtimes that know no half precision: False.

    Raises
    ------
    ModelError : a network of another kind, no package `onnx`, or a file that can't be written.
    """
    check_has_step(model)
    try:
        from .graph import Graph
    except ImportError as error:
        raise ModelError(
            f"ONNX is written by the package onnx, which can't be imported here ({error}): "
            "pip install onnx"
        ) from error
    from .refiner import refiner
    from .steps import aclstm, lstm_gmm

    write = {"LstmGmm": lstm_gmm, "AcLstm": aclstm, "Refiner": refiner}[type(model).__name__]
    graph = Graph(half)
    write(graph, model)
    made = graph.model("step", "motionlab", __version__, getattr(model, "card", ""))
    entry = made.metadata_props.add()
    known = about(model) | {"inputs": graph.inputs, "outputs": graph.outputs}
    entry.key, entry.value = KEY, json.dumps(_short(known), separators=(",", ":"))
    path = Path(path)
    try:
        path.write_bytes(made.SerializeToString())
    except OSError as error:
        raise ModelError(f"{path}: can't be written ({error.strerror}).") from error
    return path


def check_has_step(model: nn.Module) -> None:
    """Raise ModelError for a network that has no step from state to state which could be written."""
    kind = type(model).__name__
    if kind not in KINDS:
        raise ModelError(
            f"A {kind} can't be exported: there is no step of it as ONNX. There is one of "
            f"{', '.join(KINDS)}."
        )


def about(model: nn.Module) -> dict[str, Any]:
    """What an exported network's user has to know, fit for JSON.

    * `name`, `kind`, `hash` of the weights; `fps`; `units`, with the directions of the axes;
    * `features`: their `names`, and `slices` [from, to) of what belongs together;
    * `encoding`, its settings, such as `mean_pose`; `skeleton`, with `offsets` and `parents`;
    * `normalizer`: `mean` and `std` of all features, and `kept`, which of them the network sees;
    * `sampling`: the temperatures and the like that suit the weights;
    * `starts`: each with its `name` and its state, for a batch of one without the batch;
    * `licence`, in words, `commercial`, whether that allows commercial use, and `citation`.

    Raises ModelError for a network that can't be exported.
    """
    check_has_step(model)
    encoding, normalizer, kind = model.encoding, model.normalizer, type(model).__name__
    config = encoding.config()
    facts = getattr(model, "about", {})
    terms = of_weights(facts, getattr(model, "card", ""))
    return {
        "format": FORMAT,
        "name": facts.get("name", ""),
        "kind": kind,
        "hash": getattr(model, "hash", ""),
        "fps": model.fps,
        "units": UNITS,
        "features": {
            "names": list(encoding.feature_names),
            "slices": {name: [part.start, part.stop] for name, part in encoding.slices.items()},
        },
        "skeleton": config.pop("skeleton"),
        "encoding": config,
        "normalizer": {
            part: getattr(normalizer, part).tolist() for part in ("mean", "std", "kept")
        },
        "sampling": {name: _suits(model, name) for name in KINDS[kind].sampling},
        "starts": _starts(model, KINDS[kind].state),
        "licence": in_words(terms),
        "commercial": terms["commercial"],
        "citation": KINDS[kind].citation,
    }


def _suits(model: nn.Module, name: str) -> float:
    """An argument of `generate` as it suits the weights."""
    default = inspect.signature(model.generate).parameters[name].default
    return getattr(model, "sampling", {}).get(name, default)


def _starts(model: nn.Module, parts: tuple[str, ...]) -> list[dict[str, Any]]:
    """The states to begin from, frames normalised."""
    if not parts:
        return []
    starts = model.starts._replace(frame=model.normalizer(model.starts.frame))
    return [
        {"name": name} | {part: getattr(starts, part)[i].tolist() for part in parts}
        for i, name in enumerate(model.start_names)
    ]


def _short(value: Any) -> Any:
    """With the fewest digits that are the same number in float32."""
    if isinstance(value, float):
        return float(str(np.float32(value)))
    if isinstance(value, dict):
        return {key: _short(part) for key, part in value.items()}
    return [_short(part) for part in value] if isinstance(value, list) else value
