"""Make shipped weights of a training's: writes src/motionlab/weights/NAME.safetensors and NAME.md.

    python experiments/ship_weights.py lstm-gmm runs/lstm-gmm-ship/best.safetensors \
        [--data locomotion] [--temperature 0.8] [--component-temperature 1] [--noise 0] [--folder ...]

Rounds the parameters to half precision, adds states to start from, of validation clips, fits the
temperature on these clips unless one is given, and says on the card what the weights are and what
rounding costs. No number on the card is typed.
"""

from __future__ import annotations

import argparse
import copy
import hashlib
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import record
import torch
from torch import Tensor, nn

import motionlab
from motionlab import MotionLabError, contacts, datasets, weights
from motionlab.training import PRESETS, Prepared
from motionlab.training.checkpoints import load_weights, save_weights, write_whole
from motionlab.training.evaluation import likelihood
from motionlab.training.finish import fit_temperature

FOLDER = Path(motionlab.__file__).parent / "weights"
OBSERVED = AFTER = (
    1.0  # seconds that the network sees before a start; that the start is named after
)
STEP = 10  # frames from one candidate to the next

# What is looked for: gait, turn (-1 to the right, 0, 1 to the left), and which of all that do this,
# as quantiles of their speed.
WANTED = (
    ("walk", 0, (0.5, 0.1, 0.9)),
    ("walk", 1, (0.25, 0.75)),
    ("walk", -1, (0.25, 0.75)),
    ("run", 0, (0.2, 0.5, 0.9)),
    ("run", 1, (0.5,)),
    ("run", -1, (0.5,)),
    ("stand", 0, (0.5,)),
    ("backwards", 0, (0.5,)),
    ("sidestep left", 0, (0.5,)),
    ("sidestep right", 0, (0.5,)),
)
TURNS = {-1: ", turn right", 0: "", 1: ", turn left"}


@dataclass(frozen=True)
class Start:
    """A moment in a clip, and what the body does in the second after it."""

    clip: int
    frame: int  # the first that the network has not seen
    gait: str
    turn: int
    speed: float  # m/s over the ground

    @property
    def name(self) -> str:
        speed = "" if self.gait == "stand" else f" {self.speed:.1f} m/s"
        return f"{self.gait}{speed}{TURNS[self.turn]}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name")
    parser.add_argument("weights", type=Path)
    parser.add_argument("--data", default="locomotion", help="name, folder or prepared file")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--temperature", type=float, help="for samples, if not the one that fits")
    for option in ("component-temperature", "noise"):
        parser.add_argument(f"--{option}", type=float, help="for samples, if others than 1, 0")
    chosen = parser.parse_args(arguments)
    sampling = {
        key: getattr(chosen, key) for key in ("temperature", "component_temperature", "noise")
    }
    sampling = {key: value for key, value in sampling.items() if value is not None}
    path = ship(chosen.name, chosen.weights, chosen.data, chosen.folder, sampling)
    print(path.with_suffix(".md").read_text(encoding="utf-8"))


def ship(name: str, file: Path, source: str, folder: Path, sampling: dict[str, float]) -> Path:
    """Write NAME.safetensors and NAME.md; returns the path of the weights."""
    data = Prepared.find(source)
    model, made = load_weights(file)
    if made["data"] != data.hash:
        raise MotionLabError(f"{file}: was not trained on {source}; name the data that it was.")
    licence = licences(data)  # of an unknown source: fails before anything is written
    has_contacts = "contacts" in model.encoding.slices
    clips = (data if has_contacts else data.without_contacts()).clips("val")
    halved = copy.deepcopy(model)
    for parameter in halved.parameters():
        parameter.data = parameter.half().float()
    halved.eval()
    if "temperature" not in sampling:
        sampling = {"temperature": fit_temperature(halved, clips, **sampling)} | sampling
    starts = choose(candidates(data))
    observed = round(OBSERVED * model.fps)
    with torch.no_grad():  # by the network as it will be
        state = halved.observe(
            torch.stack([clips[s.clip][s.frame - observed : s.frame] for s in starts])
        )
        halved.generate(2, state, **sampling)  # refuses what makes no sense
    about = {
        **{key: made[key] for key in ("preset", "data", "precision", "update", "seconds")},
        "start": made.get("start"),
        "name": name,
        "model": made["name"],
        "command": command_of(made, source),
        "data_name": source,
        "starts": [start.name for start in starts],
        "sampling": sampling,
        "log_likelihood": {
            "full": likelihood(model, clips)._asdict(),
            "half": likelihood(halved, clips)._asdict(),
        },
    }
    path = folder / f"{name}.safetensors"
    save_weights(path, halved, about, starts=state, half=True)
    text = card(about, halved, path.stat().st_size, data.splits.count("train"), *licence)
    write_whole(path.with_suffix(".md"), lambda stream: stream.write(text.encode()))
    return path


