"""The loop that trains every supervised model: draw windows, step downhill, validate, keep.

Chance is a function of the seed and the number of the update alone. A training that was killed and
started again therefore draws the windows and the noise that it would have drawn anyway, and so do
several processes, each of which takes its share of the same batch.
"""

from __future__ import annotations

import hashlib
import json
import os
import statistics
import sys
import time
from dataclasses import asdict
from pathlib import Path

import torch
from lightning_fabric import Fabric
from torch import Tensor, nn
from tqdm import tqdm

from ..errors import DivergedError, TrainingError
from .checkpoints import read_checkpoint, restore, save_checkpoint, save_weights, write_whole
from .licence import licence
from .prepared import Prepared
from .presets import LAST, Preset
from .windows import Windows

OPTIMIZERS = {
    "adam": torch.optim.Adam,  # not fused: on a CPU that steps wrongly where a gradient lies transposed
    "rmsprop": torch.optim.RMSprop,
    "sgd": lambda parameters, lr: torch.optim.SGD(parameters, lr, momentum=0.9),
    "adadelta": lambda parameters, lr: torch.optim.Adadelta(parameters, lr, rho=0.95, eps=1e-8),
}
CHECKPOINT = "checkpoint.safetensors"
# May change when a training goes on, as long as the updates already made would have been the same.
_MAY_CHANGE = ("updates", "decay", "snapshots", "final")


def train(
    model: nn.Module,
    data: Prepared,
    preset: Preset,
    folder: str | os.PathLike,
    *,
    name: str,
    start: str | os.PathLike | None = None,
    accelerator: str = "auto",
    devices: int = 1,
    nodes: int = 1,
    precision: str | None = None,
    progress: bool = False,
) -> list[dict]:
    """Train a model, or go on where an earlier call with the same arguments was stopped.

    Parameters
    ----------
    model : has ``loss(windows, **extras)``, the mean over (batch, frames, dim) windows; extras
        are what the preset's `extras` gives, such as noise.
    folder : receives ``checkpoint.safetensors`` (to go on from), ``best.safetensors`` (weights with
        the lowest validation loss; with a preset of dances ``last.safetensors``) and ``curve.json``
        at every validation, and ``at-UPDATE.safetensors`` where the preset asks for snapshots.
    name : of the model, kept with its weights.
    start : file of the weights that the model begins with, as `build` was given it; None if it
        begins anew. Its sha256 is kept with the weights, and so is its licence beside the data's.
    accelerator, devices, nodes, precision : as for Lightning Fabric; by default one device, the
        best there is, in bfloat16 on a GPU and in float32 elsewhere.
    progress : show a bar and a line for every validation.

    Returns
    -------
    list of dict : the curve. For every validation: `update`, mean training loss `train` and
        gradient norm `norm` since the last one, validation loss `val`, `seconds` of training.

    Raises
    ------
    TrainingError : the folder holds another training; no clip is as long as a window; a file can't
        be written; there is no such accelerator.
    DivergedError : the loss or its gradient is no longer a number.
    """
    gpu = accelerator in ("cuda", "gpu") or (accelerator == "auto" and torch.cuda.is_available())
    precision = precision or ("bf16-mixed" if gpu else "32-true")
    # processes that wait for each other's gradients must know that some never come
    shares = "ddp_find_unused_parameters_true" if preset.partial and devices * nodes > 1 else "auto"
    try:
        fabric = Fabric(
            accelerator=accelerator, strategy=shares, devices=devices, num_nodes=nodes,
            precision=precision,
        )  # fmt: skip
    except (ImportError, RuntimeError, TypeError, ValueError) as error:
        raise TrainingError(f"Can't train on {devices} x {accelerator!r}: {error}") from error
    fabric.launch()
    if preset.batch % fabric.world_size:
        raise TrainingError(
            f"A batch of {preset.batch} windows can't be shared by {fabric.world_size} processes."
        )
    training = preset.windows(data, "train")
    validation = preset.windows(data, "val").tiles(4 * preset.batch)
    optimizer = OPTIMIZERS[preset.optimizer](model.parameters(), lr=preset.learning_rate)
    network, stepper = fabric.setup(model, optimizer)
    network.mark_forward_method("loss")
    facts = {
        "name": name, "model": model.config(), "preset": asdict(preset), "data": data.hash,
        "precision": precision, "start": start and _sha256(start), "update": 0, "seconds": 0.0,
        "curve": [], "licence": licence(data, start),
    }  # fmt: skip
    _resume(fabric, Path(folder), model, optimizer, facts, preset)

    losses, norms, since = [], [], time.perf_counter()
    shown = progress and fabric.is_global_zero
    bar = tqdm(total=preset.updates, initial=facts["update"], desc=name, mininterval=1,
               disable=None if shown else True)  # fmt: skip
    with bar:
        for update in range(facts["update"], preset.updates):
            for group in optimizer.param_groups:
                group["lr"] = preset.rate(update)
            windows, extras = draw(training, preset, update)
            extras = {name: _share(fabric, tensor) for name, tensor in extras.items()}
            loss = network.loss(_share(fabric, windows), **extras)
            fabric.backward(loss)
            norm = fabric.clip_gradients(
                network, stepper, max_norm=preset.clip, error_if_nonfinite=False
            )
            if not norm.isfinite():
                raise DivergedError(_not_a_number(update, loss, preset, facts, Path(folder)))
            stepper.step()
            stepper.zero_grad()
            losses.append(fabric.all_reduce(loss.detach()).item())
            norms.append(norm.item())
            bar.update()

            facts["update"] = update + 1
            if facts["update"] % preset.validate_every and facts["update"] != preset.updates:
                continue
            facts["seconds"] += time.perf_counter() - since
            facts["curve"].append({
                "update": facts["update"], "train": statistics.fmean(losses),
                "norm": statistics.fmean(norms), "val": evaluate(fabric, model, validation, preset),
                "seconds": facts["seconds"],
            })  # fmt: skip
            losses, norms, since = [], [], time.perf_counter()
            if fabric.is_global_zero:
                _keep(Path(folder), model, optimizer, facts, preset)
            if shown:
                bar.write(_line(facts["curve"]))
                sys.stdout.flush()  # for those who read along in a file
    return facts["curve"]


