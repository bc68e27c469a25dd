"""Trained models that ship with motionlab, each a file of weights and its card::

    model = motionlab.load("lstm-gmm")
    features = model.generate(300, model.starts[2], **model.sampling)

No data are needed. `experiments/shipping` makes the files; `weights.export` writes them for
other programs.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import safetensors.torch
from torch import nn

from ..errors import ModelError, TrainingError

_FOLDER = Path(__file__).parent


def names() -> list[str]:
    """Names that `load` knows."""
    return sorted(path.stem for path in _FOLDER.glob("*.safetensors"))


def find(name_or_path: str | os.PathLike) -> Path:
    """The file of shipped weights, or of weights of your own; raises ModelError if there is none."""
    if str(name_or_path) in names():
        return _FOLDER / f"{name_or_path}.safetensors"
    path = Path(name_or_path)
    if path.is_file():
        return path
    what = "is a folder" if path.is_dir() else "there is no such file"
    raise ModelError(
        f"Weights {str(name_or_path)!r}: {what}, and none are shipped under this name; there are "
        f"{', '.join(names()) or 'none yet'}. "
        "`motionlab train` leaves its own in a file best.safetensors."
    )


def tensor_hash(name_or_path: str | os.PathLike) -> str:
    """sha256 of the tensors in a file of weights, the one that its card names.

    Names, types, shapes and numbers count, in the order of the names. What else a file says does not,
    nor in which order: it stays the same where other tools write the tensors anew, as a file's own
    sha256 does not.

    Raises
    ------
    ModelError : there are no such weights.
    TrainingError : the file is damaged, or holds something else.
    """
    path = find(name_or_path)
    try:
        tensors = safetensors.torch.load_file(path)
    except (OSError, safetensors.SafetensorError) as error:
        raise TrainingError(f"{path}: is no file of weights, or a damaged one: {error}") from error
    found = hashlib.sha256()
    for name, tensor in sorted(tensors.items()):
        found.update(f"{name} {tensor.dtype} {list(tensor.shape)}\n".encode())
        found.update(tensor.numpy().tobytes())
    return found.hexdigest()


def load(name_or_path: str | os.PathLike) -> nn.Module:
    """A trained model, ready to generate: on the CPU, in float32, in eval mode.

    Its parameters ask for no gradients, so that `generate` remembers nothing. It comes with

    * `starts`, a batch of states to begin from: ``starts[2]``, ``starts[:4]``. Weights of a training
      that was not finished have a single one: that of a network which has seen the mean frame. An
      STRNN's are frames (starts, frames, dim) of validation clips, or None.
    * `start_names`, what the body does in each of them, such as "walk 1.2 m/s", or the clip.
    * `sampling`, arguments of `generate` that suit these weights best.
    * `familiar`, below and above which `observe` warns of strange frames; None if it is not known.
    * `hash`, sha256 of the file; `about`, how they were made; `card`, the same as Markdown.

    Parameters
    ----------
    name_or_path : one of `names()`, or a file such as the best.safetensors of a training.

    Returns
    -------
    nn.Module : such as `models.LstmGmm`, with what is listed above.

    Raises
    ------
    ModelError : there are no such weights.
    TrainingError : the file is damaged, or holds something else.
    """
    from ..models.familiar import Familiar
    from ..training.checkpoints import load_weights

    path = find(name_or_path)
    model, about = load_weights(path)
    model.eval().requires_grad_(False)
    model.about, model.hash = about, hashlib.sha256(path.read_bytes()).hexdigest()
    model.start_names = tuple(about.get("starts", ()))
    model.sampling = about.get("sampling", {})
    if model.starts is None and hasattr(model, "observe"):  # a PFNN begins by itself
        model.starts = model.observe(model.normalizer.mean[None])
        model.start_names = ("mean frame",)
    if "familiar" in about:  # not before: a mean frame is no motion
        model.familiar = Familiar(**about["familiar"])
    card = path.with_suffix(".md")
    model.card = card.read_text(encoding="utf-8") if card.is_file() else ""
    return model
