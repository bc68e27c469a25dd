"""Make a shipped refiner of a game's: writes src/motionlab/weights/NAME.safetensors and NAME.md.

    python -m experiments.shipping.refiner refiner runs/refiner-ship-0/best.safetensors [--from lstm-gmm]

Rounds the parameters to half precision, judges what that costs on validation clips, and says on the
card what the weights are. No number on the card is typed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import motionlab
from motionlab.training.checkpoints import save_weights, write_whole
from motionlab.training.games import GamePreset
from motionlab.training.judging import Judge

from ..common import record
from .cards import command_of_game, free_only, licence_of, refiner_card
from .weights import FOLDER, rounded, with_data


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
    data, refiner, made = with_data(file, source)
    of = generator or made["name"].replace("refiner", "lstm-gmm")
    model = motionlab.load(of)
    licence = licence_of(made, data)  # if it is not known, fails before anything is written
    sampling = GamePreset(**made["preset"]).sampling(model.sampling)  # as in its game
    halved, judge = rounded(refiner), Judge(model, data, sampling=sampling)
    told = {"full": judge(refiner.eval()), "half": judge(halved)}
    about = {
        **{key: made[key] for key in ("preset", "data", "step", "seconds")},
        "name": name, "model": made["name"], "generator": of, "generator_hash": model.hash,
        "command": command_of_game(made, of), "judged": told,
        "data_name": source + " --permissive" * (source == "locomotion" and free_only(made)), "licence": licence,
        "unrefined": judge.unrefined, "real": judge.real,
    }  # fmt: skip
    path = folder / f"{name}.safetensors"
    save_weights(path, halved, about, half=True)
    text = refiner_card(about, halved, path)
    write_whole(path.with_suffix(".md"), lambda stream: stream.write(text.encode()))
    return path


if __name__ == "__main__":
    record.run(main)