def draw(windows: Windows, preset: Preset, update: int) -> tuple[Tensor, dict[str, Tensor]]:
    """Windows (batch, frames, dim) of an update and what else its loss takes, such as noise.

    Nothing else decides on them.
    """
    generator = torch.Generator().manual_seed(preset.seed * 1_000_003 + update)
    batch = windows.draw(preset.batch, generator)
    return batch, preset.extras(batch.shape, update, generator)


@torch.no_grad()
def evaluate(fabric: Fabric, model: nn.Module, batches: list[Tensor], preset: Preset) -> float:
    """Mean loss over windows, without noise; the processes share the batches.

    model : not wrapped by Fabric: a wrapped one waits for the others at every batch, and some may
        have one batch less.
    """
    model.eval()
    total = torch.zeros(2)
    for batch in batches[fabric.global_rank :: fabric.world_size]:
        extras = {n: t.to(fabric.device) for n, t in preset.judged(batch.shape).items()}
        with fabric.autocast():
            loss = model.loss(batch.to(fabric.device), **extras).item()
        total += torch.tensor([loss * len(batch), len(batch)])
    model.train()
    loss, count = fabric.all_reduce(total.to(fabric.device), reduce_op="sum").tolist()
    return loss / count


def _share(fabric: Fabric, batch: Tensor) -> Tensor:
    """This process's part of a batch, on its device."""
    return batch[fabric.global_rank :: fabric.world_size].to(fabric.device)


