"""Make shipped weights of a training's: writes src/motionlab/weights/NAME.safetensors and NAME.md.

    python -m experiments.shipping.weights lstm-gmm runs/lstm-gmm-ship/best.safetensors \
        [--data locomotion] [--temperature 0.8] [--component-temperature 1] [--memory 0] [--noise 0] \
        [--folder ...]

Rounds the parameters to half precision, adds states to start from, of validation clips, fits the
temperature of a mixture on these clips unless one is given, and says on the card what the weights
are and what rounding costs. An STRNN has no states: its starts are frames. No number on the card is typed.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path

import torch
from torch import Tensor, nn

import motionlab
from motionlab import MotionLabError
from motionlab.models import LstmGmm, Strnn
from motionlab.models.familiar import bounds
from motionlab.training import PRESETS, Prepared
from motionlab.training.checkpoints import load_weights, save_weights, write_whole
from motionlab.training.evaluation import likelihood
from motionlab.training.finish import fit_temperature
from motionlab.training.prepared import DANCES
from motionlab.training.starts import before_starts
from motionlab.training.strnn import in_body_frame

from ..common import record
from .cards import card, command_of, free_only, licence_of

PER_SOURCE = 2  # starts of an STRNN
FOLDER = Path(motionlab.__file__).parent / "weights"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name")
    parser.add_argument("weights", type=Path)
    parser.add_argument("--data", help="name, folder or prepared file; as its training if left out")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--temperature", type=float, help="for samples, if not the one that fits")
    for option in ("component-temperature", "memory", "noise"):
        parser.add_argument(f"--{option}", type=float, help="for samples, if others than 1, 0, 0")
    parser.add_argument("--remark", default="", help="what else it can't do, for the card")
    chosen = parser.parse_args(arguments)
    sampling = {
        key: getattr(chosen, key)
        for key in ("temperature", "component_temperature", "memory", "noise")
    }
    sampling = {key: value for key, value in sampling.items() if value is not None}
    source = chosen.data or usual_data(chosen.name)
    path = ship(chosen.name, chosen.weights, source, chosen.folder, sampling, chosen.remark)
    print(path.with_suffix(".md").read_text(encoding="utf-8"))


def usual_data(name: str) -> str:
    """What weights of a name are trained on."""
    if (style := name.rpartition("-")[2]) in DANCES:
        return style
    return "everything" if name.startswith("strnn") else "locomotion"


def ship(
    name: str, file: Path, source: str, folder: Path, sampling: dict[str, float], remark: str = ""
) -> Path:
    """Write NAME.safetensors and NAME.md; returns the path of the weights."""
    data, model, made = with_data(file, source)
    licence = licence_of(made, data)  # if it is not known, fails before anything is written
    halved = rounded(model)
    state, starts = None, []
    if isinstance(model, Strnn):
        state, starts, facts = manifold(model, halved, data, made, sampling)
    else:
        ready = mixture if isinstance(model, LstmGmm) else dancer
        before, starts, sampling, facts = ready(model, halved, data, made, sampling)
        with torch.no_grad():  # by the network as it will be
            state = halved.observe(before)
            halved.generate(2, state, **sampling)  # refuses what makes no sense
    about = {
        **{key: made[key] for key in ("preset", "data", "precision", "update", "seconds")},
        "start": made.get("start"),
        "licence": licence,
        "name": name,
        "model": made["name"],
        "command": command_of(made, source),
        "data_name": source + " --permissive" * (source == "locomotion" and free_only(made)),
        "starts": starts,
        "sampling": sampling,
        **facts,
    }
    path = folder / f"{name}.safetensors"
    save_weights(path, halved, about, starts=state, half=True)
    clips = data.clips("train")
    minutes = sum(map(len, clips)) / data.encoding.fps / 60
    text = card(about, halved, path, len(clips), minutes, remark)
    write_whole(path.with_suffix(".md"), lambda stream: stream.write(text.encode()))
    return path


def with_data(file: Path, source: str) -> tuple[Prepared, nn.Module, dict]:
    """The data that weights were trained on, the weights, and what is said of them."""
    model, made = load_weights(file)
    data = Prepared.find(source, permissive=free_only(made))
    if made["data"] != data.hash:
        raise MotionLabError(f"{file}: was not trained on {source}; name the data that it was.")
    return data, model, made


def rounded(model: nn.Module) -> nn.Module:
    """A copy, for use, with parameters as half precision has them."""
    copied = copy.deepcopy(model).eval()
    for parameter in copied.parameters():
        parameter.data = parameter.half().float()
    return copied


Ready = tuple[Tensor, list[str], dict[str, float], dict]


def mixture(
    model: nn.Module, halved: nn.Module, data: Prepared, made: dict, sampling: dict
) -> Ready:
    """Frames before each start (starts, frames, dim), names, sampling, and what else to know."""
    data = data.matching(model.encoding)
    clips = data.clips("val")
    if "temperature" not in sampling:
        sampling = {"temperature": fit_temperature(halved, clips, **sampling)} | sampling
    before, names = before_starts(data, model.fps)
    nats = {"full": likelihood(model, clips), "half": likelihood(halved, clips)}
    facts = {"log_likelihood": {kind: found._asdict() for kind, found in nats.items()}}
    if familiar := bounds(halved, clips):
        facts["familiar"] = familiar._asdict()
    return before, names, sampling, facts


def dancer(
    model: nn.Module, halved: nn.Module, data: Prepared, made: dict, sampling: dict
) -> Ready:
    """The same of a network that says frames, not what is likely."""
    loss, _ = losses(model, halved, data, made)
    before, names = before_starts(data, model.fps)
    return before, names, sampling, {"validation loss": loss}


def manifold(
    model: Strnn, halved: Strnn, data: Prepared, made: dict, sampling: dict
) -> tuple[Tensor, list[str], dict]:
    """Frames that each start begins with (starts, encode, dim), of which clips, and what else to know."""
    loss, _ = losses(model, halved, data, made)
    rows = in_body_frame(data)
    names = [n for n, split in zip(rows.names, rows.splits, strict=True) if split == "val"]
    by_source: dict[str, list[tuple[str, Tensor]]] = {}
    for name, clip in zip(names, rows.clips("val"), strict=True):
        if len(clip) >= 2 * model.encode:
            seen = clip[len(clip) // 2 - model.encode :][: model.encode]
            by_source.setdefault(name.partition("/")[0], []).append((name, seen))
    chosen = [some[i] for some in by_source.values()
              for i in sorted({0, len(some) // 2, len(some) - 1})[:PER_SOURCE]]  # fmt: skip
    frames = torch.stack([seen for _, seen in chosen])
    halved.extrapolate(frames, 2, **sampling)  # refuses what makes no sense
    return frames, [name for name, _ in chosen], {"validation loss": loss}


@torch.no_grad()
def losses(
    model: nn.Module, halved: nn.Module, data: Prepared, made: dict
) -> tuple[dict[str, float], Tensor]:
    """Loss on validation windows in full precision and in half, and these windows."""
    preset = type(PRESETS[made["name"]]["ship"])(**made["preset"])
    windows = torch.cat(preset.windows(data, "val").tiles(1_000))
    extras = preset.judged(windows.shape)
    models = {"full": copy.deepcopy(model).eval(), "half": halved}
    return {key: its.loss(windows, **extras).item() for key, its in models.items()}, windows


if __name__ == "__main__":
    record.run(main)