# -- starts ---------------------------------------------------------------------------------------


def candidates(data: Prepared) -> list[Start]:
    """Moments of the validation clips, each with what follows it."""
    encoding, found = data.encoding, []
    before, after = round(OBSERVED * encoding.fps), round(AFTER * encoding.fps)
    for number, clip in enumerate(data.clips("val")):
        points = encoding.positions(clip)
        down = contacts.label_positions(points, encoding.skeleton, encoding.fps)
        for frame in range(before, len(clip) - after + 1, STEP):
            span = slice(frame, frame + after)
            steps = clip[span, :3].mean(0) * encoding.fps  # to the left, ahead, turn; a second
            found.append(Start(number, frame, *doing(steps.tolist(), down[span])))
    return found


def doing(steps: list[float], down: Tensor) -> tuple[str, int, float]:
    """Gait, turn and speed; from m/s to the left, m/s ahead, rad/s, and contacts (frames, 4)."""
    left, ahead, turn = steps
    speed = (left**2 + ahead**2) ** 0.5
    flight = (~down.any(1)).double().mean().item()
    if speed < 0.15:
        gait = "stand"
    elif abs(left) > abs(ahead):
        gait = "sidestep left" if left > 0 else "sidestep right"
    elif ahead < 0:
        gait = "backwards"
    else:
        gait = "run" if flight > 0.1 else "walk"  # who runs is in the air now and then
    return gait, 0 if abs(turn) < 0.5 else 1 if turn > 0 else -1, speed


def choose(found: list[Start]) -> list[Start]:
    """The starts that are wanted, as far as there are any, each of another clip."""
    chosen: list[Start] = []
    for gait, turn, quantiles in WANTED:
        alike = [start for start in found if (start.gait, start.turn) == (gait, turn)]
        for quantile in quantiles:
            alike = [
                start for start in alike
                if start.clip not in {other.clip for other in chosen}
                and start.name not in {other.name for other in chosen}
            ]  # fmt: skip
            if alike:
                speeds = torch.tensor([start.speed for start in alike], dtype=torch.float64)
                nearest = (speeds - speeds.quantile(quantile)).abs().argmin()
                chosen.append(alike[nearest])
    if not chosen:
        raise MotionLabError("The validation clips hold nothing to start from.")
    return chosen


# -- the card -------------------------------------------------------------------------------------


def command_of(made: dict, source: str) -> str:
    """The command line that makes such weights again."""
    trained = type(PRESETS[made["name"]]["ship"])(**made["preset"])
    may_differ = ("updates", "learning_rate", "seed")
    for title, preset in PRESETS[made["name"]].items():
        differ = [key for key, value in asdict(preset).items() if getattr(trained, key) != value]
        if set(differ) <= set(may_differ):
            options = [f"--{key.replace('_', '-')} {getattr(trained, key)}" for key in differ]
            if made.get("start"):
                options.insert(0, f"--from {shipped_as(made['start']) or 'WEIGHTS'}")
            command = f"motionlab train {made['name']} --preset {title} --data {source}"
            return " ".join([command, *options])
    raise MotionLabError("No preset of this version has the settings of these weights.")