def _resume(
    fabric: Fabric, folder: Path, model: nn.Module, optimizer: torch.optim.Optimizer, facts: dict,
    preset: Preset,
) -> None:  # fmt: skip
    """Go on from the folder's checkpoint if there is one; otherwise make the first."""
    path = folder / CHECKPOINT
    if path.exists():
        tensors, found = read_checkpoint(path)
        _check_same(path, found, facts, type(preset))
        restore(tensors, model, optimizer)
        facts |= {key: found[key] for key in ("update", "seconds", "curve")}
    fabric.barrier()  # nobody writes before all have looked
    if fabric.is_global_zero and not facts["curve"]:
        save_checkpoint(path, model, optimizer, facts)  # if it can't be written, fail now


def _keep(
    folder: Path, model: nn.Module, optimizer: torch.optim.Optimizer, facts: dict, preset: Preset
) -> None:
    """Write what the last validation brought. Killed in between, it is done once more."""
    curve = facts["curve"]
    if _is_best(curve) or preset.weights == LAST:
        save_weights(folder / preset.weights, model, facts)
    if preset.snapshots and facts["update"] % preset.snapshots == 0:
        save_weights(folder / f"at-{facts['update']}.safetensors", model, facts)
    path = folder / "curve.json"
    try:
        write_whole(path, lambda stream: stream.write(json.dumps(curve, indent=1).encode()))
    except OSError as error:
        raise TrainingError(f"{path}: can't be written ({error.strerror}).") from error
    save_checkpoint(folder / CHECKPOINT, model, optimizer, facts)  # last: it says that all is done


def _check_same(path: Path, found: dict, wanted: dict, preset: type[Preset]) -> None:
    """Raise TrainingError if a checkpoint belongs to another training than the one wanted."""
    try:
        before, after = preset(**found["preset"]), preset(**wanted["preset"])
        update = found["update"]
        was, now = (
            {key: facts[key] for key in ("name", "model", "data", "precision")}
            | {"start (--from)": facts.get("start")}
            | {key: value for key, value in asdict(settings).items() if key not in _MAY_CHANGE}
            for facts, settings in ((found, before), (wanted, after))
        )
    except (KeyError, TypeError) as error:
        raise TrainingError(f"{path}: is no checkpoint of this version ({error}).") from error
    other = [key for key in now if was[key] != now[key]]
    if other:
        raise TrainingError(
            f"{path}: belongs to a training with other {', '.join(other)}; repeat its settings to go "
            "on with it, or name another folder."
        )
    if update > after.updates or any(before.rate(i) != after.rate(i) for i in range(update)):
        raise TrainingError(
            f"{path}: has made {update} updates with another learning rate than {after.updates} "
            f"updates in all ask for. A training can be given another end only before its learning "
            f"rate falls, the last {after.decay} updates; start a new one from its weights instead."
        )


def _sha256(path: str | os.PathLike) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _not_a_number(update: int, loss: Tensor, preset: Preset, facts: dict, folder: Path) -> str:
    curve = facts["curve"]
    last = f"the mean loss before was {curve[-1]['train']:.2f}; " if curve else ""
    kept = curve[-1]["update"] if curve else 0
    return (
        f"Update {update}: the loss is {loss.item():g} and its gradient is not a number; {last}the "
        f"learning rate was {preset.rate(update):g}. {folder / CHECKPOINT} holds update {kept}. "
        "Train with a lower learning rate in a new folder, and look for outliers in the data."
    )


def _is_best(curve: list[dict]) -> bool:
    return all(curve[-1]["val"] < point["val"] for point in curve[:-1])


def _line(curve: list[dict]) -> str:
    point = curve[-1]
    return (
        f"update {point['update']:6}  {point['seconds'] / 60:7.1f} min  train {point['train']:9.3f}  "
        f"val {point['val']:9.3f}{' *' if _is_best(curve) else '  '}  gradient {point['norm']:.2f}"
    )
