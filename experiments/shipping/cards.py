"""Model cards: what shipped weights are, how they were made, and whose data are behind them."""

from __future__ import annotations

import hashlib
import json
import shlex
from dataclasses import asdict
from pathlib import Path

import torch
from torch import nn

import motionlab
from motionlab import MotionLabError, weights
from motionlab.training import GAMES, PRESETS, Prepared
from motionlab.training.games import GamePreset
from motionlab.training.licence import in_words, licence

from ..common import record

PAPERS = {
    "LstmGmm": """\
A recurrent mixture density network (LstmGmm; Wang, Chai and Xia, *Combining Recurrent Neural Networks
and Adversarial Training for Human Motion Synthesis and Control*, 2021, section 4.1) that goes on with
walking and running, {fps:g} frames a second, on the canonical skeleton of motionlab: joint angles, steps
over the ground{toes}. It is no release of the authors of the paper.""",
    "AcLstm": """\
An auto-conditioned recurrent network (AcLstm; Zhou and others, *Auto-Conditioned Recurrent Networks for
Extended Complex Human Motion Synthesis*, 2018) that goes on with motion of the style in its name,
{fps:g} frames a second, as points in space. It is no release of the authors of the paper.""",
    "LSTM-3LR": """\
The plain rival of an auto-conditioned recurrent network (AcLstm; Fragkiadaki and others, *Recurrent Network
Models for Human Dynamics*, 2015, by the name of Zhou and others, 2018): trained on recorded frames alone, it goes
on with motion of the style in its name, {fps:g} frames a second, as points in space, until it soon stops or comes
apart. It is no release of the authors of either paper.""",
    "Strnn": """\
A network that reads frames, says them again and foretells the next ones, all at once (Strnn; Wang, Ho, Shum
and Zhu, *Spatio-temporal Manifold Learning for Human Motions via Long-horizon Modeling*, 2021), of walking,
running, dances, fights and gestures alike, {fps:g} frames a second, on the canonical skeleton of motionlab. It
is no release of the authors of the paper.""",
}
SNIPPETS = {
    "LstmGmm": """\
features = model.generate(300, model.starts[0], **model.sampling)
motion = model.encoding.to_motion(features[0])""",
    "Strnn": """\
features = model.extrapolate(model.starts[0], 300, **model.sampling)
motion = model.encoding.to_motion(features)""",
}
SNIPPETS["AcLstm"] = SNIPPETS["LSTM-3LR"] = SNIPPETS["LstmGmm"]
LIMITS = {
    "LstmGmm": """\
Nothing steers it: it goes where it likes. It knows level ground, and no other body than the canonical
one. Feet slide more than in its data; `motionlab evaluate {name}` measures by how much.""",
    "AcLstm": """\
Nothing steers it, and it draws no lots: one start has one future. It has seen a few minutes of a few
people, and nothing keeps a bone's length. How long its dances last stands in
`results/dances_rollouts.json` and in the book.""",
    "LSTM-3LR": """\
It is here to be seen failing: one start has one future, whose pose soon freezes while the body glides
off, or which sinks into the floor, or loses the length of its bones. How long such networks last stands in `results/dances_rollouts.json`.""",
    "Strnn": """\
Nothing steers it, and it keeps to no kind of motion: a dance may end in a walk. Points have no bones, so that
lengths waver until `to_motion` makes a body of them, and feet slide. How far it goes on by itself stands in
`results/strnn_extrapolation.json`.""",
}
MEASURES = {
    "foot skate (cm/s)": "foot skate, cm/s",
    "jerk (m/s³)": "jerk, m/s³",
    "frechet": "Fréchet distance",
    "critic": "critic's accuracy",
}
NO_PRESET = "No preset of this version has the settings of these weights."


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
            if source != "locomotion" or not free_only(made):
                options.insert(0, f"--data {source}")
            return " ".join([f"motionlab train {made['name']} --preset {title}", *options])
    raise MotionLabError(NO_PRESET)


