"""Make a shipped refiner of a game's: writes src/motionlab/weights/NAME.safetensors and NAME.md.

    python experiments/ship_refiner.py refiner runs/refiner-ship-0/best.safetensors [--from lstm-gmm]

Rounds the parameters to half precision, judges what that costs on validation clips, and says on the
card what the weights are. No number on the card is typed.
"""

from __future__ import annotations

import argparse
import copy
import json
import shlex
import sys
from pathlib import Path

import record
import torch
from cards import licences
from ship_weights import FOLDER
from torch import nn

import motionlab
from motionlab import MotionLabError
from motionlab.training import GAMES, Prepared
from motionlab.training.checkpoints import load_weights, save_weights, write_whole
from motionlab.training.games import GamePreset
from motionlab.training.judging import Judge

KEYS = {
    "foot skate (cm/s)": "foot skate, cm/s",
    "jerk (m/s³)": "jerk, m/s³",
    "frechet": "Fréchet distance",
    "critic": "critic's accuracy",
}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name")
    parser.add_argument("weights", type=Path)
    parser.add_argument("--from", dest="generator", help="what it refines, if not as it is named")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    chosen = parser.parse_args(arguments)
    path = ship(chosen.name, chosen.weights, chosen.generator, chosen.data, chosen.folder)
    print(path.with_suffix(".md").read_text(encoding="utf-8"))


def ship(name: str, file: Path, generator: str | None, source: str, folder: Path) -> Path:
    """Write NAME.safetensors and NAME.md; returns the path of the weights."""
    data = Prepared.find(source)
    refiner, made = load_weights(file)
    of = generator or made["name"].replace("refiner", "lstm-gmm")
    model = motionlab.load(of)
    if "contacts" not in model.encoding.slices:
        data = data.without_contacts()
    if made["data"] != data.hash:
        raise MotionLabError(f"{file}: was not trained on {source}; name the data that it was.")
    sources, commercial = licences(data)  # of an unknown source: fails before anything is written
    halved = copy.deepcopy(refiner)
    for parameter in halved.parameters():
        parameter.data = parameter.half().float()
    judge = Judge(model, data)
    told = {"full": judge(refiner.eval()), "half": judge(halved.eval())}
    about = {
        **{key: made[key] for key in ("preset", "data", "step", "seconds")},
        "name": name, "model": made["name"], "generator": of, "generator_hash": model.hash,
        "command": command_of(made, of), "data_name": source, "judged": told,
        "unrefined": judge.unrefined, "real": judge.real,
    }  # fmt: skip
    path = folder / f"{name}.safetensors"
    save_weights(path, halved, about, half=True)
    text = card(about, halved, path.stat().st_size, sources, commercial)
    write_whole(path.with_suffix(".md"), lambda stream: stream.write(text.encode()))
    return path


def command_of(made: dict, generator: str) -> str:
    """The command line that makes such weights again."""
    trained = GamePreset(**made["preset"])
    for title, preset in GAMES[made["name"]].items():
        differ = [key for key, value in vars(preset).items() if getattr(trained, key) != value]
        if set(differ) <= {"steps", "seed"}:
            options = {"steps": "--updates", "seed": "--seed"}
            more = [f"{options[key]} {getattr(trained, key)}" for key in differ]
            if generator != made["name"].replace("refiner", "lstm-gmm"):
                more.insert(0, f"--from {generator}")
            return " ".join([f"motionlab train {made['name']} --preset {title}", *more])
    raise MotionLabError("No preset of this version has the settings of these weights.")


def card(about: dict, model: nn.Module, size: int, sources: str, commercial: bool) -> str:
    """The model card, in Markdown."""
    name, generator = about["name"], about["generator"]
    full, half = about["judged"]["full"], about["judged"]["half"]
    real = about["real"] | {"frechet": 0.0, "critic": 0.5}
    rows = "\n".join(
        f"| {title} | {real[key]:.3g} | {about['unrefined'][key]:.3g} | {half[key]:.3g} | "
        f"{full[key]:.3g} |"
        for key, title in KEYS.items()
    )
    parameters = sum(parameter.numel() for parameter in model.parameters())
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
| made by | `{about["command"]}` |
| and | `{shlex.join(["python", *sys.argv])}` |
| motionlab | {motionlab.__version__}, torch {torch.__version__} |
| refines | `{generator}`, sha256 {about["generator_hash"]} |
| step | {about["step"]} of {about["preset"]["steps"]}, chosen by `motionlab.training.judging` |
| seed | {about["preset"]["seed"]} |
| time until then | {about["seconds"] / 60:.0f} minutes on one core |
| data | `{about["data_name"]}`, sha256 {about["data"]} |
| size | {parameters:,} parameters in half precision, {size / 2**10:.0f} KiB |

On validation clips and samples of 10 s that go on from them:

| | real | unrefined | refined | before rounding |
|---|---|---|---|---|
{rows}

Half of the roots end within {100 * half["root (m)"]:.1f} cm of where they would have after 10 s.

## Settings of the training

```json
{json.dumps(about["preset"], indent=1)}
```

## Meant for

Learning how such networks work, and motion of `{generator}` whose feet hold the ground better. Not for
motion of other generators, which it has not seen.

## What it can't do

It looks at what has been, not at what comes, and corrects by centimetres: feet still slide, by less.
`motionlab sample --lock-feet` holds them. It knows level ground, and no other body than the canonical one.

## Licence

{"The licences of its data allow commercial use." if commercial else "Not for commercial use: some of its data are not."}
Who passes these weights on names the sources:

{sources}
"""


if __name__ == "__main__":
    record.run(main)
