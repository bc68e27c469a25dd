"""What each trick of the refiner's game is worth: played without it, as losses and as motion.

    python -m experiments.rnn_gan.games [--list] [--share 1/2]

The paper's game and ours, whole with three seeds, and with one without each of their tricks, with
others' remedies and some of our own, and under root terms of some weights. All have as many updates
of the refiner. Each is kept in runs/games/: stopped and started again, it goes on.
One walk, refined by each, lies in results/refiner_walks.json, to be looked at.
"""

from __future__ import annotations

import argparse
import base64
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

import motionlab
from motionlab.errors import DivergedError
from motionlab.training import GAMES, Prepared
from motionlab.training.adversarial import train_game
from motionlab.training.checkpoints import load_weights
from motionlab.training.games import GamePreset
from motionlab.training.judging import Judge

from ..common import record

FOLDER = Path("runs/games")
SEEDS = (0, 1, 2)
OURS = replace(GAMES["refiner"]["table"], validate_every=20)  # so often losses are told
# Five turns of the refiner a step: a fifth of the steps, less those of the warm-up.
PAPER = replace(
    GAMES["refiner"]["paper"],
    steps=(OURS.steps - 75) // 5 + 1, validate_every=5, width=OURS.width,
    discriminator_width=OURS.discriminator_width,
)  # fmt: skip
ONE_TURN = {"turns": 1, "steps": OURS.steps - 74, "validate_every": 20}
RATES = {"refiner_rate": OURS.refiner_rate, "discriminator_rate": OURS.discriminator_rate}
# Nothing but lambda holds the root: its steps are corrected, not its place, and changes are free.
FREE = replace(OURS, reach=0.0, change_weight=0.0)
SECONDS = 5.0  # of the walk that every refiner refines


class Row(NamedTuple):
    """A game, and what is changed in it."""

    base: GamePreset
    changes: dict
    seeds: Sequence[int] = (0,)

    def preset(self, seed: int) -> GamePreset:
        return replace(self.base, seed=seed, **self.changes)


ROWS = {
    "paper": Row(PAPER, {}, SEEDS),
    "paper without warm-up": Row(PAPER, {"warmup": 0, "steps": OURS.steps // 5}),
    "paper with one turn each": Row(PAPER, ONE_TURN),
    "paper without history": Row(PAPER, {"history": 0}),
    "paper without balance": Row(PAPER, {"balance": False}),
    "paper without root term": Row(PAPER, {"root_weight": 0.0}),
    "paper with instance noise": Row(PAPER, {"instance_noise": 0.5}),
    "paper with spectral norm": Row(PAPER, {"spectral": True}),
    "paper with less steepness": Row(PAPER, {"steepness_weight": 0.3}),
    "paper with slow feet enlarged": Row(PAPER, {"slow": OURS.slow}),
    "paper with our rates": Row(PAPER, RATES),
    "paper with both": Row(replace(PAPER, slow=OURS.slow), RATES),
    "ours": Row(OURS, {}, SEEDS),
    "ours, may be steep": Row(OURS, {"steepness_weight": 0.0}),
    "ours, sees whole windows": Row(OURS, {"piece": 0}),
    "ours, slow feet not enlarged": Row(OURS, {"slow": 0.0}),
    "ours, root off the tether": Row(OURS, {"reach": 0.0, "root_weight": 20.0}),
    "ours, changes for free": Row(OURS, {"change_weight": 0.0}),
    "ours, not averaged": Row(OURS, {"average": 0.0}),
    "ours without history": Row(OURS, {"history": 0}),
    **{
        f"root in steps, lambda {weight:g}": Row(FREE, {"root_weight": weight})
        for weight in (0.0, 1.0, 20.0, 400.0, 8000.0)
    },
}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--share", default="1/1", help="this process's part of the games")
    parser.add_argument("--list", action="store_true", help="show what is done, and stop")
    parser.add_argument("--output", default="results/refiner_games.json")
    parser.add_argument("--walks", default="results/refiner_walks.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    games = sorted(
        ((name, seed) for name, row in ROWS.items() for seed in row.seeds), key=lambda g: g[1]
    )
    if chosen.list:
        for name, seed in games:
            print(f"{'done' if told_in(name, seed).exists() else '':5} {name}, seed {seed}")
        return
    generator = motionlab.load("lstm-gmm")
    data = Prepared.find(chosen.data)
    judge, (part, parts) = None, map(int, chosen.share.split("/"))
    for name, seed in games[part - 1 :: parts]:
        if not told_in(name, seed).exists():
            judge = judge or Judge(generator, data)
            found = play(generator, data, judge, name, seed)
            told_in(name, seed).write_text(json.dumps(record.rounded(found)), encoding="utf-8")
            print(name, seed, found["after"], flush=True)
    if all(told_in(name, seed).exists() for name, seed in games):
        judge = judge or Judge(generator, data)
        rows = {
            name: [
                json.loads(told_in(name, seed).read_text(encoding="utf-8")) for seed in row.seeds
            ]
            for name, row in ROWS.items()
        }
        result = {"real": judge.real, "unrefined": judge.unrefined, "rows": rows}
        about = record.provenance(begin, 0, data)
        record.write(about | result, chosen.output)
        record.write(about | walks(generator), chosen.walks)


def folder_of(name: str, seed: int) -> Path:
    return FOLDER / f"{name.replace(',', '').replace(' ', '-')}-{seed}"


def told_in(name: str, seed: int) -> Path:
    """The file that says how a game went, once it is over."""
    return folder_of(name, seed) / "told.json"


def play(generator, data: Prepared, judge: Judge, name: str, seed: int) -> dict:
    """A game from beginning to end: what was changed, both losses, and what it did to motion."""
    row, folder = ROWS[name], folder_of(name, seed)
    preset = row.preset(seed)
    try:
        curve = train_game(generator, data, preset, folder, name="refiner", device="cpu")
    except DivergedError as error:
        folder.mkdir(parents=True, exist_ok=True)
        return {
            "seed": seed,
            "changes": row.changes,
            "curve": [],
            "after": None,
            "said": str(error),
        }
    refiner, _ = load_weights(folder / f"at-{preset.steps}.safetensors")
    return {"seed": seed, "changes": row.changes, "curve": curve, "after": judge(refiner.eval())}


@torch.no_grad()
def walks(generator) -> dict:
    """One walk that the generator dreams, as it is and as each game's refiner of seed 0 has it."""
    start = next(i for i, name in enumerate(generator.start_names) if name.startswith("walk"))
    walk = generator.generate(
        round(SECONDS * generator.fps), generator.starts[[start]],
        generator=torch.Generator().manual_seed(2), **generator.sampling,
    )  # fmt: skip
    refined = {}
    for name, row in ROWS.items():
        path = folder_of(name, 0) / f"at-{row.preset(0).steps}.safetensors"
        if path.exists():
            refined[name] = packed(load_weights(path)[0].eval()(walk)[0])
    return {"fps": generator.fps, "unrefined": packed(walk[0]), "refined": refined}


def packed(features: torch.Tensor) -> dict:
    """Features (frames, dim) as JSON holds them: half precision in base64."""
    halves = features.numpy().astype(np.float16)
    return {"shape": list(halves.shape), "float16": base64.b64encode(halves.tobytes()).decode()}


if __name__ == "__main__":
    record.run(main)
