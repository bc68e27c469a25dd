"""Shipping a refiner: rounded weights, a card with every number it promises, and its use."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from safetensors import safe_open

import motionlab
from experiments.shipping.cards import command_of_game
from experiments.shipping.refiner import ship
from motionlab.errors import MotionLabError
from motionlab.models import Refiner
from motionlab.training import GAMES, judging
from motionlab.training.adversarial import train_game
from motionlab.training.checkpoints import load_weights, save_weights
from motionlab.training.judging import Judge, choose


@pytest.fixture(scope="module")
def played(shipped, gaits, tmp_path_factory):
    """A game of some steps on gaits, its best refiner chosen: best.safetensors."""
    folder = tmp_path_factory.mktemp("game")
    generator = motionlab.load(shipped)
    preset = replace(GAMES["refiner-contacts"]["smoke"], steps=4, seed=3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judging, "UPDATES", 5)
        train_game(generator, gaits.data, preset, folder, name="refiner-contacts", device="cpu")
        choose(folder, Judge(generator, gaits.data))
    return folder / "best.safetensors"


@pytest.fixture(scope="module")
def refiner_file(played, shipped, gaits, tmp_path_factory):
    folder = tmp_path_factory.mktemp("shipped-refiner")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judging, "UPDATES", 5)
        return ship("tiny-refiner", played, str(shipped), str(gaits.path), folder)


def test_it_loads_and_refines(refiner_file, shipped):
    refiner, model = motionlab.load(refiner_file), motionlab.load(shipped)
    assert isinstance(refiner, Refiner) and refiner.reach == 0.05 and refiner.slow == 0.1
    raw = model.generate(40, model.starts[:3], **model.sampling)
    refined = refiner(raw)
    assert refined.shape == raw.shape and not refined.equal(raw) and not refined.requires_grad
    with safe_open(refiner_file, framework="pt") as file:
        kinds = {name: file.get_tensor(name).dtype for name in file.keys()}  # noqa: SIM118
    parameters = dict(refiner.named_parameters())
    assert {name for name, kind in kinds.items() if kind == torch.float16} == parameters.keys()


def test_the_card_says_how_good_it_is_and_how_it_was_made(refiner_file, shipped):
    card = motionlab.load(refiner_file).card
    about = motionlab.load(refiner_file).about
    for words in (
        f"motionlab train refiner-contacts --preset smoke --updates 4 --seed 3 --from {shipped}",
        "| foot skate, cm/s |", "| critic's accuracy | 0.5 |", "## Licence", "step | 4 of 4",
    ):  # fmt: skip
        assert words.replace("--updates 4 --seed 3 --from", "--from") in card or words in card, (
            words
        )
    assert f"{about['judged']['half']['jerk (m/s³)']:.3g}" in card
    assert about["generator_hash"] == motionlab.load(shipped).hash


def test_what_cannot_be_shipped_is_said(played, shipped, gaits, tmp_path):
    refiner, made = load_weights(played)
    save_weights(tmp_path / "other.safetensors", refiner, made | {"data": "0" * 64})
    with pytest.raises(MotionLabError, match="was not trained on"):
        ship("x", tmp_path / "other.safetensors", str(shipped), str(gaits.path), tmp_path)
    assert not list(tmp_path.glob("x.*"))
    settings = {"preset": vars(GAMES["refiner"]["ship"]) | {"width": 7}, "name": "refiner"}
    with pytest.raises(MotionLabError, match="No preset"):
        command_of_game(settings, "lstm-gmm")
