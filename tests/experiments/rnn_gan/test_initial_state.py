"""What initial_state.py measures, on an untrained network and on accelerations known."""

import json
from dataclasses import replace

import pytest
import torch

from experiments.rnn_gan import initial_state
from motionlab.training import PRESETS, build, checkpoints


def test_hop_is_the_acceleration_over_samples_and_points():
    t = torch.arange(6, dtype=torch.float64) / 30
    fall = torch.zeros(2, 3, 6, 4, 3, dtype=torch.float64)
    fall[0, ..., 1] = (-9.81 / 2 * t**2)[:, None]
    fall[1, :, 3:] += 0.01  # all points jump by 1.7 cm between the third and the fourth frame
    found = initial_state.hop(fall, 30.0)
    torch.testing.assert_close(found[0], torch.full((4,), 9.81, dtype=torch.float64))
    jump = 0.01 * 3**0.5 * 900
    assert found[1].tolist() == pytest.approx([0, jump, jump, 0])


def test_middles_are_of_long_clips_only():
    clips = [torch.arange(length)[:, None].float() for length in (39, 40, 61)]
    found = initial_state.middles(clips)
    assert found.shape == (2, 40, 1) and found[:, 0, 0].tolist() == [0, 10]


def test_it_runs_and_the_estimated_state_is_likelier(gaits, tmp_path):
    gaits.save(tmp_path / "gaits.npz")
    model = build(gaits, replace(PRESETS["lstm-gmm"]["smoke"], width=16))
    checkpoints.save_weights(tmp_path / "w.safetensors", model, {"preset": {}, "update": 0})
    weights, data = str(tmp_path / "w.safetensors"), str(tmp_path / "gaits.npz")
    initial_state.main(["--model", weights, "--data", data, "--split", "val", "--iterations", "20",
                        "--output", str(tmp_path / "r.json")])  # fmt: skip
    found = json.loads((tmp_path / "r.json").read_text())
    likely = found["log-likelihood of frame 2 (nats)"]
    assert likely["estimated"]["value"] > likely["zero"]["value"]
    assert len(found["hop (m/s²)"]["observed"]) == initial_state.FOLLOWED
    assert found["excess hop at frame 1 (m/s²)"]["observed"]["value"] == 0
    assert 0 <= found["cases"]["clips"] <= found["clips"]


def test_cases_are_chosen_by_one_half_and_judged_by_the_other():
    warm, zero = torch.ones(4, 2), torch.ones(4, 2)
    chosen, judged = zero.clone(), zero.clone()
    chosen[:2, 0], judged[:, 0] = 3.0, torch.tensor([2.0, 4.0, 9.0, 9.0])
    found = initial_state._cases({"zero": [chosen, judged], "observed": [warm, warm]})
    assert found["clips"] == 2 and found["hop (m/s²)"]["zero"] == [3.0, 1.0]
    assert initial_state._cases({"zero": [warm, judged], "observed": [warm, warm]})["clips"] == 0
