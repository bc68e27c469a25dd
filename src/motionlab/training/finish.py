"""What weights need besides training to be of use: states to start from, and a temperature.

A mixture density network that was trained on noisy frames expects some: as learned, its samples
tremble. Lower temperatures are calmer, and too low ones calmer than people.
"""

from __future__ import annotations

import os
from pathlib import Path

import torch
from torch import Tensor, nn

from .. import metrics
from ..errors import TrainingError
from ..models import ConvAutoencoder, LstmGmm, Strnn
from ..models.familiar import bounds
from ..models.pfnn import Pfnn
from .checkpoints import load_weights, save_weights, write_whole
from .licence import in_words
from .prepared import Prepared
from .starts import before_starts

OBSERVED = 2.0  # seconds of real motion that a network sees before it goes on by itself
LEAST, MOST, HALVINGS = 0.1, 1.0, 6  # known to 0.014 then


@torch.no_grad()
def finish(path: str | os.PathLike, data: Prepared) -> dict[str, float]:
    """Add to a training's weights what `motionlab.load` gives with them; what it samples with.

    Starts are moments of validation clips. A mixture also gets the temperature at which its motion
    is as lively as those clips, and the bounds beyond which `observe` warns. A PFNN begins by itself, an STRNN
    with frames, an autoencoder with nothing.
    What the weights are is told in a card beside them.

    Raises
    ------
    TrainingError : the file is missing, damaged, or can't be written.
    """
    model, about = load_weights(path)
    if isinstance(model, Pfnn | Strnn | ConvAutoencoder):
        write_card(path)
        return {}
    model.eval()
    before, names = before_starts(data, model.fps)
    sampling = {}
    clips = [clip for clip in data.clips("val") if len(clip) >= OBSERVED * model.fps]
    if isinstance(model, LstmGmm) and clips:
        sampling["temperature"] = fit_temperature(model, clips, seconds=10.0)
    about |= {"starts": names, "sampling": sampling}
    about.pop("familiar", None)
    if isinstance(model, LstmGmm) and (familiar := bounds(model, data.clips("val"))):
        about["familiar"] = familiar._asdict()
    save_weights(path, model, about, starts=model.observe(before))
    write_card(path)
    return sampling


def write_card(path: str | os.PathLike) -> None:
    """What weights of a training are and what may be done with them, in Markdown beside them.

    Raises
    ------
    TrainingError : the weights are missing or damaged, or it can't be written.
    """
    card = Path(path).with_suffix(".md")
    _, about = load_weights(path)
    lines = [
        f"# {about['name']}",
        f"Weights that `motionlab train {about['name']}` left, of data of sha256 {about['data']}.",
        "## Starts" if "starts" in about else "",
        "\n".join(f"* {name}" for name in about.get("starts", ())),
        "## Licence",
        in_words(about["licence"]),
    ]
    text = "\n\n".join(filter(None, lines)) + "\n"
    try:
        write_whole(card, lambda stream: stream.write(text.encode()))
    except OSError as error:
        raise TrainingError(f"{card}: can't be written ({error.strerror}).") from error


@torch.no_grad()
def fit_temperature(
    model: nn.Module, clips: list[Tensor], seed: int = 0, seconds: float = 20.0, **sampling: float
) -> float:
    """Temperature at which mean acceleration is that of the clips the samples begin in.

    Each clip (frames, dim) of two seconds or more gives one sample. Between 0.1 and 1, of which it
    is the nearer end if no temperature does.
    """
    seen = round(OBSERVED * model.fps)
    clips = [clip for clip in clips if len(clip) >= seen]
    start = model.observe(torch.stack([clip[:seen] for clip in clips]))
    wanted = torch.stack([_acceleration(model, clip) for clip in clips]).mean()
    low, high = LEAST, MOST
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        made = model.generate(
            round(seconds * model.fps), start,
            generator=torch.Generator().manual_seed(seed), temperature=middle, **sampling,
        )  # fmt: skip
        # what exploded is NaN: then lower is no help
        if _acceleration(model, made).mean() > wanted:
            high = middle
        else:
            low = middle
    return round((low + high) / 2, 2)


def _acceleration(model: nn.Module, features: Tensor) -> Tensor:
    return metrics.acceleration(model.encoding.positions(features), model.fps)
