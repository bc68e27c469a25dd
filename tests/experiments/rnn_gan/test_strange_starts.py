"""Which starts are doubted, and which samples leave their gait: the counts, and that they run."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from experiments.rnn_gan import keeping_pace, strange_starts
from experiments.rnn_gan.strange_starts import auc, doubted, faults, foretold, planted
from motionlab import datasets
from motionlab.models.familiar import Familiar
from motionlab.training import PRESETS, build, checkpoints
from tests.tiny_lstm import tiny_lstm


@pytest.fixture(scope="module")
def model():
    model = tiny_lstm(datasets.load("gaits")[:3], updates=20)
    model.sampling = {"temperature": 0.3}
    return model


def test_the_area_under_the_curve():
    assert auc([(3.0, True), (1.0, False), (2.0, False)]) == 1
    assert auc([(0.0, True), (1.0, False), (2.0, False)]) == 0
    assert auc([(1.0, True), (1.0, False)]) == 0.5
    assert auc([(1.0, True), (0.0, False), (2.0, False)]) == 0.5
    assert auc([(1.0, True)]) == 0.5


def test_faults_are_what_they_are_called(model, gaits):
    encoding, clip = gaits.encoding, gaits.clips("val")[0]
    spoiled = {name: planted(encoding, clip, plant) for name, plant in faults().items()}
    torch.testing.assert_close(spoiled["none"], clip, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(spoiled["100 times too large"][1:, 1], 100 * clip[1:, 1], rtol=1e-3, atol=1e-3)  # fmt: skip
    fast = spoiled["4 times too fast"]
    assert len(fast) == -(-len(clip) // 4)
    assert fast[1:, 1].mean() == pytest.approx(4 * float(clip[:, 1].mean()), rel=0.1)
    assert spoiled["4 times too slow"][5:-5, 1].mean() == pytest.approx(float(clip[:, 1].mean()) / 4, rel=0.1)  # fmt: skip
    assert spoiled["backwards in time"][1:, 1].mean() == pytest.approx(-float(clip[1:, 1].mean()), rel=0.05)  # fmt: skip
    still = spoiled["stands in the file's pose"]
    assert torch.allclose(still, still[0].expand_as(still), atol=1e-5)
    twice = planted(
        encoding, spoiled["left and right exchanged"], faults()["left and right exchanged"]
    )
    torch.testing.assert_close(twice, clip, atol=1e-5, rtol=1e-5)


def test_shares_of_the_doubted_and_the_verdict(model, gaits):
    clips = gaits.clips("val")[:2]
    found = doubted(model, clips, Familiar(-1e9, 1e9))
    assert found["faults"]["none"] == {"seconds": 12, "far": 0, "unlikely": 0, "either": 0}
    assert not found["as it should be"] and found["not found"] == list(strange_starts.MUST)
    found = doubted(model, clips, Familiar(1e9, 1e9))
    assert found["faults"]["none"]["either"] == 1 and found["not found"] == []
    assert not found["as it should be"]


def test_samples_that_leave_are_counted_beside_how_strange_their_starts_are(
    model, gaits, monkeypatch
):
    monkeypatch.setattr(strange_starts, "LENGTH", 2.0)
    monkeypatch.setattr(strange_starts, "JUDGED", (1.0, 2.0))
    begun = torch.stack([clip[:30] for clip in gaits.clips("val")])
    found = foretold(model, begun, torch.full((len(begun),), 1e3), "walk", Familiar(-1e9, 1e9))
    assert found["starts"] == len(begun) and found["leave"] == 1 == found["leave of the others"]
    assert found["doubted"] == 0 and found["leave of the doubted"] is None
    assert not found["far"]["foretells"] and found["far"]["leave, by thirds"] == [1, 1, 1]
    monkeypatch.setattr(
        strange_starts, "leaving", lambda m, b, s, g, seed: torch.arange(len(b)) > 1
    )
    values = torch.arange(len(begun)).float()
    monkeypatch.setattr(
        strange_starts, "measure", lambda m, b: (-values[: len(b)], values[: len(b)])
    )
    found = foretold(model, begun, values, "walk", Familiar(-2.5, 1e9))
    assert found["leave"] == 0.5 and found["doubted"] == 1 and found["leave of the doubted"] == 1
    assert found["far"]["auc"]["value"] == 1 and found["unlikely"]["leave, by thirds"][-1] == 1


def test_what_is_lost_leaves(monkeypatch, model):
    made = torch.full((2, 300, model.encoding.dim), torch.nan)
    monkeypatch.setattr(strange_starts.rollouts, "sampled", lambda *_, **__: [(0, made)])
    only = SimpleNamespace(fps=30.0, encoding=model.encoding, sampling={})
    assert strange_starts.leaving(only, made[:, :30], torch.ones(2), "walk", 0).all()


def test_both_experiments_that_go_on_from_steady_starts_run(gaits, tmp_path, monkeypatch):
    gaits.save(tmp_path / "gaits.npz")
    model = build(gaits, replace(PRESETS["lstm-gmm"]["smoke"], width=16))
    about = {"preset": {}, "update": 0, "familiar": Familiar(-1e9, 1e9)._asdict()}
    checkpoints.save_weights(tmp_path / "w.safetensors", model, about)
    monkeypatch.setattr(keeping_pace, "SEEDS", (0,))
    monkeypatch.setattr(strange_starts, "SEEDS", (0,))
    monkeypatch.setattr(keeping_pace, "SPANS", ((0, 1), (1, 2)))
    for experiment in (keeping_pace, strange_starts):
        experiment.main(["--model", str(tmp_path / "w.safetensors"), "--split", "val",
                         "--data", str(tmp_path / "gaits.npz"), "--starts", "2",
                         "--output", str(tmp_path / "r.json")])  # fmt: skip
        found = json.loads((tmp_path / "r.json").read_text())
        assert found["split"] == "val" and found["walk"]["starts"] == 2
