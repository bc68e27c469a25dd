"""A dance goes into a file, and what is said of the file into the result."""

import json

import pytest

from experiments.aclstm import gltf

pytest.importorskip("lightning_fabric")


def test_dance_is_written_and_judged(untrained, tmp_path, monkeypatch):
    untrained("aclstm-indian")
    weights = next(tmp_path.rglob("at-40.safetensors"))
    said = [{"severity": 0, "message": "wrong"}, {"severity": 1, "message": "odd"}]
    monkeypatch.setattr(gltf, "validated", lambda path: said if path.stat().st_size else [])
    gltf.main(["--model", str(weights), "--seconds", "0.5", "--output", "found.json"])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert (found["frames"], found["errors"], found["warnings"]) == (15, 1, 1)
    assert (tmp_path / "runs" / "dances" / "dance.glb").read_bytes()[:4] == b"glTF"