def free_only(made: dict) -> bool:
    """Whether it was trained on what of its data is free for commercial use: its name says so."""
    return made["name"].endswith("-permissive")


def command_of_game(made: dict, generator: str) -> str:
    """The command line that makes such a refiner again."""
    trained = GamePreset(**made["preset"])
    for title, preset in GAMES[made["name"]].items():
        differ = [key for key, value in asdict(preset).items() if getattr(trained, key) != value]
        if set(differ) <= {"steps", "seed"}:
            options = {"steps": "--updates", "seed": "--seed"}
            more = [f"{options[key]} {getattr(trained, key)}" for key in differ]
            if generator != made["name"].replace("refiner", "lstm-gmm"):
                more.insert(0, f"--from {generator}")
            return " ".join([f"motionlab train {made['name']} --preset {title}", *more])
    raise MotionLabError(NO_PRESET)


def shipped_as(sha256: str) -> str | None:
    """Name of the shipped weights of this hash, if there are such."""
    names = {hashlib.sha256(weights.find(n).read_bytes()).hexdigest(): n for n in weights.names()}
    return names.get(sha256)


def card(
    about: dict,
    model: nn.Module,
    file: Path,
    clips: int,
    minutes: float,
    remark: str = "",
) -> str:
    """The card, in Markdown, of a generator whose weights are in a file.

    clips, minutes : of training motion; remark : on its limits.
    """
    kind, name = type(model).__name__, about["name"]
    if kind == "AcLstm" and about["preset"]["feeding"] == "teacher":
        kind = "LSTM-3LR"
    toes = ", and contacts of the toes" if "contacts" in model.encoding.slices else ""
    begun = f"weights of sha256 {about['start']}" if about["start"] else "chance"
    dancer = kind not in ("LstmGmm", "Strnn")  # they are not mirrored, and their last weights ship
    mirrored = "" if dancer else ", half of them mirror images"
    best = not dancer and not about["preset"].get("final")
    sampling = ", ".join(f"{key} {value:g}" for key, value in about["sampling"].items())
    return f"""\
# {name}

{PAPERS[kind].format(fps=model.fps, toes=toes)}

```python
model = motionlab.load("{name}")
{SNIPPETS[kind]}
```

| | |
|---|---|
{_made_by(about)}
| updates | {about["update"]}{", the best of validation" if best else ""} |
| seed | {about["preset"]["seed"]} |
| began with | {begun} |
| precision of the training | {about["precision"]} |
| time until then | {about["seconds"] / 3600:.2f} h |
| data | `{about["data_name"]}`, sha256 {about["data"]} |
| training clips | {clips}, {minutes:.1f} minutes{mirrored} |
| size | {_parameters(model)}, {file.stat().st_size / 2**20:.1f} MiB |
{_tensors(file)}
{_held_out(about)}
| sampling that suits it | {sampling or "as learned"} |
| starts | {"; ".join(about["starts"]) or f"any {getattr(model, 'encode', 0)} frames"} |

{_settings(about)}

## Meant for

Learning how such networks work, comparing with them, starting a training of your own (`motionlab
train {about["model"]} --from {name}`). Not for judging how a person moves, nor for telling persons
apart.

## What it can't do

{LIMITS[kind].format(name=name)}{remark and f" {remark}"}

## Licence

{in_words(about["licence"])}
"""