def shipped_as(sha256: str) -> str | None:
    """Name of the shipped weights of this hash, if there are such."""
    names = {hashlib.sha256(weights.find(n).read_bytes()).hexdigest(): n for n in weights.names()}
    return names.get(sha256)


def card(
    about: dict, model: nn.Module, size: int, clips: int, sources: str, commercial: bool
) -> str:
    """The model card, in Markdown; clips: for training."""
    full, half = (about["log_likelihood"][kind] for kind in ("full", "half"))
    begun = f"weights of sha256 {about['start']}" if about["start"] else "chance"
    toes = ", and contacts of the toes" if "contacts" in model.encoding.slices else ""
    sampling = ", ".join(f"{key} {value:g}" for key, value in about["sampling"].items())
    parameters = sum(parameter.numel() for parameter in model.parameters())
    return f"""\
# {about["name"]}

A recurrent mixture density network ({type(model).__name__}; Wang, Chai and Xia, *Combining Recurrent
Neural Networks and Adversarial Training for Human Motion Synthesis and Control*, 2021, section 4.1)
that goes on with walking and running, {model.fps:g} frames a second, on the canonical skeleton of
motionlab: joint angles, steps over the ground{toes}. It is no release of the authors of the paper.

```python
model = motionlab.load("{about["name"]}")
motion = model.encoding.to_motion(model.generate(300, model.starts[0])[0])
```

| | |
|---|---|
| made by | `{about["command"]}` |
| and | `{" ".join(["python", *sys.argv])}` |
| motionlab | {motionlab.__version__}, torch {torch.__version__} |
| updates | {about["update"]}, the best of validation |
| seed | {about["preset"]["seed"]} |
| began with | {begun} |
| precision of the training | {about["precision"]} |
| time until then | {about["seconds"] / 3600:.2f} h |
| data | `{about["data_name"]}`, sha256 {about["data"]} |
| training clips | {clips}, half of them mirror images |
| size | {parameters:,} parameters in half precision, {size / 2**20:.1f} MiB |
| held-out log-likelihood | {half["value"]:.3f} nats a frame [{half["low"]:.3f}, {half["high"]:.3f}] over {half["clips"]} validation clips |
| what rounding costs | {full["value"] - half["value"]:.4f} nats a frame |
| sampling that suits it | {sampling or "as learned"} |
| starts | {"; ".join(about["starts"])} |

## Settings of the training

```json
{json.dumps(about["preset"], indent=1)}
```

## Meant for

Learning how such networks work, comparing with them, starting a training of your own (`motionlab
train {about["model"]} --from {about["name"]}`). Not for judging how a person moves, nor for telling persons
apart.

## What it can't do

Nothing steers it: it goes where it likes. It knows level ground, and no other body than the canonical
one. Feet slide more than in its data; `motionlab evaluate {about["name"]}` measures by how much.

## Licence

{"The licences of its data allow commercial use." if commercial else "Not for commercial use: some of its data are not."}
Who passes these weights on names the sources:

{sources}
"""


def licences(data: Prepared) -> tuple[str, bool]:
    """The sources of the training clips, and whether all may be used commercially."""
    frames: dict[str, int] = {}
    rows = zip(data.names, data.splits, data.lengths.tolist(), strict=True)
    for name, split, length in rows:
        if split == "train":
            source = name.split("/")[0]
            frames[source] = frames.get(source, 0) + length
    about = {source: datasets.info(source) for source in frames}
    lines = [
        f"* {about[source].title} (`{source}`), {100 * count / sum(frames.values()):.1f} % of the "
        f"frames: {about[source].licence}. {about[source].citation}"
        for source, count in sorted(frames.items(), key=lambda item: -item[1])
    ]
    return "\n".join(lines), all(info.commercial for info in about.values())


if __name__ == "__main__":
    record.run(main)
