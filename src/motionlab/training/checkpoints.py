"""Weights and half-done trainings in files that are whole, or not there, whenever one looks.

Both are safetensors files: plain arrays and a header of JSON text. Reading one runs no code, as
unpickling would.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import IO, NamedTuple

import safetensors
import safetensors.torch
import torch
from torch import Tensor, nn

from ..errors import MotionLabError, TrainingError
from ..models import (
    AcLstm,
    BidirectionalRnn,
    ConvAutoencoder,
    Crbm,
    Erd,
    LstmGmm,
    Refiner,
    Seq2Seq,
    Strnn,
)
from ..models.pfnn import Pfnn

_MODELS = (
    LstmGmm, AcLstm, Erd, Seq2Seq, Refiner, Pfnn, Strnn, ConvAutoencoder, BidirectionalRnn,
    Crbm,
)  # fmt: skip
_KINDS = {kind.__name__: kind for kind in _MODELS}
_STARTS, _FRAMES = "starts.", "frames"


def write_whole(path: str | os.PathLike, write: Callable[[IO[bytes]], object]) -> None:
    """Let `write` fill a file that appears under its name only when it is complete and on disk.

    Whoever is killed meanwhile leaves the old file untouched. Raises OSError.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.part")
    try:
        with part.open("wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def save_weights(
    path: str | os.PathLike,
    model: nn.Module,
    about: dict,
    *,
    starts: NamedTuple | Tensor | None = None,
    half: bool = False,
) -> None:
    """Weights, with what is needed to build the model again, and what is worth knowing about them.

    Parameters
    ----------
    about : fit for JSON.
    starts : to begin motion from: a state of the model, batched; or, of an STRNN, which has no state,
        frames (starts, frames, dim).
    half : round the parameters to half precision. Normaliser, floors and starts are small, in both
        senses, and stay as they are.

    Raises
    ------
    TrainingError : the file can't be written.
    """
    header = {"kind": type(model).__name__, "config": model.config(), "about": about}
    tensors = model.state_dict()
    if half:
        tensors |= {name: tensor.half() for name, tensor in model.named_parameters()}
    if starts is not None:
        parts = {_FRAMES: starts} if isinstance(starts, Tensor) else starts._asdict()
        parts = {key: part for key, part in parts.items() if part.numel()}
        tensors |= {f"{_STARTS}{key}": part.clone() for key, part in parts.items()}
    _save(path, tensors, header)


@torch.inference_mode(False)  # loaded while sampling, it must serve when training
def load_weights(path: str | os.PathLike) -> tuple[nn.Module, dict]:
    """The model that `save_weights` stored, in float32 on the CPU, and what was said about it.

    The model has `starts`, the state or the frames that were stored with it, or None.

    Raises
    ------
    TrainingError : no such file, damaged, or not weights of a model of motionlab.
    """
    tensors, header = _load(path)
    starts = {name: tensors.pop(name) for name in list(tensors) if name.startswith(_STARTS)}
    starts = {name.removeprefix(_STARTS): tensor for name, tensor in starts.items()}
    try:
        with torch.random.fork_rng(devices=[]):  # building a model draws its first weights
            model = _KINDS[header["kind"]].from_config(header["config"])
        model.load_state_dict(tensors)
        model.starts = starts.pop(_FRAMES, None)
        if starts:
            model.starts = model.zero_state(len(starts["frame"]))._replace(**starts)
        return model, header["about"]
    except (KeyError, TypeError, ValueError, RuntimeError, MotionLabError) as error:
        raise TrainingError(
            f"{path}: holds no weights of a model of motionlab ({error})."
        ) from error


def save_checkpoint(
    path: str | os.PathLike, model: nn.Module, optimizer: torch.optim.Optimizer, facts: dict
) -> None:
    """All that a training needs to go on: weights, the optimiser's memory, and `facts`."""
    tensors = {f"model.{name}": tensor for name, tensor in model.state_dict().items()}
    for index, memory in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{index}.{name}": tensor for name, tensor in memory.items()}
    _save(path, tensors, facts)


def read_checkpoint(path: str | os.PathLike) -> tuple[dict[str, Tensor], dict]:
    """Tensors and facts of `save_checkpoint`; raises TrainingError if the file is damaged."""
    return _load(path)


def restore(tensors: dict[str, Tensor], model: nn.Module, optimizer: torch.optim.Optimizer) -> None:
    """Put what `read_checkpoint` gave back into model and optimiser."""
    weights = {
        name.removeprefix("model."): tensor
        for name, tensor in tensors.items()
        if name.startswith("model.")
    }
    memory: dict[int, dict[str, Tensor]] = {}
    for key in tensors:
        if key.startswith("optimizer."):
            _, index, name = key.split(".", 2)
            memory.setdefault(int(index), {})[name] = tensors[key]
    model.load_state_dict(weights)
    optimizer.load_state_dict({**optimizer.state_dict(), "state": memory})


def _save(path: str | os.PathLike, tensors: dict[str, Tensor], header: dict) -> None:
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    content = safetensors.torch.save(tensors, {"motionlab": json.dumps(header)})
    try:
        write_whole(path, lambda stream: stream.write(content))
    except OSError as error:
        raise TrainingError(
            f"{path}: can't be written ({error.strerror}); make room, or name another folder."
        ) from error


def _load(path: str | os.PathLike) -> tuple[dict[str, Tensor], dict]:
    try:
        with safetensors.safe_open(path, framework="pt") as file:
            header = json.loads((file.metadata() or {})["motionlab"])
            # Copies: a tensor that lies in the file keeps it open, and Windows then refuses to put
            # a newer file in its place.
            tensors = {name: file.get_tensor(name).clone() for name in file.keys()}  # noqa: SIM118
        return tensors, header
    except FileNotFoundError as error:
        raise TrainingError(f"{path}: there is no such file.") from error
    except (OSError, KeyError, ValueError, safetensors.SafetensorError) as error:
        raise TrainingError(
            f"{path}: is no file of weights that motionlab wrote, or a damaged one ({error}); name "
            "another."
        ) from error