def refiner_card(about: dict, model: nn.Module, file: Path) -> str:
    """The card, in Markdown, of a refiner whose weights are in a file."""
    name, generator = about["name"], about["generator"]
    return f"""\
# {name}

A recurrent network (Refiner; Wang, Chai and Xia, *Combining Recurrent Neural Networks and Adversarial
Training for Human Motion Synthesis and Control*, 2021, section 4.2) that corrects motion of
`{generator}`, frame by frame and never looking ahead, so that its feet slide less. It is no release of
the authors of the paper, and its training differs from theirs: see the settings.

```python
model, refiner = motionlab.load("{generator}"), motionlab.load("{name}")
features = refiner(model.generate(300, model.starts[0], **model.sampling))
motion = model.encoding.to_motion(features[0])
```

| | |
|---|---|
{_made_by(about)}
| refines | `{generator}`, sha256 {about["generator_hash"]} |
| step | {about["step"]} of {about["preset"]["steps"]}, chosen by `motionlab.training.judging` |
| seed | {about["preset"]["seed"]} |
| time until then | {about["seconds"] / 60:.0f} minutes on one core |
| data | `{about["data_name"]}`, sha256 {about["data"]} |
| size | {_parameters(model)}, {file.stat().st_size / 2**10:.0f} KiB |
{_tensors(file)}

{_judged(about)}

{_settings(about)}

## Meant for

Learning how such networks work, and motion of `{generator}` whose feet hold the ground better. Not for
motion of other generators, which it has not seen.

## What it can't do

It looks at what has been, not at what comes, and corrects by centimetres: feet still slide, by less.
`motionlab sample --lock-feet` holds them. It knows level ground, and no other body than the canonical one.

## Licence

{in_words(about["licence"])}
"""


def _made_by(about: dict) -> str:
    """Rows on what made the weights."""
    return f"""\
| made by | `{about["command"]}` |
| and | `{shlex.join(record.command())}` |
| motionlab | {motionlab.__version__}, torch {torch.__version__} |"""


def _parameters(model: nn.Module) -> str:
    count = sum(parameter.numel() for parameter in model.parameters())
    return f"{count:,} parameters in half precision"


def _tensors(file: Path) -> str:
    return f"| tensors | sha256 {weights.tensor_hash(file)}, by `motionlab.weights.tensor_hash` |"


def _settings(about: dict) -> str:
    return f"""\
## Settings of the training

```json
{json.dumps(about["preset"], indent=1)}
```"""


def _held_out(about: dict) -> str:
    """Rows on how good it is on validation clips, and on what rounding costs."""
    if "log_likelihood" not in about:
        full, half = (about["validation loss"][kind] for kind in ("full", "half"))
        both = ", of frames said again and of those foretold, added"
        both = both if about["model"].startswith("strnn") else ""
        return (
            f"| held-out loss | {half:.4f}, mean squared error of a channel in deviations{both} |\n"
            f"| what rounding costs | {half - full:.5f} |"
        )
    full, half = (about["log_likelihood"][kind] for kind in ("full", "half"))
    doubted = ""
    if "familiar" in about:
        doubted = (
            f"\n| `observe` warns of a start | below {about['familiar']['likelihood']:g} nats a frame,"
            f" or beyond a distance of {about['familiar']['distance']:g} |"
        )
    return (
        f"| held-out log-likelihood | {half['value']:.3f} nats a frame [{half['low']:.3f}, "
        f"{half['high']:.3f}] over {half['clips']} validation clips |\n"
        f"| what rounding costs | {full['value'] - half['value']:.4f} nats a frame |"
        f"{doubted}"
    )


def _judged(about: dict) -> str:
    """What becomes of motion, by the rounded refiner and by it as it was trained."""
    full, half = about["judged"]["full"], about["judged"]["half"]
    real = about["real"] | {"frechet": 0.0, "critic": 0.5}
    rows = "\n".join(
        f"| {title} | {real[key]:.3g} | {about['unrefined'][key]:.3g} | {half[key]:.3g} | "
        f"{full[key]:.3g} |"
        for key, title in MEASURES.items()
    )
    return f"""\
On validation clips and samples of 10 s that go on from them:

| | real | unrefined | refined | before rounding |
|---|---|---|---|---|
{rows}

Half of the roots end within {100 * half["root (m)"]:.1f} cm of where they would have after 10 s."""


def licence_of(made: dict, data: Prepared) -> dict:
    """Of what a training made, as `motionlab.training.licence` has it; all of it must be known."""
    found = made.get("licence") or licence(data)
    if found["own"]:
        raise MotionLabError(
            "Some of the data are of no named data set; their licence is not known."
        )
    return found
