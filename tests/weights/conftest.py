"""Tiny weights, trained on gaits in a second and shipped by the script that ships the real ones."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from experiments.shipping.weights import ship


@pytest.fixture(scope="session")
def gaits(tmp_path_factory):
    """The data set "gaits", prepared: the data and their file."""
    from motionlab.training import prepare

    data, path = prepare("gaits"), tmp_path_factory.mktemp("data") / "gaits.npz"
    data.save(path)
    return SimpleNamespace(data=data, path=path)


@pytest.fixture(scope="session")
def trained(gaits, tmp_path_factory):
    """Weights of a training of a second, with contacts: best.safetensors."""
    from motionlab.training import PRESETS, build
    from motionlab.training.loop import train

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    preset = replace(PRESETS["lstm-gmm-contacts"]["smoke"], updates=60, seed=3)
    folder = tmp_path_factory.mktemp("trained")
    model = build(gaits.data, preset)
    train(model, gaits.data, preset, folder, name="lstm-gmm-contacts", accelerator="cpu")
    torch.set_num_threads(threads)
    return folder / "best.safetensors"


@pytest.fixture(scope="session")
def shipped(trained, gaits, tmp_path_factory):
    """The same weights, shipped to a folder of their own: tiny.safetensors."""
    folder = tmp_path_factory.mktemp("shipped")
    return ship("tiny", trained, str(gaits.path), folder, {"temperature": 0.5})
