"""How the convolutional autoencoder is trained: on STRNN's rows, with numbers missing."""

from dataclasses import replace

import pytest
import torch

from motionlab.errors import TrainingError
from motionlab.models import ConvAutoencoder
from motionlab.training import PRESETS, build
from motionlab.training.checkpoints import load_weights
from motionlab.training.finish import finish

SMOKE = PRESETS["conv-autoencoder"]["smoke"]


def test_it_learns_and_its_weights_come_back(gaits, train, tmp_path):
    preset = replace(SMOKE, frames=24)
    curve = train(tmp_path, preset, name="conv-autoencoder")
    assert curve[-1]["val"] < 0.9 * curve[0]["val"]
    assert finish(tmp_path / "best.safetensors", gaits) == {}
    model, about = load_weights(tmp_path / "best.safetensors")
    assert isinstance(model, ConvAutoencoder) and about["name"] == "conv-autoencoder"
    assert model.widths == (8, 16, 32) == build(gaits, preset).widths
    assert "## Licence" in (tmp_path / "best.md").read_text("utf-8")


def test_what_is_missing_depends_on_the_update_alone():
    lots = lambda update: SMOKE.extras((4, 24, 7), update, torch.Generator().manual_seed(update))
    assert torch.equal(lots(3)["lots"], lots(3)["lots"])
    assert not torch.equal(lots(3)["lots"], lots(4)["lots"])
    assert lots(3)["noise"].abs().max() == 0  # numbers are missing instead
    assert SMOKE.judged((4, 24, 7)) == {}


def test_another_layer_is_another_network(gaits):
    assert build(gaits, replace(SMOKE, width=64)).widths == (16, 32, 64)
    with pytest.raises(TrainingError, match="width"):
        replace(SMOKE, width=0)
