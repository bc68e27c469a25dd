"""How much noise suits a dancer: on networks that were never trained."""

import json

import pytest

pytest.importorskip("lightning_fabric")


def test_noise_gives_a_start_more_than_one_future(untrained, tmp_path, experiment, monkeypatch):
    script = experiment("dances_noise")
    untrained("aclstm-indian")
    path = next(tmp_path.rglob("at-40.safetensors"))
    monkeypatch.setattr(script.weights, "names", lambda: ["aclstm-indian", "lstm-gmm"])
    monkeypatch.setattr(script.weights, "find", lambda name: path)
    load = script.motionlab.load
    monkeypatch.setattr(script.motionlab, "load", lambda name: load(path))
    script.main(["--starts", "2", "--seconds", "4", "--output", "found.json"])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["dancers"]
    assert list(found) == ["aclstm-indian"]
    assert list(found["aclstm-indian"]) == [f"{level:g}" for level in script.LEVELS]
    change = {level: its["change over real"] for level, its in found["aclstm-indian"].items()}
    assert change["0"] != change["0.3"]
