"""Noise where it belongs, filters that are tuned, and errors whose size is known."""

import json

import pytest
import torch

from experiments.strnn import denoising
from motionlab.errors import DataError
from motionlab.training import PRESETS, Prepared, build
from motionlab.training.checkpoints import save_weights
from motionlab.training.strnn import in_body_frame


@pytest.fixture(scope="module")
def data(walks):
    return in_body_frame(walks)


def test_noise_lies_on_joints_and_on_bits_alone(data):
    pose, root, bits = (data.encoding.slices[part] for part in ("pose", "root", "contacts"))
    seen = denoising.windows(data, "val", 64, (0.3, 3.0), seed=0)
    off = (seen.noisy - seen.clean) / data.normalizer.std
    moving = data.normalizer.std[pose] > 2e-3
    assert off[..., pose].std((0, 1))[moving] == pytest.approx(0.3, rel=0.05)
    assert off[..., root].abs().max() == 0
    assert set(seen.noisy[..., bits].unique().tolist()) == {0, 1}
    assert 0.3 < (seen.noisy != seen.clean)[..., bits].float().mean() < 0.5
    plain = denoising.windows(data, "val", 64, (0.0, 0.0), seed=0)
    assert torch.equal(plain.clean, seen.clean) and torch.equal(plain.noisy, plain.clean)
    other = denoising.windows(data, "val", 64, (0.0, 0.0), seed=1)
    assert not torch.equal(other.clean, plain.clean)


def test_errors_are_of_joints(data):
    clean = denoising.windows(data, "val", 8, (0.0, 0.0), seed=0).clean
    found = clean.clone()
    found[..., data.encoding.slices["root"]] += 9
    assert set(denoising.errors(data, found, clean).values()) == {0}
    found[..., :3] += torch.tensor([0.03, 0.0, 0.04])  # one joint, by 5 cm
    its = denoising.errors(data, found, clean)
    joints = data.encoding.skeleton.joints - 1
    assert its["mean joint error (cm)"] == pytest.approx(5 / joints, rel=1e-3)
    units = torch.tensor([0.03, 0.0, 0.04]) / data.normalizer.std[:3]
    assert its["squared error"] == pytest.approx(float(units.square().sum()) / (3 * joints), rel=1e-3)  # fmt: skip


def test_filters_leave_a_straight_line_and_what_has_no_noise(data):
    clip = denoising.windows(data, "val", 2, (0.0, 0.0), seed=0).clean
    line = clip[:, :1] + torch.linspace(0, 1, clip.shape[1])[:, None]
    for ways in (denoising.gaussians(data), denoising.savitzky(data)):
        for way in ways.values():
            off = (way(line) - line).abs()
            assert off[:, 20:-20].max() < 1e-4
            assert off[..., data.encoding.slices["root"]].max() == 0


def test_more_noise_asks_for_a_wider_filter_and_it_is_chosen_elsewhere(data):
    width, left = [], []
    for noise in (0.2, 1.0):
        tuning, judged = (
            denoising.windows(data, split, 64, (noise, 0.0), seed)
            for split, seed in (("train", 1), ("val", 2))
        )
        found = denoising.tuned(data, denoising.gaussians(data), tuning, judged)
        again = denoising.tuned(data, denoising.gaussians(data), tuning, tuning)
        assert found["chosen"] == again["chosen"] and found != again
        width.append(float(found["chosen"].split()[0]))
        left.append(found["squared error"])
        nothing = denoising.errors(data, judged.noisy, judged.clean)
        assert found["squared error"] < nothing["squared error"]
    assert width[0] < width[1] and left[0] < left[1]


def test_a_result_is_written(data, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Prepared, "find", lambda name: data)
    monkeypatch.setattr(denoising, "WIENER_FRAMES", 3)  # of few walks no more can be learned
    monkeypatch.setattr(denoising, "WIENER_STEP", 1)
    for name in ("strnn-temporal-hy", "conv-autoencoder"):
        save_weights(f"{name}.safetensors", build(data, PRESETS[name]["smoke"]), {"name": name})
    denoising.main(["strnn-temporal-hy.safetensors", "conv-autoencoder.safetensors",
                    "--windows", "16", "--output", "found.json"])  # fmt: skip
    found = json.loads((tmp_path / "found.json").read_text())
    assert [*found["rows"]] == [*denoising.ROWS]
    row = found["rows"]["positions 0.3"]
    assert row["nothing"]["squared error"] == pytest.approx(0.09, rel=0.1)
    assert row["wiener"]["squared error"] < row["gaussian"]["squared error"] < 0.09
    assert found["rows"]["clean"]["nothing"]["squared error"] == 0
    with pytest.raises(DataError, match="is a Strnn; a ConvAutoencoder is asked for"):
        denoising.main(["strnn-temporal-hy.safetensors"] * 2)
