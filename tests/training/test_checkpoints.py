"""Files of weights: their bytes, whose sha256 cards tell, are those of what is in them."""

import torch
from safetensors import safe_open

from motionlab.training.checkpoints import save_weights


class Tiny(torch.nn.Module):
    def __init__(self, order: str) -> None:
        super().__init__()
        for name in order:
            self.register_parameter(name, torch.nn.Parameter(torch.full((2,), float(ord(name)))))

    def config(self) -> dict:
        return {"size": 2}


def test_the_same_weights_are_the_same_bytes(tmp_path):
    """safetensors keeps no order of its metadata: with several entries they would differ by chance."""
    for name, order in (("one", "abc"), ("other", "cba")):
        save_weights(tmp_path / f"{name}.safetensors", Tiny(order), {"made": "now", "by": "us"})
    one, other = ((tmp_path / f"{name}.safetensors") for name in ("one", "other"))
    assert one.read_bytes() == other.read_bytes()
    with safe_open(one, "pt") as file:
        assert list(file.metadata()) == ["motionlab"]
