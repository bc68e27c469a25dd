"""How much noise suits a dancer: on networks that were never trained."""

import json

import pytest

from experiments.aclstm import noise

pytest.importorskip("lightning_fabric")


def test_noise_gives_a_start_more_than_one_future(untrained, tmp_path, monkeypatch):
    untrained("aclstm-indian")
    path = next(tmp_path.rglob("at-40.safetensors"))
    monkeypatch.setattr(noise.weights, "names", lambda: ["aclstm-indian", "lstm-gmm"])
    monkeypatch.setattr(noise.weights, "find", lambda name: path)
    load = noise.motionlab.load
    monkeypatch.setattr(noise.motionlab, "load", lambda name: load(path))
    noise.main(["--starts", "2", "--seconds", "4", "--output", "found.json"])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["dancers"]
    assert list(found) == ["aclstm-indian"]
    assert list(found["aclstm-indian"]) == [f"{level:g}" for level in noise.LEVELS]
    change = {level: its["change over real"] for level, its in found["aclstm-indian"].items()}
    assert change["0"] != change["0.3"]
